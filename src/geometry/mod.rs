//! Plane geometry without a car in it: poses, rigid frames, boxes, segments, polygons.
//!
//! Metres and radians, counter-clockwise positive, `f64`. Points and vectors are
//! nalgebra's [`Vec2`]. Read [`pose`] first, then [`frame`].

mod aabb;
pub mod frame;
mod polygon;
mod polyline;
pub mod pose;
mod segment;

pub use aabb::Aabb;
pub use frame::Frame;
pub(crate) use polygon::is_within;
pub(crate) use polygon::part_within;
pub use polygon::{Polygon, PolygonError};
pub use polyline::Polyline;
pub use pose::{Pose, signed_angle, wrap_angle};
pub use segment::{distance_to_segment, segment_in_box};

/// A point or a vector of the plane, metres.
pub type Vec2 = nalgebra::Vector2<f64>;
