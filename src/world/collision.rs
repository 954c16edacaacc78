//! Exact swept collision.
use super::Obstacles;
use crate::curves::{Path, Segment};
use crate::geometry::{Pose, Vec2};
use crate::vehicle::Vehicle;

/// Obstacles indexed for swept checks of one footprint.
#[derive(Clone, Debug)]
pub struct CollisionWorld {}

impl CollisionWorld {
    /// Indexes `obstacles` for `vehicle` grown by `margin` metres. `bounds`: corners of the
    /// box that the rear axle stays in, counter-clockwise.
    pub fn new(_o: &Obstacles, _b: Option<[Vec2; 4]>, _v: &Vehicle, _margin: f64) -> Self {
        unimplemented!()
    }
    /// The same obstacles with another margin.
    pub fn with_margin(self, _v: &Vehicle, _margin: f64) -> Self {
        unimplemented!()
    }
    /// Whether the footprint at `pose` touches nothing and its axle is in bounds.
    pub fn pose_is_free(&self, _pose: Pose) -> bool {
        unimplemented!()
    }
    /// Whether driving `segment` from the free pose `start` touches nothing.
    pub fn segment_is_free(&self, _start: Pose, _segment: Segment) -> bool {
        unimplemented!()
    }
    /// Whether the whole path, its start included, touches nothing.
    pub fn path_is_free(&self, _path: &Path) -> bool {
        unimplemented!()
    }
}
