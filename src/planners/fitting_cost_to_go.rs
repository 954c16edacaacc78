//! The careful cost-to-go: how far the start is for a car that goes along its heading.
//!
//! Among obstacles the disc of [`CostToGo`] passes gaps that the car does not, or only in another heading than it
//! can come in, and a search that follows it floods what lies before them. Here the wave spreads over cells and
//! headings: a step leads along the heading, a turn to the next one, and either counts many times where the car
//! does not fit. That is an estimate to follow, not a bound: turns cost something even where a curve needs
//! none. Only what [`CostToGo`] says is blocked is a proof.

use std::f64::consts::TAU;

use crate::geometry::{Aabb, Pose, Vec2};
use crate::vehicle::Vehicle;
use crate::world::collision::CollisionWorld;

use super::cost_to_go::CostToGo;
use super::wave::{Cell, Front, PAGE_CELLS, Raster};

/// Headings of a cell.
const HEADINGS: usize = 16;
/// Cells and cost of a step along the first headings; a quarter turn later they are the same, turned.
const STEPS: [(i32, i32, u32); 4] = [(1, 0, 10), (2, 1, 22), (1, 1, 14), (1, 2, 22)];
/// How much of the arc from one heading to the next a turn costs: the car goes on meanwhile.
const TURN: f64 = 0.5;
/// The most that a turn costs, tenths of a cell.
const MOST_TURN: f64 = 80.0;
/// How many times as much counts what leads where the car does not fit.
const NARROW: u32 = 12;
/// More than the costliest turn.
const BUCKETS: usize = 1024;
/// Where the car is tried in a cell, cells to the left of its middle.
const ASIDE: [f64; 3] = [0.0, 0.3, -0.3];
/// Set in the costs that are final.
const SETTLED: u32 = 1 << 31;
/// Not reached yet.
const UNKNOWN: u32 = SETTLED - 1;
/// The wave goes no further than so many pages (64 MB, and 16 for what fits): beyond, distances are those of
/// its front.
const MOST_PAGES: usize = 1 << 8;

/// A cell and a heading.
type State = (Cell, i32);

/// Distances to one pose. Buffers are reused from call to call.
#[derive(Debug, Default)]
pub(super) struct FittingCostToGo {
    raster: Raster,
    /// Cost of a turn to the next heading.
    turn: u32,
    /// Costs of the states of all pages.
    costs: Vec<u32>,
    /// By state: whether the car fits there, as far as asked.
    fits: Vec<Option<bool>>,
    front: Front<State>,
}

impl FittingCostToGo {
    /// Prepares distances to `goal`, in the cells of a [`CostToGo`] made ready with the same values.
    pub fn reset(&mut self, domain: &Aabb, wanted: f64, vehicle: &Vehicle, goal: Pose) {
        let cell = CostToGo::cell(wanted, vehicle);
        self.raster.reset(domain, cell);
        let arc = TAU / HEADINGS as f64 / vehicle.max_curvature();
        self.turn = (10.0 * TURN * arc / cell).clamp(1.0, MOST_TURN) as u32;
        self.costs.clear();
        self.fits.clear();
        self.front.reset(BUCKETS, self.state_of(goal));
    }

    /// Metres from `pose` to the goal; infinite where nothing leads to it within the domain. `disc` says what
    /// is blocked; `world` has the obstacles, the same from one reset to the next.
    pub fn distance(&mut self, pose: Pose, disc: &mut CostToGo, world: &CollisionWorld) -> f64 {
        let Some(state) = self.state_of(pose) else { return f64::INFINITY };
        let i = self.index(state);
        while self.costs[i] & SETTLED == 0 && !self.front.is_empty() {
            if self.raster.pages() > MOST_PAGES {
                return self.metres(self.front.cost);
            }
            self.advance(disc, world);
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
    fn advance(&mut self, disc: &mut CostToGo, world: &CollisionWorld) {
        while let Some(state) = self.front.pop() {
            let i = self.index(state);
            if self.costs[i] & SETTLED != 0 {
                continue;
            }
            self.costs[i] = self.front.cost | SETTLED;
            let ((x, y), heading) = state;
            let (dx, dy, step) = step_along(heading);
            let turned = |by: i32| (heading + by).rem_euclid(HEADINGS as i32);
            let next = [
                (((x + dx, y + dy), heading), step),
                (((x - dx, y - dy), heading), step),
                (((x, y), turned(1)), self.turn),
                (((x, y), turned(-1)), self.turn),
            ];
            for (to, step) in next {
                if !self.raster.has(to.0) {
                    continue;
                }
                let j = self.index(to);
                let known = self.costs[j];
                if known & SETTLED != 0 || disc.is_blocked(to.0, world) {
                    continue;
                }
                let times = if self.fits(to, j, world) { 1 } else { NARROW };
                let cost = self.front.cost + times * step;
                if cost < known {
                    self.costs[j] = cost;
                    self.front.push(cost, to);
                }
            }
        }
    }

    /// Whether the car fits into a cell at a heading, kept at `index`: in its middle or a little aside.
    fn fits(&mut self, (cell, heading): State, index: usize, world: &CollisionWorld) -> bool {
        if let Some(fits) = self.fits[index] {
            return fits;
        }
        let (middle, side) = (self.raster.middle(cell), self.raster.cell);
        let pose = Pose::new(middle.x, middle.y, f64::from(heading) / HEADINGS as f64 * TAU);
        let fits = ASIDE.iter().any(|aside| {
            let at = pose.point_to_parent(Vec2::new(0.0, aside * side));
            world.pose_is_free(Pose { x: at.x, y: at.y, ..pose })
        });
        self.fits[index] = Some(fits);
        fits
    }

    fn state_of(&self, pose: Pose) -> Option<State> {
        let heading = (pose.heading / TAU * HEADINGS as f64).round() as i32;
        Some((self.raster.cell_of(pose.position())?, heading.rem_euclid(HEADINGS as i32)))
    }

    /// Where the cost of a state is kept. Makes its page if need be.
    #[inline]
    fn index(&mut self, (cell, heading): State) -> usize {
        let at = self.raster.index(cell).unwrap_or_else(|| {
            self.raster.make_page(cell);
            let states = self.raster.pages() * PAGE_CELLS * HEADINGS;
            self.costs.resize(states, UNKNOWN);
            self.fits.resize(states, None);
            self.raster.index(cell).expect("the page was just made")
        });
        at * HEADINGS + heading as usize
    }
}

/// Cells and cost of a step along a heading.
fn step_along(heading: i32) -> (i32, i32, u32) {
    let (x, y, cost) = STEPS[heading as usize % STEPS.len()];
    match heading as usize / STEPS.len() {
        0 => (x, y, cost),
        1 => (-y, x, cost),
        2 => (-x, -y, cost),
        _ => (y, -x, cost),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Polygon;
    use crate::world::Obstacles;

    fn world(boxes: &[[f64; 4]]) -> CollisionWorld {
        let solid =
            |&[a, b, c, d]: &[f64; 4]| Polygon::rectangle(Pose::default(), Aabb::new(a, b, c, d));
        let obstacles = Obstacles::new(boxes.iter().map(solid).collect(), vec![], vec![]);
        CollisionWorld::new(&obstacles.unwrap(), None, &Vehicle::default(), 0.0)
    }

    /// Both distances from `from` to the origin.
    fn distances(domain: Aabb, from: Pose, world: &CollisionWorld) -> (f64, f64) {
        let (vehicle, goal) = (Vehicle::default(), Pose::default());
        let (mut disc, mut car) = (CostToGo::default(), FittingCostToGo::default());
        disc.reset(&domain, 0.5, &vehicle, goal.position());
        car.reset(&domain, 0.5, &vehicle, goal);
        let as_car = car.distance(from, &mut disc, world);
        (disc.distance(from.position(), world), as_car)
    }

    #[test]
    fn in_open_space_it_is_the_way_and_half_the_turns() {
        let domain = Aabb::new(-30.0, -30.0, 30.0, 30.0);
        for i in 0..16_i32 {
            let heading = f64::from(i) / 16.0 * TAU;
            for (along, turns) in [(12.0, 0), (-12.0, 0), (12.0, 3), (-12.0, -5)] {
                let from = Pose::new(0.0, 0.0, heading).point_to_parent(Vec2::new(along, 0.0));
                let from = Pose::new(from.x, from.y, heading + f64::from(turns) / 16.0 * TAU);
                let arc = TAU / 16.0 / Vehicle::default().max_curvature();
                let to_the_goal =
                    f64::from((i + turns).rem_euclid(16).min((-i - turns).rem_euclid(16)));
                let (disc, car) = distances(domain, from, &world(&[]));
                let least = 12.0 + TURN * arc * to_the_goal;
                assert!((11.0..13.5).contains(&disc), "{disc}");
                assert!(car > 0.9 * disc && car < 1.1 * least + 8.0 * TURN * arc, "{car} {least}");
            }
        }
    }

    /// Through a gap that is wider than the car and not as wide as it is long, who comes along the wall does not
    /// get without room to turn.
    #[test]
    fn a_gap_is_passed_along_the_heading_alone() {
        let gap = [[4.0, -20.0, 4.5, -1.3], [4.0, 1.3, 4.5, 20.0]];
        let domain = Aabb::new(-20.0, -20.0, 20.0, 20.0);
        let behind = Pose::new(8.5, 0.0, 0.0);
        let (disc, car) = distances(domain, behind, &world(&gap));
        assert!((8.0..10.0).contains(&disc) && car < 10.0, "{disc} {car}");
        // With no room to turn behind it.
        let corridor = [gap[0], gap[1], [7.0, -20.0, 7.5, 20.0]];
        let across = Pose::new(5.75, 5.0, TAU / 4.0);
        let (disc, car) = distances(domain, across, &world(&corridor));
        assert!(disc < 12.0 && car > 30.0, "{disc} {car}");
    }

    #[test]
    fn it_is_infinite_where_the_disc_is_enclosed_and_only_there() {
        let ring = [
            [3.0, -9.0, 3.2, 9.0],
            [-9.0, 8.8, 3.0, 9.0],
            [-9.0, -9.0, 3.0, -8.8],
            [-9.2, -9.0, -9.0, 9.0],
        ];
        let domain = Aabb::new(-15.0, -15.0, 15.0, 15.0);
        let beyond = Pose::new(9.0, 0.0, 1.0);
        let (disc, car) = distances(domain, beyond, &world(&ring));
        assert!(disc.is_infinite() && car.is_infinite());
        // Through a gap that the disc just passes.
        let open = [[3.0, -9.0, 3.2, -1.0], [3.0, 1.0, 3.2, 9.0], ring[1], ring[2], ring[3]];
        let (disc, car) = distances(domain, beyond, &world(&open));
        assert!(disc.is_finite() && car.is_finite(), "{disc} {car}");
    }

    #[test]
    fn a_huge_domain_takes_little_memory() {
        let (vehicle, open) = (Vehicle::default(), world(&[]));
        let (mut disc, mut car) = (CostToGo::default(), FittingCostToGo::default());
        let domain = Aabb::new(0.0, 0.0, 2300.0, 2300.0);
        let goal = Pose::new(1.0, 1.0, 0.0);
        disc.reset(&domain, 0.05, &vehicle, goal.position());
        car.reset(&domain, 0.05, &vehicle, goal);
        let far = car.distance(Pose::new(2299.0, 2299.0, 0.0), &mut disc, &open);
        assert!(far > 10.0 && far < 3300.0, "{far}");
        assert!(4 * car.costs.len() < 80 << 20, "{}", car.costs.len());
    }
}
