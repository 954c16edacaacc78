//! Curves a car can drive: runs of constant curvature, Reeds-Shepp words, and clothoids between them.
//!
//! Every motion in this crate, a search primitive as well as a segment of a
//! Reeds-Shepp curve, is a [`Segment`]; every plan is a [`Path`]. Read [`Segment`] first, then
//! [`mod@reeds_shepp`]. [`mod@smoothing`] makes a [`SmoothPath`] of a path, which the front wheels can follow
//! without a stop. A [`Trajectory`] says when a car that drives a path is where.

mod clothoid;
pub(crate) mod least_norm;
mod path;
pub mod reeds_shepp;
mod segment;
mod smooth_path;
pub mod smoothing;
pub mod trajectory;

pub use clothoid::Clothoid;
pub use path::{Path, Sample};
pub use segment::Segment;
pub use smooth_path::{SmoothPath, Step};
pub use trajectory::{Trajectory, TrajectoryLimits};
