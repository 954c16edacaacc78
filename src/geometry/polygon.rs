//! Simple polygons.

use super::{Aabb, Pose, Vec2};

/// A simple, solid polygon, not necessarily convex, closed implicitly.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    vertices: Vec<Vec2>,
}

/// Why a list of vertices is not a polygon (or a polyline).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PolygonError {
    /// Fewer than three vertices (two of a polyline).
    #[error("has {vertices} vertices; at least {needed} needed")]
    TooFewVertices {
        /// How many there are.
        vertices: usize,
        /// How many there must be.
        needed: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {0} is not a finite point")]
    NotFinite(usize),
}

impl Polygon {
    /// Checks and takes the vertices, in either orientation.
    pub fn new(vertices: Vec<Vec2>) -> Result<Self, PolygonError> {
        if let Some(i) = vertices.iter().position(|v| !(v.x.is_finite() && v.y.is_finite())) {
            return Err(PolygonError::NotFinite(i));
        }
        if vertices.len() < 3 {
            return Err(PolygonError::TooFewVertices { vertices: vertices.len(), needed: 3 });
        }
        Ok(Self { vertices })
    }

    /// The rectangle from `min` to `max` in the frame of `pose`.
    pub fn rectangle(pose: Pose, local: Aabb) -> Self {
        Self { vertices: local.corners().iter().map(|&c| pose.point_to_parent(c)).collect() }
    }

    /// The vertices in their given order.
    pub fn vertices(&self) -> &[Vec2] {
        &self.vertices
    }

    /// The edges in order, the closing edge last.
    pub fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        let (first, others) = self.vertices.split_at(1);
        self.vertices.iter().copied().zip(others.iter().chain(first).copied())
    }

    /// Whether `p` lies inside (even-odd rule; points on the border may go either way).
    pub fn contains(&self, p: Vec2) -> bool {
        is_within(p, self.edges())
    }

    /// The polygon with every vertex mapped by `f`.
    pub fn map(&self, f: impl FnMut(Vec2) -> Vec2) -> Self {
        Self { vertices: self.vertices.iter().copied().map(f).collect() }
    }

    /// The smallest box around it.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(self.vertices.iter().copied())
    }
}

/// [`Polygon::contains`] for the polygon of these `edges`.
pub(crate) fn is_within(p: Vec2, edges: impl Iterator<Item = (Vec2, Vec2)>) -> bool {
    let mut inside = false;
    for (a, b) in edges {
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
    }
    inside
}

/// The part of a convex polygon inside `bx` (Sutherland & Hodgman 1974).
pub(crate) fn part_within(polygon: Vec<Vec2>, bx: &Aabb) -> Vec<Vec2> {
    // Each side as the signed distance to its inside.
    let sides: [&dyn Fn(Vec2) -> f64; 4] =
        [&|p| p.x - bx.min.x, &|p| bx.max.x - p.x, &|p| p.y - bx.min.y, &|p| bx.max.y - p.y];
    sides.iter().fold(polygon, |polygon, inside| {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &b) in polygon.iter().enumerate() {
            let a = polygon[(i + polygon.len() - 1) % polygon.len()];
            let (da, db) = (inside(a), inside(b));
            if (da < 0.0) != (db < 0.0) {
                kept.push(a + (b - a) * (da / (da - db)));
            }
            if db >= 0.0 {
                kept.push(b);
            }
        }
        kept
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_notch_is_outside() {
        let v = [(0., 0.), (4., 0.), (4., 4.), (2., 1.), (0., 4.)];
        let p = Polygon::new(v.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap();
        assert!(p.contains(Vec2::new(0.5, 1.0)) && !p.contains(Vec2::new(2.0, 2.0)));
    }

    #[test]
    fn refuses_nan_and_two_points() {
        assert!(Polygon::new(vec![Vec2::zeros(); 2]).is_err());
        let bad = vec![Vec2::zeros(), Vec2::new(f64::NAN, 0.0), Vec2::new(1.0, 1.0)];
        assert_eq!(Polygon::new(bad), Err(PolygonError::NotFinite(1)));
    }
}
