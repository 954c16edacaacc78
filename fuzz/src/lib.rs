//! What is fuzzed: one function for each target of `fuzz_targets/`, which panics where a law is broken.
//!
//! - [`texts`]: scenes, vehicles, settings and paths as texts
//! - [`models`]: model files, their checksums mended so that the fuzzer gets behind them
//! - [`scenes`], [`plans`]: the planner on structured random scenes
//! - [`check`]: a check of paths that shares nothing with the planner's
//! - [`door`], [`c_door`]: the doors with any numbers at all
//! - `lab`: files of the laboratory, and its own check of paths (feature `lab`)

mod c_door;
mod check;
mod door;
#[cfg(feature = "lab")]
mod lab;
mod models;
mod plans;
mod scenes;
mod seeds;
mod texts;

pub use c_door::c_door;
pub use door::door;
#[cfg(feature = "lab")]
pub use lab::{lab_files, oracle};
pub use models::{knn, patched_model, tensors};
pub use plans::planner;
pub use seeds::write_seeds;
pub use texts::{path_file, scene_json, settings, tpcap, vehicle_toml};
