//! Angled bays: where the lane beside an oblique row lies.
//!
//! A goal says which way an angled bay's axis lies, but neither whether the car stands in it tail in or
//! nose in nor where the lane leads. Both are read off the obstacles: from a point out of the bay, far
//! enough for a lane to begin, a band as wide as half a lane is followed in every direction there may
//! be, both ways. Those in which it is free farthest are held against
//! [`abstraction`](super::super::abstraction).

use std::f64::consts::PI;

use super::{
    Demand, Found, REACH, grid, is_along, least_grid, merit, other_way, spot_frame, widest,
};
use crate::geometry::{Vec2, signed_angle};
use crate::world::abstraction::Surroundings;
use crate::world::cell::Grid;
use crate::world::{ParkingType, Scene, Stance};

/// Slants tried, degrees: from the least to the largest, but not square.
const LEAST: f64 = 30.0;
const STEP: f64 = 7.5;
const COUNT: usize = 17;
/// So many directions, free the farthest, are looked at closely.
const CLOSELY: usize = 6;
/// Half the width of the band that is followed, of the narrowest lane's width: what is left of a lane
/// seen up to half a step askew.
const BAND: f64 = 0.3;
/// Without any neighbour within so many widest spots nothing says that a bay is angled.
const BESIDE: f64 = 1.5;

/// An angled bay around the goal; what is `near` as `super::around_goal` has it.
pub(super) fn found(scene: &Scene, near: &Surroundings) -> Option<Found> {
    [Demand::Usual, Demand::Least].into_iter().find_map(|demand| likeliest(scene, near, demand))
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
    Found { frame, stance, mouth: 0.0 }
}

/// A point given from the parked centre, +x along the car's heading, seen from the spot frame.
pub(super) fn from_parked(stance: Stance, mirrored: bool) -> impl Fn(Vec2) -> Vec2 {
    let side = if mirrored { -1.0 } else { 1.0 };
    let (sin, cos) = (side * stance.heading()).sin_cos();
    move |p| Vec2::new(cos * p.x - sin * p.y, side * (sin * p.x + cos * p.y))
}

fn likeliest(scene: &Scene, near: &Surroundings, demand: Demand) -> Option<Found> {
    let least = demand == Demand::Least;
    let grid = if least { least_grid(scene, ParkingType::Angled) } else { grid(scene) };
    let far = REACH * scene.vehicle.scale();
    let mut free: Vec<(f64, Stance)> =
        stances().map(|stance| (reach(near, stance, &grid, far), stance)).collect();
    free.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Option<((bool, f64), Found)> = None;
    for &(_, plain) in free.iter().take(CLOSELY) {
        let usual = spot_frame(scene, plain);
        let other = other_way(&usual, ParkingType::Angled);
        let found = [usual, other].into_iter().find_map(|frame| {
            let stance = if frame.mirrored { plain.other_way() } else { plain };
            let seen = near.map(from_parked(stance, frame.mirrored));
            let lane = widest(&seen, stance, &grid, demand)?;
            let is_beside = lane.measured.spot_width <= BESIDE * grid.bay_spot_width.max;
            let is_lane = is_beside && is_along(&seen, &lane, &grid, scene.vehicle.scale());
            let (in_lane, _) = merit(&lane, &grid, frame.local_from_world(scene.start));
            let size = lane.measured.lane_width * (lane.measured.dead_end + grid.back);
            is_lane.then_some(((in_lane, size), Found { frame, stance, mouth: lane.shift }))
        });
        if let Some((merit, found)) = found
            && best.is_none_or(|(most, _)| merit > most)
        {
            best = Some((merit, found));
        }
    }
    best.map(|(_, found)| found)
}

/// All ways to stand that are tried, in right-handed frames.
fn stances() -> impl Iterator<Item = Stance> {
    let slants = (0..COUNT).map(|i| (LEAST + STEP * i as f64).to_radians());
    let oblique = slants.filter(|slant| (slant - PI / 2.0).abs() > 1e-6);
    oblique.flat_map(|slant| {
        [slant, slant - PI].map(|heading| Stance::new(ParkingType::Angled, heading))
    })
}

/// How far a band along the lane beside such a spot is free to both sides together, at most `far` to
/// each.
fn reach(near: &Surroundings, stance: Stance, grid: &Grid, far: f64) -> f64 {
    let width = grid.lane_width.min;
    let out = stance.out();
    let middle = (grid.lane_boundary(stance) + width / 2.0) / out.y;
    // Seen from the parked car: the way out is ahead of its nose or behind its tail.
    let (sin, cos) = stance.heading().sin_cos();
    let ahead = if sin > 0.0 { 1.0 } else { -1.0 };
    let from = Vec2::new(ahead * middle, 0.0);
    let along = Vec2::new(cos, -sin);
    let free = |along| near.free_along(from, along, BAND * width, far);
    free(along) + free(-along)
}
