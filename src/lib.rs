//! N3P: automated parking with a learned preparatory pose.
//!
//! The car drives to a *preparatory pose* that a model chose near the spot, and parks from
//! there along one Reeds-Shepp curve. This crate collects the data, trains the models, plans,
//! and evaluates.
//!
//! A scene becomes a [`planners::Problem`]; a [`planners::Planner`] turns it into a
//! [`curves::Path`]. N3P itself is [`selectors::guided::GuidedPlanner`]. `examples/plan_scene.rs`
//! shows the three together on one page. Metres, radians, counter-clockwise; a pose is that of
//! the rear-axle centre.
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
//! - [`nn`]: pieces of neural networks
//! - [`selectors`]: preparatory poses by KNN and MLP, and N3P itself
//! - [`rl`]: policies of reinforcement learning, and the environment they park in
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
pub mod nn;
pub mod planners;
pub mod progress;
pub mod rl;
pub mod rng;
pub mod selectors;
pub mod training;
pub mod vehicle;
pub mod world;

/// The programs in the README compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
