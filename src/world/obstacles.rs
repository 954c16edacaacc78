//! Obstacle geometry without an index.

use crate::geometry::{Aabb, Polygon, Vec2};

/// Solid polygons and single points, all in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Obstacles {
    /// Solid polygons; they may touch or overlap.
    pub polygons: Vec<Polygon>,
    /// Single points, as a range sensor sees them.
    pub points: Vec<Vec2>,
}

impl Obstacles {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.polygons.is_empty() && self.points.is_empty()
    }

    /// Every polygon edge, and every point as an edge of length zero.
    pub fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        let points = self.points.iter().map(|&p| (p, p));
        self.polygons.iter().flat_map(Polygon::edges).chain(points)
    }

    /// The smallest box around everything.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(self.edges().map(|(a, _)| a))
    }
}
