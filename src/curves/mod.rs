//! Curves a car can drive: runs of constant curvature, and Reeds-Shepp words.
//!
//! Every motion in this crate, a search primitive as well as a segment of a
//! Reeds-Shepp curve, is a [`Segment`]; every plan is a [`Path`]. Read [`Segment`] first, then
//! [`mod@reeds_shepp`].

mod path;
pub mod reeds_shepp;
mod segment;

pub use path::{Path, Sample};
pub use segment::Segment;
