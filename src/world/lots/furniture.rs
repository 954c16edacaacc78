//! What stands in car parks and streets besides cars in spots.

use std::f64::consts::{PI, TAU};

use super::draw::Draw;
use super::park::Plan;
use super::things::{Things, around};
use crate::geometry::{Polygon, Pose, Vec2};

/// Trolleys, bollards, blocks and two-wheelers at the lane's edges, between two stations, and
/// sometimes a car that stands in the lane. The lane stays passable.
pub(super) fn strew(plan: &Plan, [from, to]: [f64; 2], draw: &mut Draw, things: &mut Things) {
    let standing = draw.chance(0.2).then(|| stand(plan, [from, to], draw, things)).flatten();
    let count = draw.number(0..6);
    for _ in 0..if draw.chance(0.6) { count } else { 0 } {
        let s = draw.between(from, to);
        let is_near = draw.chance(0.5);
        let beside_target = s.abs() < plan.half() + if is_near { 1.2 } else { 7.0 };
        let most = match (is_near, beside_target) {
            (true, true) => continue,
            (false, true) => plan.passable().min(plan.spare - 0.3),
            _ => plan.passable(),
        };
        if most < 0.15 || standing.is_some_and(|at: f64| (at - s).abs() < 9.0) {
            continue;
        }
        let reach = draw.between(0.1, most);
        let (length, width) = match draw.number(0..5) {
            // A row of trolleys, stuck into each other.
            0 => (draw.between(0.9, 2.5), 0.6),
            1 => (draw.between(1.9, 2.2), 0.75),
            2 => (draw.between(0.3, 0.9), draw.between(0.3, 0.9)),
            _ => {
                let radius = draw.between(0.05, 0.15);
                let d = if is_near { reach - radius } else { plan.lane - reach + radius };
                pole(plan.road.at(s, d, 0.0), radius, things);
                continue;
            }
        };
        let turn = draw.about(PI);
        let half = (length * turn.sin().abs() + width * turn.cos().abs()) / 2.0;
        let d = if is_near { reach - half } else { plan.lane - reach + half };
        things.put(plan.road.at(s, d, turn), around(length, width), 0.1);
    }
}

/// A car or a van at the far edge of a wide lane, away from the target: its station.
fn stand(plan: &Plan, [from, to]: [f64; 2], draw: &mut Draw, things: &mut Things) -> Option<f64> {
    let [length, width] = draw.car();
    let s = draw.sign() * draw.between(10.0, 18.0);
    let turn = draw.about(0.05);
    let half = (length * turn.sin().abs() + width) / 2.0;
    let d = plan.lane - half - draw.between(0.05, 0.3);
    let is_wide = d - half > plan.vehicle.width + 1.4;
    let is_within = from + length < s && s < to - length;
    (is_wide && is_within && things.put(plan.road.at(s, d, turn), around(length, width), 0.05))
        .then_some(s)
}

/// A pole where nothing else stands.
fn pole(at: Pose, radius: f64, things: &mut Things) {
    if things.leave(at, &around(2.5 * radius, 2.5 * radius)) {
        let corner = |i| {
            let angle = TAU * f64::from(i) / 8.0;
            at.point_to_parent(Vec2::new(radius * angle.cos(), radius * angle.sin()))
        };
        things.solids.extend(Polygon::new((0..8).map(corner).collect()));
    }
}

/// What stands where the target's row ends at the station `from`, and goes no further than `to`: an
/// island, a wall, a pillar, or nothing. It reaches at most `reach` into the lane.
pub(super) fn end_row(
    plan: &Plan,
    from: f64,
    to: f64,
    reach: f64,
    draw: &mut Draw,
    things: &mut Things,
) {
    let side = (to - from).signum();
    let back = plan.row.back();
    let reach = draw.between(-0.6, reach);
    let from = from + side * draw.between(0.02, 0.3);
    let outline = |long: f64, taper: f64| {
        let corners = [(0.0, back), (long, back), (long, reach - taper), (0.0, reach)];
        corners.map(|(s, d)| plan.road.point(from + side * s, d)).to_vec()
    };
    match draw.number(0..4) {
        0 => {
            let long = draw.between(0.8, 4.0).min((to - from).abs());
            let island = outline(long, draw.between(0.0, 0.6));
            things.solids.extend(Polygon::new(island));
        }
        1 => things.solids.extend(Polygon::new(outline(0.25, 0.0))),
        2 => {
            let thick = draw.between(0.3, 0.6);
            let at = plan.road.at(from + side * thick / 2.0, reach.min(0.2) - thick / 2.0, 0.0);
            things.put(at, around(thick, thick), 0.0);
        }
        _ => {}
    }
}

/// Lamps, trees and bins behind a kerb at the offset `d`, and often a house behind them.
pub(super) fn pavement(
    plan: &Plan,
    [from, to]: [f64; 2],
    d: f64,
    away: f64,
    draw: &mut Draw,
    things: &mut Things,
) {
    let mut s = from + draw.between(0.0, 10.0);
    while s < to {
        let radius = if draw.chance(0.5) { 0.08 } else { draw.between(0.12, 0.3) };
        let from_kerb = radius + draw.between(0.3, 0.8);
        pole(plan.road.at(s, d + away * from_kerb, 0.0), radius, things);
        s += draw.between(5.0, 14.0);
    }
    if draw.chance(0.6) {
        let house = d + away * draw.between(2.0, 4.0);
        things.solids.push(plan.road.strip([from, to], [house, house + away * 0.4]));
    }
}

/// Points of leaves along the offset `d`.
pub(super) fn hedge(
    plan: &Plan,
    [from, to]: [f64; 2],
    d: f64,
    away: f64,
    draw: &mut Draw,
    things: &mut Things,
) {
    let mut s = from;
    while s < to {
        things.points.push(plan.road.point(s, d + away * draw.between(0.0, 0.2)));
        s += draw.between(0.1, 0.3);
    }
}
