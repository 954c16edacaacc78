//! The A* cost-to-go: how far the goal is for a disc among the obstacles.
//!
//! Shortest distances to the goal over a grid, with the largest disc around the rear axle
//! that the footprint always covers. Computed lazily: the wave from the goal advances only
//! as far as somebody asks.
//!
//! A cell is blocked only where the disc collides from every point of it, so that an infinite
//! distance is a proof: no motion within the domain leads there.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::geometry::{Aabb, Vec2, distance_to_segment};
use crate::vehicle::Vehicle;
use crate::world::collision::CollisionWorld;

use super::wave::{Cell, Front, PAGE, PAGE_CELLS, Raster};

/// Not reached yet.
const UNKNOWN: u32 = u32::MAX >> 1;
const BLOCKED: u32 = UNKNOWN - 1;
/// Set in the costs that are final.
const SETTLED: u32 = 1 << 31;
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
/// More than the costliest step.
const BUCKETS: usize = 16;
/// The wave goes no further than so many pages (64 MB): beyond, distances are lower bounds.
const MOST_PAGES: usize = 1 << 12;

/// Grid distances to one goal. Buffers are reused from call to call.
#[derive(Debug, Default)]
pub(super) struct CostToGo {
    raster: Raster,
    /// A cell is blocked by an edge nearer than this to its centre, metres.
    reach: f64,
    /// Costs of the cells of all pages.
    costs: Vec<u32>,
    front: Front<Cell>,
}

impl CostToGo {
    /// Side of a cell for this vehicle, metres: at most `wanted`, and so small that cells of half
    /// the disc's depth within an obstacle are blocked; but no less than a fortieth of the
    /// vehicle, where the disc is tiny and little can be said.
    pub fn cell(wanted: f64, vehicle: &Vehicle) -> f64 {
        let fine = inscribed_radius(vehicle) * FRAC_1_SQRT_2;
        wanted.min(fine.max(vehicle.length / 40.0))
    }

    /// Prepares distances to `goal` within `domain` for `vehicle`, in cells of
    /// [`CostToGo::cell`].
    pub fn reset(&mut self, domain: &Aabb, wanted: f64, vehicle: &Vehicle, goal: Vec2) {
        let cell = Self::cell(wanted, vehicle);
        self.raster.reset(domain, cell);
        // The disc collides from every point of a cell.
        self.reach = inscribed_radius(vehicle) - cell * FRAC_1_SQRT_2;
        self.costs.clear();
        self.front.reset(BUCKETS, self.raster.cell_of(goal));
    }

    /// Metres from `p` to the goal; infinite where nothing leads to it within the domain.
    /// `world` has the obstacles, the same from one reset to the next.
    pub fn distance(&mut self, p: Vec2, world: &CollisionWorld) -> f64 {
        let Some(c) = self.raster.cell_of(p) else { return f64::INFINITY };
        let i = self.index(c, world);
        while self.costs[i] & SETTLED == 0 && !self.front.is_empty() {
            if self.raster.pages() > MOST_PAGES {
                return self.metres(self.front.cost);
            }
            self.advance(world);
        }
        match self.costs[i] {
            cost if cost & SETTLED != 0 => self.metres(cost & !SETTLED),
            _ => f64::INFINITY,
        }
    }

    fn metres(&self, cost: u32) -> f64 {
        f64::from(cost) * self.raster.cell / 10.0
    }

    /// Lets the wave go on from all at its front.
    fn advance(&mut self, world: &CollisionWorld) {
        while let Some(c) = self.front.pop() {
            let i = self.index(c, world);
            if self.costs[i] & SETTLED != 0 {
                continue;
            }
            self.costs[i] = self.front.cost | SETTLED;
            for (dx, dy, step) in STEPS {
                let next = (c.0 + dx, c.1 + dy);
                if !self.raster.has(next) {
                    continue;
                }
                let j = self.index(next, world);
                let (known, cost) = (self.costs[j], self.front.cost + step);
                // Settled costs are larger than any other number.
                if known != BLOCKED && known <= UNKNOWN && cost < known {
                    self.costs[j] = cost;
                    self.front.push(cost, next);
                }
            }
        }
    }

    /// Whether the disc collides from every point of a cell.
    pub fn is_blocked(&mut self, cell: Cell, world: &CollisionWorld) -> bool {
        let i = self.index(cell, world);
        self.costs[i] == BLOCKED
    }

    /// Where the cost of a cell is kept. Makes its page if need be.
    #[inline]
    fn index(&mut self, cell: Cell, world: &CollisionWorld) -> usize {
        if let Some(index) = self.raster.index(cell) {
            return index;
        }
        self.make_page(cell, world);
        self.raster.index(cell).expect("the page was just made")
    }

    #[cold]
    fn make_page(&mut self, cell: Cell, world: &CollisionWorld) {
        let first = self.costs.len();
        let corner = self.raster.make_page(cell);
        self.costs.resize(first + PAGE_CELLS, UNKNOWN);
        if self.reach <= 0.0 {
            return;
        }
        let (corner, cell) = (self.raster.middle(corner), self.raster.cell);
        let side = (PAGE - 1) as f64 * cell;
        let centers = Aabb { min: corner, max: corner + Vec2::new(side, side) };
        let (reach, costs) = (self.reach, &mut self.costs[first..]);
        world.edges_near(&centers.inflated(reach), |a, b| {
            let near = Aabb::around([a, b]).inflated(reach);
            let low = (near.min - corner) / cell;
            let high = (near.max - corner) / cell;
            let range = |lo: f64, hi: f64| {
                (lo.ceil().max(0.0) as usize)..(hi.floor() + 1.0).clamp(0.0, PAGE as f64) as usize
            };
            for y in range(low.y, high.y) {
                for x in range(low.x, high.x) {
                    let center = corner + Vec2::new(x as f64, y as f64) * cell;
                    if distance_to_segment(center, a, b) < reach {
                        costs[y * PAGE + x] = BLOCKED;
                    }
                }
            }
        });
    }
}

/// The largest disc around the rear axle inside every footprint, metres.
fn inscribed_radius(vehicle: &Vehicle) -> f64 {
    (vehicle.width / 2.0).min(vehicle.rear_overhang).min(vehicle.front_extent())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Polygon, Pose};
    use crate::world::Obstacles;

    /// A world of boxes `[x_min, y_min, x_max, y_max]`.
    fn world(boxes: &[[f64; 4]], vehicle: &Vehicle) -> CollisionWorld {
        let solid =
            |&[a, b, c, d]: &[f64; 4]| Polygon::rectangle(Pose::default(), Aabb::new(a, b, c, d));
        let obstacles = Obstacles::new(boxes.iter().map(solid).collect(), vec![], vec![]);
        CollisionWorld::new(&obstacles.unwrap(), None, vehicle, 0.0)
    }

    #[test]
    fn goes_around_a_wall() {
        let vehicle = Vehicle::default();
        let domain = Aabb::new(-10.0, -10.0, 20.0, 20.0);
        let mut c = CostToGo::default();
        let goal = Vec2::new(10.0, 0.0);
        c.reset(&domain, 0.5, &vehicle, goal);
        let open = world(&[], &vehicle);
        assert!((c.distance(Vec2::new(0.0, 0.0), &open) - 10.0).abs() < 0.5);
        c.reset(&domain, 0.5, &vehicle, goal);
        let wall = world(&[[4.8, -10.0, 5.2, 5.0]], &vehicle);
        let around = c.distance(Vec2::new(0.0, 0.0), &wall);
        assert!((14.0..17.0).contains(&around), "{around}");
    }

    #[test]
    fn an_enclosed_goal_is_infinitely_far() {
        let vehicle = Vehicle::default();
        let ring = [
            [-3.0, -3.0, 3.0, -2.8],
            [-3.0, 2.8, 3.0, 3.0],
            [-3.0, -3.0, -2.8, 3.0],
            [2.8, -3.0, 3.0, 3.0],
        ];
        let world = world(&ring, &vehicle);
        let mut c = CostToGo::default();
        let domain = Aabb::new(-10.0, -10.0, 10.0, 10.0);
        c.reset(&domain, 0.5, &vehicle, Vec2::default());
        assert_eq!(c.distance(Vec2::new(8.0, 8.0), &world), f64::INFINITY);
        assert!(c.distance(Vec2::new(0.5, 0.5), &world) < 1.0);
    }

    /// A corridor just wider than the vehicle, at any offset from the grid, is never a wall.
    #[test]
    fn what_the_vehicle_passes_is_never_blocked() {
        let car = Vehicle::default();
        let robot = |length, width, rear_overhang| Vehicle {
            length,
            width,
            rear_overhang,
            wheelbase: 0.5 * length,
            ..car
        };
        let vehicles = [
            car,
            robot(0.4, 0.2, 0.1),
            robot(0.4, 0.2, 0.01),
            robot(4.2, 1.8, 0.15),
            robot(4.2, 1.8, 0.0),
            robot(12.0, 2.5, 3.0),
        ];
        for vehicle in vehicles {
            let (long, gap) = (3.0 * vehicle.length, vehicle.width / 2.0 + 0.01);
            for offset in 0..20 {
                let y = f64::from(offset) * 0.05 * vehicle.width;
                let walls = [
                    [0.0, y + gap, long, y + gap + 1.0],
                    [0.0, y - gap - 1.0, long, y - gap],
                    [long / 2.0, y - 50.0, long / 2.0 + 0.1, y - gap],
                    [long / 2.0, y + gap, long / 2.0 + 0.1, y + 50.0],
                ];
                let world = world(&walls, &vehicle);
                let domain = Aabb::new(-long, -long, 2.0 * long, long);
                let mut c = CostToGo::default();
                c.reset(&domain, 0.5, &vehicle, Vec2::new(-long / 2.0, y));
                let through = c.distance(Vec2::new(1.5 * long, y), &world);
                assert!(through < 2.3 * long, "{vehicle:?} {offset}: {through}");
            }
        }
    }

    #[test]
    fn a_huge_domain_takes_little_memory_and_no_wrong_proof() {
        let vehicle = Vehicle::default();
        let open = world(&[], &vehicle);
        let mut c = CostToGo::default();
        // 46,000 cells a side: their number is beyond 32 bits.
        let domain = Aabb::new(0.0, 0.0, 2300.0, 2300.0);
        c.reset(&domain, 0.05, &vehicle, Vec2::new(1.0, 1.0));
        let near = c.distance(Vec2::new(30.0, 1.0), &open);
        assert!((near - 29.0).abs() < 0.1, "{near}");
        let far = c.distance(Vec2::new(2299.0, 2299.0), &open);
        assert!(far.is_finite() && far > 100.0 && far < 3300.0, "{far}");
        assert!(4 * c.costs.len() < 80 << 20, "{}", c.costs.len());
    }
}
