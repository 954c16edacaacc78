//! Finds the obstacle edges near a box.
//!
//! Edges are grouped into clusters of a few that lie together (a polygon's own edges, or
//! neighbouring points), each with a box. A query tests the boxes one after the other:
//! for the tens to hundreds of clusters of a parking scene this beats a tree. The clusters of
//! whole maps lie in a tree of boxes; those about where the car is to drive are kept apart besides, so that most queries
//! cost no more than in a small scene.

use std::ops::Range;

use crate::geometry::{Aabb, Vec2, is_within};
use crate::world::Obstacles;

/// Edges per cluster.
const CLUSTER: usize = 8;
/// Clusters are tested one after the other up to so many.
const FEW: usize = 256;
/// Boxes under one box of the tree.
const FAN: usize = 8;

#[derive(Clone, Debug, Default)]
pub(super) struct EdgeIndex {
    clusters: Clusters,
    /// All edges of each polygon.
    polygons: Clusters,
    edges: Vec<(Vec2, Vec2)>,
}

/// Edges that lie together.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    aabb: Aabb,
    /// Which edges of the index: the first, and the one after the last.
    edges: [u32; 2],
}

impl Cluster {
    fn edges(&self) -> Range<usize> {
        self.edges[0] as usize..self.edges[1] as usize
    }
}

/// Clusters, and where they are many a tree of boxes over them.
#[derive(Clone, Debug, Default)]
struct Clusters {
    all: Vec<Cluster>,
    /// Boxes around [`FAN`] boxes each, of the clusters first, up to a level with a few.
    levels: Vec<Vec<Aabb>>,
    focus: Option<Box<Focus>>,
}

/// The clusters of many that touch an area.
#[derive(Clone, Debug)]
struct Focus {
    area: Aabb,
    clusters: Clusters,
}

impl Clusters {
    fn new(all: Vec<Cluster>) -> Self {
        Self::in_a_tree_above(FEW, all)
    }

    /// A tree where there are more than `few`.
    fn in_a_tree_above(few: usize, mut all: Vec<Cluster>) -> Self {
        let mut levels: Vec<Vec<Aabb>> = Vec::new();
        if all.len() > few {
            along_a_curve(&mut all, |c| (c.aabb.min + c.aabb.max) * 0.5);
            let mut below: Vec<Aabb> = all.iter().map(|c| c.aabb).collect();
            while below.len() > FAN {
                let around =
                    |boxes: &[Aabb]| Aabb::around(boxes.iter().flat_map(|b| [b.min, b.max]));
                let level: Vec<Aabb> = below.chunks(FAN).map(around).collect();
                levels.push(level.clone());
                below = level;
            }
        }
        Self { all, levels, focus: None }
    }

    /// Keeps what touches `area` apart, where there is much else.
    fn focus(&mut self, area: Aabb) {
        if self.levels.is_empty() {
            return;
        }
        let mut near = Vec::new();
        self.find(&area, |cluster| {
            near.push(*cluster);
            None::<()>
        });
        self.focus = Some(Box::new(Focus { area, clusters: Self::in_a_tree_above(FEW / 8, near) }));
    }

    /// The clusters among which all lie that touch `near`.
    #[inline]
    fn about(&self, near: &Aabb) -> &Self {
        match &self.focus {
            Some(f) if f.area.contains(near.min) && f.area.contains(near.max) => &f.clusters,
            _ => self,
        }
    }

    /// The first result of `look` at the clusters that touch `near`.
    #[inline]
    fn find<T>(&self, near: &Aabb, mut look: impl FnMut(&Cluster) -> Option<T>) -> Option<T> {
        let clusters = self.about(near);
        if clusters.levels.is_empty() {
            return Self::find_among(&clusters.all, near, &mut look);
        }
        clusters.find_below(clusters.levels.len(), 0, near, &mut look)
    }

    #[inline]
    fn find_among<T>(
        clusters: &[Cluster],
        near: &Aabb,
        look: &mut impl FnMut(&Cluster) -> Option<T>,
    ) -> Option<T> {
        for cluster in clusters {
            if cluster.aabb.intersects(near) {
                let found = look(cluster);
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    /// [`Clusters::find`] among what is under box `number` of the level above `level`.
    fn find_below<T>(
        &self,
        level: usize,
        number: usize,
        near: &Aabb,
        look: &mut impl FnMut(&Cluster) -> Option<T>,
    ) -> Option<T> {
        let part = |length: usize| (number * FAN).min(length)..(number * FAN + FAN).min(length);
        let Some(below) = level.checked_sub(1) else {
            return Self::find_among(&self.all[part(self.all.len())], near, look);
        };
        let boxes = &self.levels[below];
        part(boxes.len()).find_map(|i| {
            boxes[i].intersects(near).then(|| self.find_below(below, i, near, look)).flatten()
        })
    }
}

/// Side of a square that would hold some dozens of these points if they lay evenly.
fn some_dozens(points: &[Vec2]) -> f64 {
    const DOZENS: f64 = 32.0;
    let extent = Aabb::around(points.iter().copied());
    let size = extent.max - extent.min;
    size.x.max(size.y).max(f64::MIN_POSITIVE) / (points.len() as f64 / DOZENS).sqrt()
}

/// Sorts what lies in the plane along a curve on which neighbours lie together (Morton 1966).
fn along_a_curve<T: Copy>(all: &mut [T], place: impl Fn(&T) -> Vec2) {
    let extent = Aabb::around(all.iter().map(&place));
    let size = extent.max - extent.min;
    let steps = f64::from(u16::MAX) / size.x.max(size.y).max(f64::MIN_POSITIVE);
    let spread = |v: f64| {
        let mut bits = (v * steps) as u32 & 0xffff;
        for (shift, mask) in
            [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)]
        {
            bits = (bits | bits << shift) & mask;
        }
        bits
    };
    let key = |one: &T| {
        let p = place(one) - extent.min;
        spread(p.x) | spread(p.y) << 1
    };
    let keyed = by_key(all.iter().map(key).zip(0..).collect());
    let sorted: Vec<T> = keyed.into_iter().map(|(_, i)| all[i as usize]).collect();
    all.copy_from_slice(&sorted);
}

/// Numbers in the order of their keys, those with equal keys as they were: half a key at a time, the low half first.
fn by_key(mut keyed: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
    let mut other = vec![(0, 0); keyed.len()];
    for shift in [0, 16] {
        let half = |key: u32| (key >> shift) as usize & 0xffff;
        let mut places = vec![0_u32; 1 << 16];
        keyed.iter().for_each(|&(key, _)| places[half(key)] += 1);
        let mut before = 0;
        for place in &mut places {
            (*place, before) = (before, before + *place);
        }
        for &one in &keyed {
            let place = &mut places[half(one.0)];
            other[*place as usize] = one;
            *place += 1;
        }
        std::mem::swap(&mut keyed, &mut other);
    }
    keyed
}

impl EdgeIndex {
    pub fn new(obstacles: &Obstacles) -> Self {
        let (solids, walls) = (obstacles.polygons(), obstacles.polylines());
        let vertices = solids.iter().map(|p| p.vertices().len()).sum::<usize>()
            + walls.iter().map(|w| w.vertices().len()).sum::<usize>();
        let count = vertices + obstacles.points().len();
        let mut edges = Vec::with_capacity(count);
        let mut clusters = Vec::with_capacity(solids.len() + walls.len() + count / CLUSTER + 1);
        let mut polygons = Vec::with_capacity(solids.len());
        let mut add = |new: &mut dyn Iterator<Item = (Vec2, Vec2)>| {
            let first = edges.len();
            edges.extend(new);
            for first in (first..edges.len()).step_by(CLUSTER) {
                let end = edges.len().min(first + CLUSTER);
                let ends = edges[first..end].iter().flat_map(|&(a, b)| [a, b]);
                let aabb = Aabb::around(ends);
                clusters.push(Cluster { aabb, edges: [first, end].map(|i| i as u32) });
            }
            [first, edges.len()].map(|i| i as u32)
        };
        for polygon in solids {
            let edges = add(&mut polygon.edges());
            polygons.push(Cluster { aabb: polygon.aabb(), edges });
        }
        for wall in walls {
            add(&mut wall.edges());
        }
        let mut points = obstacles.points().to_vec();
        let many = points.len() > FEW * CLUSTER;
        if many {
            along_a_curve(&mut points, |&p| p);
        } else {
            // In stripes of two metres, so that a cluster's points lie together.
            points.sort_by(|a, b| {
                let stripe = |p: &Vec2| (p.x / 2.0).floor();
                let stripes = stripe(a).total_cmp(&stripe(b));
                stripes.then(a.y.total_cmp(&b.y)).then(a.x.total_cmp(&b.x))
            });
        }
        let mut together = |points: &[Vec2]| {
            let first = edges.len();
            edges.extend(points.iter().map(|&p| (p, p)));
            let aabb = Aabb::around(points.iter().copied());
            clusters.push(Cluster { aabb, edges: [first, edges.len()].map(|i| i as u32) });
        };
        if many {
            // Neighbours on the curve may lie far apart where little is between them: not in one cluster.
            let per_metre = 1.0 / some_dozens(&points);
            let cell = |p: Vec2| ((p.x * per_metre).floor(), (p.y * per_metre).floor());
            let (mut first, mut of_first) = (0, cell(points[0]));
            for i in 1..points.len() {
                let of_this = cell(points[i]);
                if i - first == CLUSTER || of_this != of_first {
                    together(&points[first..i]);
                    (first, of_first) = (i, of_this);
                }
            }
            together(&points[first..]);
        } else {
            points.chunks(CLUSTER).for_each(together);
        }
        Self { clusters: Clusters::new(clusters), polygons: Clusters::new(polygons), edges }
    }

    /// Makes queries within `area` fast where there is much else.
    pub fn focus(&mut self, area: Aabb) {
        self.clusters.focus(area);
        self.polygons.focus(area);
    }

    /// The smallest box around everything.
    pub fn aabb(&self) -> Aabb {
        match self.clusters.levels.last() {
            Some(boxes) => Aabb::around(boxes.iter().flat_map(|b| [b.min, b.max])),
            None => Aabb::around(self.clusters.all.iter().flat_map(|c| [c.aabb.min, c.aabb.max])),
        }
    }

    /// Whether `p` lies inside a polygon.
    pub fn is_in_polygon(&self, p: Vec2) -> bool {
        let at = Aabb { min: p, max: p };
        let is_in = |c: &Cluster| is_within(p, self.edges[c.edges()].iter().copied()).then_some(());
        self.polygons.find(&at, is_in).is_some()
    }

    /// The first edge for which `hit` holds, of the clusters that touch `near`.
    #[inline]
    pub fn first_near(
        &self,
        near: &Aabb,
        mut hit: impl FnMut(Vec2, Vec2) -> bool,
    ) -> Option<usize> {
        self.clusters.find(near, |cluster| {
            let edges = cluster.edges();
            let hit = self.edges[edges.clone()].iter().position(|&(a, b)| hit(a, b));
            hit.map(|i| edges.start + i)
        })
    }

    /// The edge of a number given by [`EdgeIndex::first_near`]; `None` for a number of another
    /// index that this one does not have.
    pub fn edge(&self, number: usize) -> Option<(Vec2, Vec2)> {
        self.edges.get(number).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_finds_what_a_look_at_everything_finds() {
        let hash = |i: u32, k: u32| f64::from(i.wrapping_mul(k) >> 8) / f64::from(1 << 24) * 300.0;
        let points: Vec<Vec2> =
            (1..20_000).map(|i| Vec2::new(hash(i, 2_654_435_761), hash(i, 40_503_007))).collect();
        let obstacles = Obstacles::new(vec![], vec![], points.clone()).unwrap();
        let mut index = EdgeIndex::new(&obstacles);
        assert!(index.clusters.levels.len() >= 2);
        index.focus(Aabb::new(100.0, 100.0, 160.0, 170.0));
        assert!(index.clusters.focus.is_some());
        assert_eq!(index.aabb(), Aabb::around(points.iter().copied()));
        for i in 1..200 {
            let min = Vec2::new(hash(i, 97_003), hash(i, 7_919_111));
            let near = Aabb { min, max: min + Vec2::new(3.0, 5.0) };
            let mut seen = 0;
            index.first_near(&near, |a, _| {
                seen += usize::from(near.contains(a));
                false
            });
            assert_eq!(seen, points.iter().filter(|&&p| near.contains(p)).count());
        }
    }
}
