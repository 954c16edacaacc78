//! World ↔ local frames that may be mirrored.
//!
//! A spot on the driver's left gives a left-handed spot frame. Driving is
//! mirror-symmetric, so the scene is mirrored, planned, and the path mirrored back.

use super::{Pose, Vec2, wrap_angle};

/// A rigid frame, optionally with its y axis flipped (left-handed).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Origin and direction of +x, in the world.
    pub origin_in_world: Pose,
    /// Whether +y points to the right of +x.
    pub mirrored: bool,
}

impl Frame {
    /// The frame that is the world itself.
    pub const WORLD: Frame = Frame { origin_in_world: Pose::new(0.0, 0.0, 0.0), mirrored: false };

    /// How world points are seen from this frame. Its sine and cosine are taken only once.
    pub fn view(&self) -> impl Fn(Vec2) -> Vec2 + use<> {
        let Self { origin_in_world: origin, mirrored } = *self;
        let (sin, cos) = origin.sin_cos();
        let side = if mirrored { -1.0 } else { 1.0 };
        move |p| {
            let (dx, dy) = (p.x - origin.x, p.y - origin.y);
            Vec2::new(cos * dx + sin * dy, side * (cos * dy - sin * dx))
        }
    }

    /// A point of this frame, in the world.
    pub fn world_from_local_point(&self, p: Vec2) -> Vec2 {
        self.origin_in_world.point_to_parent(self.flip_point(p))
    }

    /// A world pose, seen from this frame; heading in (−π, π].
    pub fn local_from_world(&self, pose: Pose) -> Pose {
        self.flip_pose(self.origin_in_world.relative(pose))
    }

    /// A pose of this frame, in the world; heading in (−π, π].
    pub fn world_from_local(&self, pose: Pose) -> Pose {
        self.origin_in_world.compose(self.flip_pose(pose))
    }

    /// A curvature of this frame, in the world (and the reverse): left turns become
    /// right turns in a mirror.
    pub fn flip_curvature(&self, curvature: f64) -> f64 {
        if self.mirrored { -curvature } else { curvature }
    }

    fn flip_point(&self, p: Vec2) -> Vec2 {
        if self.mirrored { Vec2::new(p.x, -p.y) } else { p }
    }

    fn flip_pose(&self, p: Pose) -> Pose {
        if self.mirrored { Pose::new(p.x, -p.y, wrap_angle(-p.heading)) } else { p }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::signed_angle;

    #[test]
    fn round_trip_plain_and_mirrored() {
        for mirrored in [false, true] {
            let frame = Frame { origin_in_world: Pose::new(5e5, -2e5, 2.1), mirrored };
            let pose = Pose::new(5e5 + 3.0, -2e5 + 1.0, -3.0);
            let back = frame.world_from_local(frame.local_from_world(pose));
            assert!(back.distance(pose) < 1e-9);
            let point = frame.view()(pose.position());
            assert!((point - frame.local_from_world(pose).position()).norm() < 1e-9);
            assert!(signed_angle(back.heading, pose.heading).abs() < 1e-12);
        }
    }

    #[test]
    fn a_mirrored_frame_sees_left_as_right() {
        let frame = Frame { origin_in_world: Pose::default(), mirrored: true };
        assert_eq!(frame.local_from_world(Pose::new(1.0, 2.0, 0.5)), Pose::new(1.0, -2.0, -0.5));
        assert_eq!(frame.view()(Vec2::new(1.0, 2.0)), Vec2::new(1.0, -2.0));
    }
}
