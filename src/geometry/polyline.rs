//! Open chains of straight walls.

use super::{Aabb, PolygonError, Vec2};

/// Two or more points joined by walls of no thickness; not closed.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    vertices: Vec<Vec2>,
}

impl Polyline {
    /// Checks and takes the vertices.
    pub fn new(vertices: Vec<Vec2>) -> Result<Self, PolygonError> {
        if let Some(i) = vertices.iter().position(|v| !(v.x.is_finite() && v.y.is_finite())) {
            return Err(PolygonError::NotFinite(i));
        }
        if vertices.len() < 2 {
            return Err(PolygonError::TooFewVertices { vertices: vertices.len(), needed: 2 });
        }
        Ok(Self { vertices })
    }

    /// The vertices in their given order.
    pub fn vertices(&self) -> &[Vec2] {
        &self.vertices
    }

    /// The walls in order, then the last vertex as a wall of length zero: every vertex is the
    /// first end of one edge, as in a [`Polygon`](super::Polygon).
    pub fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        let last = self.vertices.last().copied();
        self.vertices.iter().copied().zip(self.vertices.iter().skip(1).copied().chain(last))
    }

    /// The smallest box around it.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(self.vertices.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_vertex_begins_an_edge() {
        let v = [(0., 0.), (4., 0.), (4., 4.)].map(|(x, y)| Vec2::new(x, y));
        let edges: Vec<_> = Polyline::new(v.to_vec()).unwrap().edges().collect();
        assert_eq!(edges, [(v[0], v[1]), (v[1], v[2]), (v[2], v[2])]);
        assert!(Polyline::new(v[..1].to_vec()).is_err());
    }
}
