//! What leaves the planner: paths and trajectories as files, and pictures.

pub mod drawing;
mod geojson;
mod mcap;
pub(crate) mod path_file;
pub(crate) mod trajectory_file;
mod trajectory_plot;

pub use mcap::recording;
pub use path_file::{PathFile, PathFileError};
pub use trajectory_file::{Driven, TrajectoryFile};
pub use trajectory_plot::trajectory_svg;
