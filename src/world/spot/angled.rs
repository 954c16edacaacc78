//! Angled bays: where the lane beside an oblique row lies.
//!
//! A goal says which way an angled bay's axis lies, but neither whether the car stands in it tail in or
//! nose in nor where the lane leads. Both are read off the obstacles: along every direction there may
//! be, the largest free lane beside the bay is what [`abstraction`](super::super::abstraction) finds. It
//! is largest along its own direction.

use std::f64::consts::PI;

use super::beside_lane::{Demand, Found, is_along, least_grid, merit, widest};
use super::{grid, other_way, spot_frame};
use crate::geometry::{Frame, Vec2, signed_angle};
use crate::world::abstraction::Surroundings;
use crate::world::cell::{Axis, Grid};
use crate::world::{ParkingType, Scene, Stance};

/// Slants tried, degrees: from the least to the largest, but not square; then those beside the best, in
/// ever smaller steps.
const LEAST: f64 = 30.0;
const STEP: f64 = 15.0;
const COUNT: usize = 9;
const FINER: [f64; 2] = [7.5, 3.75];
/// So many of them, of the largest lanes, are looked at closely.
const CLOSELY: usize = 3;
/// Lanes are measured in so many lengths.
const LENGTHS: f64 = 4.0;
/// Without any neighbour within so many widest spots nothing says that a bay is angled.
const BESIDE: f64 = 1.5;
/// Half the width of what must be free of the way out, of the car's width.
const WAY_OUT: f64 = 0.4;

/// An angled bay around the goal; what is `near` as `super::around_goal` has it, how far the lane reaches `back` at least as
/// [`least_grid`].
pub(super) fn found(scene: &Scene, near: &Surroundings, back: f64) -> Option<Found> {
    let slant_deg = Axis { min: LEAST, max: 180.0 - LEAST, step: FINER[1] };
    let full = Grid { slant_deg, ..least_grid(scene, ParkingType::Angled, back) };
    let Axis { min, max, .. } = full.dead_end;
    // A few lengths are enough to tell lanes apart.
    let coarse = Grid { dead_end: Axis { step: (max - min) / LENGTHS, ..full.dead_end }, ..full };
    let search = Search { scene, near, grid: coarse };
    // The car's own lane rather than another.
    let (own, others): (Vec<Stance>, Vec<Stance>) =
        search.slants(min).partition(|&plain| search.may_start_beside(plain));
    [own, others].into_iter().find_map(|slants| {
        let mut lanes: Vec<Lane> = slants.into_iter().filter_map(|s| search.lane(s)).collect();
        lanes.sort_by(|a, b| b.area.total_cmp(&a.area));
        lanes.into_iter().take(CLOSELY).find_map(|lane| {
            let best = search.refined(lane);
            let seen = near.map(from_parked(best.stance, best.frame.mirrored));
            let lane = widest(&seen, best.stance, &full, Demand::Usual)?;
            let is_beside = lane.measured.spot_width <= BESIDE * full.bay_spot_width.max;
            let is_lane = is_beside && is_along(&seen, &lane, &full, scene.vehicle.scale());
            let Lane { frame, stance, .. } = best;
            let (_, size) = merit(&lane, &full, frame.local_from_world(scene.start));
            // A usual bay is wider than the least, and its lane begins farther out.
            let [usual, least] = [grid(scene), full].map(|grid| grid.lane_boundary(stance));
            let mouth = (lane.shift - (usual - least) / stance.out().y).max(0.0);
            is_lane.then_some(Found { frame, stance, mouth, size })
        })
    })
}

/// Lanes beside a scene's goal.
struct Search<'a> {
    scene: &'a Scene,
    near: &'a Surroundings,
    grid: Grid,
}

/// A lane along some direction.
struct Lane {
    /// As the car stands in a right-handed frame, and in the one from which it comes along the lane.
    plain: Stance,
    stance: Stance,
    frame: Frame,
    area: f64,
}

impl Search<'_> {
    /// The slants tried first, nose in and tail in: where the car can leave, at least as far as
    /// `beyond` the end of its spot.
    fn slants(&self, beyond: f64) -> impl Iterator<Item = Stance> {
        let to = self.grid.bay_depth / 2.0 + beyond;
        let width = WAY_OUT * self.scene.vehicle.width;
        let is_open = move |ahead: &f64| {
            !self.near.ends_within(to, Vec2::zeros(), Vec2::new(*ahead, 0.0), width)
        };
        let slants = |ahead| {
            let degrees = (0..COUNT).map(|i| LEAST + STEP * i as f64);
            degrees.filter(|d| *d != 90.0).map(move |degrees| at_slant(degrees, ahead > 0.0))
        };
        [1.0, -1.0].into_iter().filter(is_open).flat_map(slants)
    }

    /// Whether the car may start in the lane beside a spot in which it stands so.
    fn may_start_beside(&self, plain: Stance) -> bool {
        let start = spot_frame(self.scene, plain).local_from_world(self.scene.start);
        let (low, slack) = (self.grid.lane_boundary(plain), self.grid.lane_width.min / 4.0);
        (low - slack..low + self.grid.lane_width.max + slack).contains(&start.y)
    }

    fn lane(&self, plain: Stance) -> Option<Lane> {
        let usual = spot_frame(self.scene, plain);
        let frames = [usual, other_way(&usual, ParkingType::Angled)];
        frames.into_iter().find_map(|frame| {
            let stance = if frame.mirrored { plain.other_way() } else { plain };
            let seen = self.near.map(from_parked(stance, frame.mirrored));
            let lane = widest(&seen, stance, &self.grid, Demand::Usual)?;
            let area = lane.measured.lane_width * (lane.measured.dead_end + self.grid.back);
            Some(Lane { plain, stance, frame, area })
        })
    }

    /// The best of the lanes along directions near that of `lane`.
    fn refined(&self, mut lane: Lane) -> Lane {
        for step in FINER {
            let heading = lane.plain.heading();
            let beside = [-step, step].into_iter().filter_map(|turn| {
                let heading = heading + turn.to_radians();
                let is_slant = heading.cos().abs() <= LEAST.to_radians().cos() + 1e-9
                    && heading.cos().abs() > 1e-6;
                is_slant.then(|| self.lane(Stance::new(ParkingType::Angled, heading)))?
            });
            let best = beside.max_by(|a, b| a.area.total_cmp(&b.area));
            lane = best.filter(|other| other.area > lane.area).unwrap_or(lane);
        }
        lane
    }
}

/// As a car stands in a bay of a slant.
fn at_slant(degrees: f64, tail_in: bool) -> Stance {
    let slant = degrees.to_radians();
    Stance::new(ParkingType::Angled, if tail_in { slant } else { slant - PI })
}

/// What is taken for an angled bay where nothing looks like one but the scene says so: the car is
/// taken to start along its lane.
pub(super) fn told(scene: &Scene) -> Found {
    let turn = signed_angle(scene.start.heading, scene.goal.heading);
    let (least, most) = (LEAST.to_radians(), PI - LEAST.to_radians());
    // As if it stood tail in; the lane lies on the side where the car starts.
    let slant = turn.abs().clamp(least, most);
    let tail_in = Stance::new(ParkingType::Angled, slant);
    let ahead = scene.goal.point_to_local(scene.start.position()).x > 0.0;
    let nose_in = Stance::new(ParkingType::Angled, slant - PI);
    let stance = if ahead { tail_in } else { nose_in };
    let frame = spot_frame(scene, stance);
    let stance = if frame.mirrored { stance.other_way() } else { stance };
    Found { frame, stance, mouth: 0.0, size: 0.0 }
}

/// A point given from the parked centre, +x along the car's heading, seen from the spot frame.
pub(super) fn from_parked(stance: Stance, mirrored: bool) -> impl Fn(Vec2) -> Vec2 {
    let side = if mirrored { -1.0 } else { 1.0 };
    let (sin, cos) = (side * stance.heading()).sin_cos();
    move |p| Vec2::new(cos * p.x - sin * p.y, side * (sin * p.x + cos * p.y))
}
