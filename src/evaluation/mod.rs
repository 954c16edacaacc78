//! Evaluation: every method on the same scenes, one row each, tables and reports.
//!
//! Reading order: a [`Method`] is built from [`Models`]; [`episode`] runs one method on
//! one scene, exports the path ([`export`]) and has it checked by the independent
//! [`oracle`]; [`suite`] does so for all; [`rows`] are saved; [`metrics`] summarises them,
//! [`quality`] compares their paths, [`clearance`] says how much room they leave, [`table`] lays them out beside the paper's, [`report`] writes them down, and [`html`] with
//! plots and a gallery of the paths that [`trace`] kept. [`draw`] makes pictures of scenes and
//! paths, [`trajectory_file`] puts a path in time. [`learning_curve`] is what experiments add: how much data is enough.

pub mod by_vehicle;
pub mod clearance;
pub mod draw;
pub mod episode;
pub mod export;
pub mod html;
pub mod learning_curve;
mod method;
pub mod metrics;
mod models;
pub mod oracle;
mod outputs;
pub mod quality;
pub mod report;
pub mod rows;
pub mod spot_report;
pub mod suite;
pub mod table;
pub mod trace;
pub mod trajectory_file;

pub use episode::{Case, Episode, EpisodeConfig};
pub use export::{PathFile, PathFileError};
pub use learning_curve::CurvePoint;
pub use method::{Method, MethodError, MethodSettings};
pub use models::{Models, ModelsError};
pub use outputs::{OutputError, Outputs};
pub use rows::Row;
pub use spot_report::SpotReport;
pub use suite::{SuiteConfig, SuiteError};
pub use trajectory_file::TrajectoryFile;
