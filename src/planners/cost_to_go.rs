//! The A* cost-to-go: how far the goal is for a disc among the obstacles.
//!
//! Shortest distances to the goal over a grid, with the largest disc around the rear axle
//! that the footprint always covers. Computed lazily: the wave from the goal advances only
//! as far as somebody asks (Dial's buckets, since steps cost 10 or 14 units).

use crate::geometry::{Aabb, Pose, Vec2, distance_to_segment};
use crate::world::Obstacles;

const UNKNOWN: u32 = u32::MAX;
const BLOCKED: u32 = u32::MAX - 1;
/// Costs are tenths of a cell: straight 10, diagonal 14.
const STEPS: [(i32, i32, u32); 8] = [
    (1, 0, 10),
    (-1, 0, 10),
    (0, 1, 10),
    (0, -1, 10),
    (1, 1, 14),
    (1, -1, 14),
    (-1, 1, 14),
    (-1, -1, 14),
];
const BUCKETS: usize = 16;

/// Grid distances to one goal. Buffers are reused from call to call.
#[derive(Debug, Default)]
pub(super) struct CostToGo {
    origin: Vec2,
    cell: f64,
    size: (i32, i32),
    costs: Vec<u32>,
    settled: Vec<bool>,
    buckets: [Vec<(i32, i32)>; BUCKETS],
    /// The cost whose bucket is being emptied.
    front: u32,
    /// Entries in all buckets.
    waiting: usize,
}

impl CostToGo {
    /// Prepares distances to `goal` within `domain` for a disc of `radius` metres.
    pub fn reset(
        &mut self,
        domain: &Aabb,
        cell: f64,
        radius: f64,
        obstacles: &Obstacles,
        goal: Pose,
    ) {
        let extent = domain.max - domain.min;
        self.origin = domain.min;
        self.cell = cell;
        self.size = ((extent.x / cell).ceil() as i32 + 1, (extent.y / cell).ceil() as i32 + 1);
        let n = (self.size.0 * self.size.1) as usize;
        self.costs.clear();
        self.costs.resize(n, UNKNOWN);
        self.settled.clear();
        self.settled.resize(n, false);
        self.buckets.iter_mut().for_each(Vec::clear);
        self.front = 0;
        self.waiting = 0;
        // A cell is blocked only if the disc collides from every point of it.
        self.block(obstacles, radius - cell * std::f64::consts::FRAC_1_SQRT_2);
        if let Some(c) = self.cell_of(goal.position()) {
            let i = self.index(c);
            self.costs[i] = 0;
            self.buckets[0].push(c);
            self.waiting = 1;
        }
    }

    /// Metres from `p` to the goal; infinite where the goal cannot be reached.
    pub fn distance(&mut self, p: Vec2) -> f64 {
        let Some(c) = self.cell_of(p) else { return f64::INFINITY };
        let i = self.index(c);
        while !self.settled[i] && self.waiting > 0 {
            self.advance();
        }
        if self.settled[i] { f64::from(self.costs[i]) * self.cell / 10.0 } else { f64::INFINITY }
    }

    /// Empties the bucket of the front cost.
    fn advance(&mut self) {
        let slot = self.front as usize % BUCKETS;
        while let Some(c) = self.buckets[slot].pop() {
            self.waiting -= 1;
            let i = self.index(c);
            if self.settled[i] {
                continue;
            }
            self.settled[i] = true;
            for (dx, dy, step) in STEPS {
                let next = (c.0 + dx, c.1 + dy);
                if next.0 < 0 || next.1 < 0 || next.0 >= self.size.0 || next.1 >= self.size.1 {
                    continue;
                }
                let j = self.index(next);
                let cost = self.front + step;
                if self.costs[j] == UNKNOWN || (self.costs[j] != BLOCKED && cost < self.costs[j]) {
                    self.costs[j] = cost;
                    self.buckets[cost as usize % BUCKETS].push(next);
                    self.waiting += 1;
                }
            }
        }
        self.front += 1;
    }

    fn block(&mut self, obstacles: &Obstacles, radius: f64) {
        let radius = radius.max(self.cell / 2.0);
        for (a, b) in obstacles.edges() {
            let near = Aabb::around([a, b]).inflated(radius);
            let low = (near.min - self.origin) / self.cell;
            let high = (near.max - self.origin) / self.cell;
            let range = |lo: f64, hi: f64, n: i32| {
                (lo.ceil().max(0.0) as i32)..=(hi.floor().min(f64::from(n - 1)) as i32)
            };
            for y in range(low.y, high.y, self.size.1) {
                for x in range(low.x, high.x, self.size.0) {
                    let center =
                        self.origin + Vec2::new(f64::from(x) * self.cell, f64::from(y) * self.cell);
                    if distance_to_segment(center, a, b) < radius {
                        let i = self.index((x, y));
                        self.costs[i] = BLOCKED;
                    }
                }
            }
        }
    }

    fn cell_of(&self, p: Vec2) -> Option<(i32, i32)> {
        let c = (p - self.origin) / self.cell;
        let (x, y) = (c.x.round(), c.y.round());
        let inside =
            x >= 0.0 && y >= 0.0 && x < f64::from(self.size.0) && y < f64::from(self.size.1);
        inside.then_some((x as i32, y as i32))
    }

    fn index(&self, (x, y): (i32, i32)) -> usize {
        (y * self.size.0 + x) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Polygon;

    #[test]
    fn goes_around_a_wall() {
        let wall = Polygon::rectangle(Pose::default(), Aabb::new(4.8, -10.0, 5.2, 5.0));
        let obstacles = Obstacles { polygons: vec![wall], points: vec![] };
        let domain = Aabb::new(-10.0, -10.0, 20.0, 20.0);
        let mut c = CostToGo::default();
        let goal = Pose::new(10.0, 0.0, 0.0);
        c.reset(&domain, 0.5, 0.9, &Obstacles::default(), goal);
        assert!((c.distance(Vec2::new(0.0, 0.0)) - 10.0).abs() < 0.5);
        c.reset(&domain, 0.5, 0.9, &obstacles, goal);
        let around = c.distance(Vec2::new(0.0, 0.0));
        assert!((14.0..17.0).contains(&around), "{around}");
    }

    #[test]
    fn an_enclosed_goal_is_infinitely_far() {
        let ring = [
            (-3.0, -3.0, 3.0, -2.8),
            (-3.0, 2.8, 3.0, 3.0),
            (-3.0, -3.0, -2.8, 3.0),
            (2.8, -3.0, 3.0, 3.0),
        ];
        let polygons = ring
            .map(|(a, b, c, d)| Polygon::rectangle(Pose::default(), Aabb::new(a, b, c, d)))
            .to_vec();
        let mut c = CostToGo::default();
        let obstacles = Obstacles { polygons, points: vec![] };
        let domain = Aabb::new(-10.0, -10.0, 10.0, 10.0);
        c.reset(&domain, 0.5, 0.9, &obstacles, Pose::default());
        assert_eq!(c.distance(Vec2::new(8.0, 8.0)), f64::INFINITY);
        assert!(c.distance(Vec2::new(0.5, 0.5)) < 1.0);
    }
}
