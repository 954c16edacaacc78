//! Which place beside a lane is the likeliest spot.
//!
//! Each way in which a car can stand beside a lane is held against what is near: it is possible where the smallest cell
//! is free. The lane must be one along which it goes on farther than in any oblique direction.

use super::{Precision, REACH, angled, around_goal, from_parked, grid, other_way, spot_frame};
use crate::geometry::{Aabb, Frame, Pose, Vec2};
use crate::world::abstraction::{Abstraction, Surroundings};
use crate::world::cell::{Axis, Grid};
use crate::world::{ParkingType, Scene, Stance};

/// The least that still is a spot beside a lane: the car stands in it and passes through it, and the
/// lane may end beside the spot.
/// It reaches `back` so far, metres for the default vehicle.
pub(super) fn least_grid(scene: &Scene, kind: ParkingType, back: f64) -> Grid {
    /// Room on each side of the parked car, and that in the lane beside it, metres for the default vehicle.
    const ROOM: f64 = 0.02;
    const LANE_ROOM: f64 = 1.0;
    let vehicle = &scene.vehicle;
    let scale = vehicle.scale();
    let usual = grid(scene);
    let along = if kind.is_bay() { vehicle.width } else { vehicle.length } + 2.0 * ROOM * scale;
    let from = |min: f64, axis: Axis| Axis { min: min.min(axis.min), ..axis };
    Grid {
        lane_width: from(vehicle.width + LANE_ROOM * scale, usual.lane_width),
        bay_spot_width: from(along, usual.bay_spot_width),
        parallel_spot_width: from(along, usual.parallel_spot_width),
        dead_end: from(along / 2.0, usual.dead_end),
        back: back * scale,
        ..usual
    }
}

/// How far the least lane beside a goal reaches back, metres for the default vehicle.
const BACK: f64 = 5.0;
/// The same beside a place that nobody says is one: more than most lanes are wide, across which nobody parks.
const FAR_BACK: f64 = 9.0;

/// A spot beside a lane.
#[derive(Clone, Copy)]
pub(super) struct Found {
    pub frame: Frame,
    pub stance: Stance,
    /// See [`super::SpotGuess`].
    pub mouth: f64,
    /// Area of the lane's cell.
    pub size: f64,
}

/// How little may do for a spot beside a lane.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Demand {
    /// A usual lane and a usual spot, the lane about where it begins as a rule.
    Usual,
    /// The same, but the lane may begin farther out.
    FartherOut,
    /// See [`least_grid`].
    Least,
}

/// The likeliest spot of one of `kinds`: the car stands in its lane rather than elsewhere, and the
/// lane is large. Where there is a usual one, others do not count. An angled one counts where none is
/// usual, and any other's lane is clearly smaller.
pub(super) fn found(scene: &Scene, kinds: &[ParkingType], precision: Precision) -> Option<Found> {
    beside_lane(scene, kinds, precision, BACK)
}

/// The same, where the least lane reaches `back` so far.
fn beside_lane(
    scene: &Scene,
    kinds: &[ParkingType],
    precision: Precision,
    back: f64,
) -> Option<Found> {
    let near = around_goal(scene, precision);
    let likeliest = |demand| likeliest(scene, &near, kinds, demand, back);
    if let Some(usual) = likeliest(Demand::Usual) {
        return Some(usual);
    }
    let square = likeliest(Demand::FartherOut).or_else(|| likeliest(Demand::Least));
    let may_be_angled = kinds.contains(&ParkingType::Angled);
    let angled = may_be_angled.then(|| angled::found(scene, &near, back)).flatten();
    match (square, angled) {
        (Some(square), Some(angled)) if angled.size > CLEARLY * square.size => Some(angled),
        (square, angled) => square.or(angled),
    }
}

/// A lane beside a place that nobody says is a spot.
pub(crate) struct LaneBeside {
    /// How the car stands beside it.
    pub stance: Stance,
    /// Its area.
    pub size: f64,
    /// Whether it is as wide and as long as usual ones.
    pub is_usual: bool,
}

/// The lane beside a scene's goal, wherever the car starts, for a spot of one of `kinds`.
pub(crate) fn lane_beside(scene: &Scene, kinds: &[ParkingType]) -> Option<LaneBeside> {
    let Found { stance, size, .. } = beside_lane(scene, kinds, Precision::Given, FAR_BACK)?;
    let near = around_goal(scene, Precision::Given);
    let demands = [Demand::Usual, Demand::FartherOut];
    let has_usual =
        || demands.iter().any(|&d| likeliest(scene, &near, kinds, d, FAR_BACK).is_some());
    let is_usual = stance.kind() != ParkingType::Angled && has_usual();
    Some(LaneBeside { stance, size, is_usual })
}

/// An angled bay's lane must be so many times as large as that of an unusual square spot to count.
const CLEARLY: f64 = 1.25;

/// The likeliest of those that are not angled.
fn likeliest(
    scene: &Scene,
    near: &Surroundings,
    kinds: &[ParkingType],
    demand: Demand,
    back: f64,
) -> Option<Found> {
    let of_kind = |&kind: &ParkingType| {
        let grid =
            if demand == Demand::Least { least_grid(scene, kind, back) } else { grid(scene) };
        let stance = Stance::new(kind, 0.0);
        let usual = spot_frame(scene, stance);
        // The car may come from the other side, or stand across the lane.
        [usual, other_way(&usual, kind)].into_iter().find_map(|frame| {
            let seen = near.map(|p| from_parked(p, kind, frame.mirrored));
            let lane = widest(&seen, stance, &grid, demand)?;
            let merit = merit(&lane, &grid, frame.local_from_world(scene.start));
            let is_lane = is_along(&seen, &lane, &grid, scene.vehicle.scale());
            let (_, size) = merit;
            is_lane.then_some((merit, Found { frame, stance, mouth: lane.shift, size }))
        })
    };
    let mut best: Option<((bool, f64), Found)> = None;
    let square = kinds.iter().filter(|k| **k != ParkingType::Angled);
    for (merit, found) in square.filter_map(of_kind) {
        if best.is_none_or(|(most, _)| merit > most) {
            best = Some((merit, found));
        }
    }
    best.map(|(_, found)| found)
}

/// The largest lane that will do.
pub(super) fn widest(
    seen: &Surroundings,
    stance: Stance,
    grid: &Grid,
    demand: Demand,
) -> Option<Abstraction> {
    let usual = || seen.lanes(stance, grid).first().copied();
    let farther_out = || seen.lanes_farther_out(stance, grid).first().copied();
    match demand {
        Demand::Usual => usual(),
        Demand::FartherOut => farther_out(),
        Demand::Least => usual().or_else(farther_out),
    }
}

/// Whether no oblique direction leads farther from the middle of the lane than one along it.
pub(super) fn is_along(seen: &Surroundings, lane: &Abstraction, grid: &Grid, scale: f64) -> bool {
    /// What is as far away as this of [`REACH`] counts as endless.
    const ENDLESS: f64 = 0.98;
    /// An oblique direction may lead a little farther.
    const SLACK: f64 = 1.1;
    /// What stands so little into the lane on either side closes it for no one, of its width.
    const EDGE: f64 = 0.1;
    /// Half the width of an oblique ray, metres for the default vehicle: more than scanned points are
    /// apart.
    const RAY: f64 = 0.15;
    let area = area(lane, grid);
    let endless = ENDLESS * REACH * scale;
    // In nearly the whole width, as gaps between cars lead far, too.
    let edge = EDGE * (area.max.y - area.min.y);
    let beside = area.min.x + grid.back;
    let along = seen.free_in_band(beside, [area.min.y + edge, area.max.y - edge]);
    if along >= endless {
        return true;
    }
    let enough = along * SLACK;
    if enough >= endless {
        return true;
    }
    let middle = Vec2::new(beside, f64::midpoint(area.min.y, area.max.y));
    let ends = |turn: f64, side: f64| {
        let (sin, cos) = turn.to_radians().sin_cos();
        seen.ends_within(enough, middle, Vec2::new(cos * side, sin), RAY * scale)
    };
    // Both ways: what a gap lets see is seen on one side only.
    let ends_across = |side| move |turn: &f64| ends(*turn, side) || ends(-turn, -side);
    let oblique = [30.0, 37.5, 45.0, 52.5, 60.0];
    [1.0, -1.0].into_iter().all(|side| oblique.iter().all(ends_across(side)))
}

/// The lane's rectangle in the spot frame; the frame of the cell is not turned here.
fn area(lane: &Abstraction, grid: &Grid) -> Aabb {
    let [area, _] = lane.regions(grid);
    area.aabb()
}

/// Whether the car starts in the lane, and the lane's area.
pub(super) fn merit(lane: &Abstraction, grid: &Grid, start: Pose) -> (bool, f64) {
    // A car slightly out of its lane is in it.
    let slack = grid.lane_width.min / 4.0;
    let area = area(lane, grid);
    let in_lane =
        start.y > area.min.y - slack && start.y < area.min.y + lane.measured.lane_width + slack;
    let size = area.max - area.min;
    (in_lane, size.x * size.y)
}
