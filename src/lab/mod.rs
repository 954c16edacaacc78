//! The laboratory, above the planner: policies, data, training, evaluation, experiments.
//!
//! In reading order; each uses those above it and the planner, never one below.
//!
//! - [`progress`]: progress bars
//! - [`shards`]: work that processes share, and what a folder holds of it
//! - [`nn`]: pieces of neural networks
//! - [`rl`]: policies of reinforcement learning
//! - [`dataset`]: collecting samples into Parquet, and reading them back
//! - [`training`]: rows → artefacts
//! - [`driving`]: plans driven in closed loop by a car with lags and errors
//! - [`evaluation`]: the independent oracle, rows, tables, reports
//! - [`experiments`]: a whole pipeline from one versioned file
//! - [`volume`]: very many scenes, each planned once and checked

pub mod dataset;
pub mod driving;
pub mod evaluation;
pub mod experiments;
pub mod nn;
pub mod progress;
pub mod rl;
pub mod shards;
pub mod training;
pub mod volume;
