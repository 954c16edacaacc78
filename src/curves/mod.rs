//! Curves a car can drive: runs of constant curvature, and Reeds-Shepp words.
//!
//! Every motion in this crate, a search primitive as well as a segment of a
//! Reeds-Shepp curve, is a [`Segment`]; every plan is a [`Path`]. Read [`Segment`] first, then
//! [`mod@reeds_shepp`]. A [`Trajectory`] says when a car that drives a path is where.

mod path;
pub mod reeds_shepp;
mod segment;
pub mod trajectory;

pub use path::{Path, Sample};
pub use segment::Segment;
pub use trajectory::{Trajectory, TrajectoryLimits};
