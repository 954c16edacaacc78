//! The same scene in another place.

use super::{DrivableArea, LowObstacles, PreviousPath, Scene};
use crate::geometry::{Aabb, Frame, Pose, Vec2};
use crate::vehicle::Margins;

impl Scene {
    /// The scene moved, turned and perhaps mirrored, as `frame` lies in the world. Bounds stay
    /// parallel to the axes and grow about what they held.
    pub fn placed(&self, frame: &Frame) -> Scene {
        let point = |v: &[f64; 2]| frame.world_from_local_point(Vec2::new(v[0], v[1]));
        let pose = |p: Pose| frame.world_from_local(p);
        let points =
            |list: &[[f64; 2]]| -> Vec<[f64; 2]> { list.iter().map(|v| point(v).into()).collect() };
        let lists = |lists: &[Vec<[f64; 2]>]| lists.iter().map(|list| points(list)).collect();
        let angle = |steer: f64| frame.flip_curvature(steer);
        let angles = |list: &[f64]| -> Vec<f64> { list.iter().map(|&a| angle(a)).collect() };
        let previous = |path: &PreviousPath| PreviousPath {
            poses: path.poses.iter().map(|&p| pose(p.into()).into()).collect(),
            steer: angles(&path.steer),
            steer_from: path.steer_from.as_deref().map(angles),
            steer_to: path.steer_to.as_deref().map(angles),
            ..path.clone()
        };
        let own = |&[x, y]: &[f64; 2]| [x, angle(y)];
        Scene {
            contour: self.contour.iter().map(own).collect(),
            margins: self.margins.map(|m| if frame.mirrored { Margins::mirrored(m) } else { m }),
            start: pose(self.start),
            start_steer: angle(self.start_steer),
            previous: self.previous.as_ref().map(previous),
            goal: pose(self.goal),
            goals: self.goals.iter().map(|&p| pose(p)).collect(),
            obstacles: lists(&self.obstacles),
            polylines: lists(&self.polylines),
            points: points(&self.points),
            low: LowObstacles {
                obstacles: lists(&self.low.obstacles),
                polylines: lists(&self.low.polylines),
                points: points(&self.low.points),
            },
            drivable_area: self
                .drivable_area
                .as_ref()
                .map(|area| DrivableArea { outer: points(&area.outer), holes: lists(&area.holes) }),
            bounds: self.bounds.map(|[a, b, c, d]| {
                let corners = [[a, b], [c, b], [c, d], [a, d]];
                let Aabb { min, max } = Aabb::around(corners.map(|v| point(&v)));
                [min.x, min.y, max.x, max.y]
            }),
            ..self.clone()
        }
    }
}
