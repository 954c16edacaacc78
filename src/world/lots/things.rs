//! What stands in a car park: solid things, kerbs and walls of no thickness, points.

use crate::geometry::{Aabb, Polygon, Pose, Vec2, segment_in_box};

/// Everything that is in the way.
#[derive(Default)]
pub(super) struct Things {
    pub solids: Vec<Polygon>,
    /// Kerbs and thin walls, piece by piece.
    pub lines: Vec<[Vec2; 2]>,
    pub points: Vec<Vec2>,
}

impl Things {
    /// Adds a chain of straight pieces.
    pub fn line(&mut self, chain: &[Vec2]) {
        self.lines.extend(chain.windows(2).map(|w| [w[0], w[1]]));
    }

    /// Whether a box in the frame of `pose` shares no point with anything.
    pub fn leave(&self, pose: Pose, body: &Aabb) -> bool {
        let local = |p| pose.point_to_local(p);
        let is_free = |a, b| !segment_in_box(local(a), local(b), body);
        let centre = pose.point_to_parent((body.min + body.max) / 2.0);
        let reach = (body.max - body.min).norm() / 2.0;
        let is_near = |p: &Polygon| {
            let extent = p.aabb().inflated(reach);
            extent.contains(centre)
        };
        self.lines.iter().all(|&[a, b]| is_free(a, b))
            && self.points.iter().all(|&p| !body.contains(local(p)))
            && self
                .solids
                .iter()
                .filter(|p| is_near(p))
                .all(|solid| solid.edges().all(|(a, b)| is_free(a, b)) && !solid.contains(centre))
    }

    /// Adds a solid box in the frame of `pose` if it keeps `apart` metres from everything else.
    /// Whether it did.
    pub fn put(&mut self, pose: Pose, body: Aabb, apart: f64) -> bool {
        let fits = self.leave(pose, &body.inflated(apart));
        if fits {
            self.solids.push(Polygon::rectangle(pose, body));
        }
        fits
    }

    /// Every edge; points are none.
    pub fn edges(&self) -> impl Iterator<Item = [Vec2; 2]> + '_ {
        let solid = self.solids.iter().flat_map(|p| p.edges().map(|(a, b)| [a, b]));
        solid.chain(self.lines.iter().copied())
    }
}

/// A box around the origin.
pub(super) fn around(length: f64, width: f64) -> Aabb {
    Aabb::new(-length / 2.0, -width / 2.0, length / 2.0, width / 2.0)
}
