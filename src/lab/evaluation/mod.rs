//! Evaluation: every method on the same scenes, one row each, tables and reports.
//!
//! Reading order: [`crate::episode`] runs one method on one scene and has its path checked by the
//! independent [`oracle`]; [`suite`] does so for all; [`rows`] are saved; [`metrics`] summarises them,
//! [`quality`] compares their paths, [`paired`] methods scene by scene, [`away`] scenes at home and elsewhere, [`clearance`] says how much room they leave, [`drives`] what became of those that were driven, [`table`] lays them out beside the paper's, [`report`] writes them down, and [`html`] with
//! plots and a gallery of the paths that [`trace`] kept. [`learning_curve`] is what experiments add: how much data is enough.

pub mod away;
pub mod clearance;
pub mod drives;
pub mod html;
pub mod learning_curve;
pub mod metrics;
pub mod oracle;
mod outputs;
pub mod paired;
pub mod quality;
pub mod report;
pub mod rows;
pub mod suite;
pub mod table;
pub mod trace;

pub use learning_curve::CurvePoint;
pub use outputs::{OutputError, Outputs, RunRecord};
pub use suite::{SuiteConfig, SuiteError};
