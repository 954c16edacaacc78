//! Experiments: the whole loop (collect, train, evaluate, report) from one versioned file.
//!
//! [`config`] is that file, `experiments/NAME.toml`; [`runner`] does what it says, stage by
//! stage, and compares a rerun with the committed rows.

pub mod config;
mod given;
mod learning_curve;
pub mod runner;
mod stages;

pub use config::{ConfigError, ExperimentConfig};
pub use given::Given;
pub use runner::ExperimentError;
