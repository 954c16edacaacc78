//! The same scene in another place.

use super::Scene;
use crate::geometry::{Aabb, Frame, Pose, Vec2};

impl Scene {
    /// The scene moved, turned and perhaps mirrored, as `frame` lies in the world. Bounds stay
    /// parallel to the axes and grow about what they held.
    pub fn placed(&self, frame: &Frame) -> Scene {
        let point = |v: &[f64; 2]| frame.world_from_local_point(Vec2::new(v[0], v[1]));
        let pose = |p: Pose| frame.world_from_local(p);
        Scene {
            start: pose(self.start),
            goal: pose(self.goal),
            goals: self.goals.iter().map(|&p| pose(p)).collect(),
            obstacles: self
                .obstacles
                .iter()
                .map(|o| o.iter().map(|v| point(v).into()).collect())
                .collect(),
            points: self.points.iter().map(|v| point(v).into()).collect(),
            bounds: self.bounds.map(|[a, b, c, d]| {
                let corners = [[a, b], [c, b], [c, d], [a, d]];
                let Aabb { min, max } = Aabb::around(corners.map(|v| point(&v)));
                [min.x, min.y, max.x, max.y]
            }),
            ..self.clone()
        }
    }
}
