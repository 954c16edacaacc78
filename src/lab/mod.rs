//! The laboratory, above the planner: policies, data, training, evaluation, experiments.
//!
//! In reading order; each uses those above it and the planner, never one below.
//!
//! - `progress`: progress bars; `toml_file`: files of settings
//! - `nn`: pieces of neural networks
//! - `rl`: policies of reinforcement learning, and the environment they park in
//! - `dataset`: collecting samples into Parquet, and reading them back
//! - `training`: rows → artefacts
//! - `evaluation`: the independent oracle, rows, tables, reports
//! - `experiments`: a whole pipeline from one versioned file
//!
//! The feature `environment` alone has the environment of [`rl`], and nothing else of all this.

#[cfg(feature = "lab")]
pub mod dataset;
#[cfg(feature = "lab")]
pub mod evaluation;
#[cfg(feature = "lab")]
pub mod experiments;
#[cfg(feature = "lab")]
pub mod nn;
#[cfg(feature = "lab")]
pub mod progress;
pub mod rl;
#[cfg(feature = "lab")]
pub mod toml_file;
#[cfg(feature = "lab")]
pub mod training;
