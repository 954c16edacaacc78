//! N3P: automated parking with a learned preparatory pose.
//!
//! The modules in reading order; each uses those above it, never one below.
//!
//! - [`rng`]: one seed, many named random streams
//! - [`files`]: files that are whole or absent, and plain words for what fails
//! - [`progress`]: progress bars
//! - [`geometry`]: poses, frames, polygons
//! - [`vehicle`]: dimensions, footprint, kinematics
//! - [`curves`]: segments, paths, Reeds-Shepp words
//! - [`world`]: scenes, exact swept collision, cells, the abstraction, the generator
//! - [`planners`]: the `Planner` trait and Hybrid A* with Reeds-Shepp expansion
//! - [`selectors`]: preparatory poses by KNN and MLP, and N3P itself
//! - [`dataset`]: collecting samples into Parquet, and reading them back
//! - [`training`]: rows → artefacts
//! - [`evaluation`]: episodes, the independent oracle, tables, reports
//! - [`experiments`]: a whole pipeline from one versioned file
//! - [`cli`]: arguments, output and exit codes of the binaries

#![warn(missing_docs)]

pub mod cli;
pub mod curves;
pub mod dataset;
pub mod evaluation;
pub mod experiments;
pub mod files;
pub mod geometry;
pub mod planners;
pub mod progress;
pub mod rng;
pub mod selectors;
pub mod training;
pub mod vehicle;
pub mod world;
