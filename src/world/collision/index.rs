//! Finds the obstacle edges near a box.
//!
//! Edges are grouped into clusters of a few that lie together (a polygon's own edges, or
//! neighbouring points), each with a box. A query tests the boxes one after the other:
//! for the tens to hundreds of clusters of a parking scene this beats a tree.

use crate::geometry::{Aabb, Vec2};
use crate::world::Obstacles;

/// Edges per cluster.
const CLUSTER: usize = 8;

#[derive(Clone, Debug, Default)]
pub(super) struct EdgeIndex {
    boxes: Vec<Aabb>,
    /// `starts[i]..starts[i + 1]` are the edges of cluster `i`.
    starts: Vec<u32>,
    edges: Vec<(Vec2, Vec2)>,
}

impl EdgeIndex {
    pub fn new(obstacles: &Obstacles) -> Self {
        let mut index = Self { starts: vec![0], ..Self::default() };
        let mut edges = Vec::new();
        for polygon in &obstacles.polygons {
            edges.clear();
            edges.extend(polygon.edges());
            index.add(&edges);
        }
        // Points in stripes of two metres, so that a cluster's points lie together.
        let mut points = obstacles.points.clone();
        points.sort_by(|a, b| {
            let stripe = |p: &Vec2| (p.x / 2.0).floor();
            stripe(a).total_cmp(&stripe(b)).then(a.y.total_cmp(&b.y)).then(a.x.total_cmp(&b.x))
        });
        edges.clear();
        edges.extend(points.iter().map(|&p| (p, p)));
        index.add(&edges);
        index
    }

    fn add(&mut self, edges: &[(Vec2, Vec2)]) {
        for cluster in edges.chunks(CLUSTER) {
            self.boxes.push(Aabb::around(cluster.iter().flat_map(|&(a, b)| [a, b])));
            self.edges.extend_from_slice(cluster);
            self.starts.push(self.edges.len() as u32);
        }
    }

    /// Whether `hit` holds for some edge of a cluster that touches `near`.
    #[inline]
    pub fn any_near(&self, near: &Aabb, mut hit: impl FnMut(Vec2, Vec2) -> bool) -> bool {
        for (i, b) in self.boxes.iter().enumerate() {
            if b.intersects(near) {
                let range = self.starts[i] as usize..self.starts[i + 1] as usize;
                if self.edges[range].iter().any(|&(a, b)| hit(a, b)) {
                    return true;
                }
            }
        }
        false
    }
}
