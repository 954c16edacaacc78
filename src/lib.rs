//! N3P: automated parking with a learned preparatory pose.
//!
//! The car drives to a *preparatory pose* that a model chose near the spot, and parks from
//! there along one Reeds-Shepp curve. This crate plans; its laboratory (feature `lab`) collects the
//! data, trains the models and evaluates.
//!
//! Who wants plans makes a [`Parker`] once and asks it as often as needed:
//!
//! ```
//! use n3p::geometry::Pose;
//! use n3p::{Lot, Parker, Vehicle};
//!
//! let parker = Parker::new(Vehicle::default())?;
//! let mut lot = Lot::new();
//! lot.polygon([[-4.1, -2.6], [-1.6, -2.6], [-1.6, 2.4], [-4.1, 2.4]]);
//! lot.polygon([[1.6, -2.6], [4.1, -2.6], [4.1, 2.4], [1.6, 2.4]]);
//! let goal = Pose::new(0.0, -1.4, std::f64::consts::FRAC_PI_2);
//! let plan = parker.plan(Pose::new(-9.0, 6.0, 0.0), goal, &lot)?;
//! println!("{:.1} m, {} changes of gear", plan.length(), plan.direction_changes());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A scene becomes a [`planners::Problem`]; a [`planners::Planner`] turns it into a
//! [`curves::Path`]. N3P itself is [`n3p::GuidedPlanner`]. `examples/plan_scene.rs`
//! shows the three together on one page. Metres, radians, counter-clockwise; a pose is that of
//! the rear-axle centre.
//!
//! The modules in reading order; each uses those above it, never one below (but for one file, through
//! which the laboratory's policies come to the methods of [`mod@n3p`]).
//!
//! - `rng` (feature `generate`): one seed, many named random streams
//! - [`files`]: files that are whole or absent, and plain words for what fails
//! - `toml_file` (feature `scene`): files of settings
//! - [`geometry`]: poses, frames, polygons
//! - [`vehicle`]: dimensions, footprint, kinematics
//! - [`curves`]: segments, paths, Reeds-Shepp words, clothoids, trajectories
//! - [`world`]: scenes, exact swept collision, cells, the abstraction, generators (feature `generate`)
//! - [`planners`]: the `Planner` trait and Hybrid A* with Reeds-Shepp expansion
//! - [`selectors`]: preparatory poses and manoeuvres: by KNN, by MLP, across vehicles
//! - [`mod@n3p`]: N3P itself, every method by name, and the models that serve a vehicle
//! - [`output`]: path and trajectory files, pictures
//! - [`episode`]: one method on one scene, timed and checked
//! - `environment` (feature of that name): what policies see, do and learn in
//! - `lab` (feature of that name): what learns and compares: policies, data, training, evaluation, experiments
//! - `cli` (feature `plan`): arguments, output and exit codes of the binaries

#![warn(missing_docs)]

#[cfg(feature = "plan")]
pub mod cli;
pub mod curves;
#[cfg(feature = "environment")]
pub mod environment;
pub mod episode;
pub mod files;
pub mod geometry;
#[cfg(feature = "lab")]
pub mod lab;
pub mod n3p;
pub mod output;
mod parker;
pub mod planners;
#[cfg(any(test, feature = "generate"))]
pub mod rng;
pub mod selectors;
#[cfg(feature = "scene")]
pub mod toml_file;
pub mod vehicle;
pub mod world;

pub use n3p::{Method, Models};
pub use parker::{Lot, Parker, ParkerError, Plan, PlanError, Request};
pub use vehicle::Vehicle;

/// The programs in the README compile and run.
#[cfg(all(doctest, feature = "lab"))]
#[doc = include_str!("../README.md")]
struct Readme;
