//! Finds the obstacle edges near a box.
//!
//! Edges are grouped into clusters of a few that lie together (a polygon's own edges, or
//! neighbouring points), each with a box. A query tests the boxes one after the other:
//! for the tens to hundreds of clusters of a parking scene this beats a tree.

use std::ops::Range;

use crate::geometry::{Aabb, Vec2, is_within};
use crate::world::Obstacles;

/// Edges per cluster.
const CLUSTER: usize = 8;

#[derive(Clone, Debug, Default)]
pub(super) struct EdgeIndex {
    clusters: Vec<Cluster>,
    /// All edges of each polygon.
    polygons: Vec<Cluster>,
    edges: Vec<(Vec2, Vec2)>,
}

/// Edges that lie together.
#[derive(Clone, Debug)]
struct Cluster {
    aabb: Aabb,
    /// Which edges of the index.
    edges: Range<usize>,
}

impl EdgeIndex {
    pub fn new(obstacles: &Obstacles) -> Self {
        let (polygons, walls) = (obstacles.polygons(), obstacles.polylines());
        let vertices = polygons.iter().map(|p| p.vertices().len()).sum::<usize>()
            + walls.iter().map(|w| w.vertices().len()).sum::<usize>();
        let edges = vertices + obstacles.points().len();
        let mut index = Self {
            clusters: Vec::with_capacity(polygons.len() + walls.len() + edges / CLUSTER + 1),
            polygons: Vec::with_capacity(polygons.len()),
            edges: Vec::with_capacity(edges),
        };
        for polygon in polygons {
            let edges = index.add(polygon.edges());
            index.polygons.push(Cluster { aabb: polygon.aabb(), edges });
        }
        for wall in walls {
            index.add(wall.edges());
        }
        // Points in stripes of two metres, so that a cluster's points lie together.
        let mut points = obstacles.points().to_vec();
        points.sort_by(|a, b| {
            let stripe = |p: &Vec2| (p.x / 2.0).floor();
            stripe(a).total_cmp(&stripe(b)).then(a.y.total_cmp(&b.y)).then(a.x.total_cmp(&b.x))
        });
        index.add(points.iter().map(|&p| (p, p)));
        index
    }

    /// Adds `edges` in clusters; returns their numbers.
    fn add(&mut self, edges: impl Iterator<Item = (Vec2, Vec2)>) -> Range<usize> {
        let all = self.edges.len();
        self.edges.extend(edges);
        let all = all..self.edges.len();
        for first in all.clone().step_by(CLUSTER) {
            let edges = first..all.end.min(first + CLUSTER);
            let ends = self.edges[edges.clone()].iter().flat_map(|&(a, b)| [a, b]);
            self.clusters.push(Cluster { aabb: Aabb::around(ends), edges });
        }
        all
    }

    /// Whether `p` lies inside a polygon.
    pub fn is_in_polygon(&self, p: Vec2) -> bool {
        self.polygons.iter().any(|Cluster { aabb, edges }| {
            aabb.contains(p) && is_within(p, self.edges[edges.clone()].iter().copied())
        })
    }

    /// The first edge for which `hit` holds, of the clusters that touch `near`.
    #[inline]
    pub fn first_near(
        &self,
        near: &Aabb,
        mut hit: impl FnMut(Vec2, Vec2) -> bool,
    ) -> Option<usize> {
        for Cluster { aabb, edges } in &self.clusters {
            if aabb.intersects(near) {
                let hit = self.edges[edges.clone()].iter().position(|&(a, b)| hit(a, b));
                if let Some(i) = hit {
                    return Some(edges.start + i);
                }
            }
        }
        None
    }

    /// The edge of a number given by [`EdgeIndex::first_near`]; `None` for a number of another
    /// index that this one does not have.
    pub fn edge(&self, number: usize) -> Option<(Vec2, Vec2)> {
        self.edges.get(number).copied()
    }
}
