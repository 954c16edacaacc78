//! Fitting the lengths of straights and turns to where they are to lead.

use super::turn::{Piece, Way, then, then_turned};
use crate::curves::least_norm::{Move, dot, multipliers};
use crate::geometry::{Pose, signed_angle};

/// What a fitted path may miss its goal by, metres and radians.
const EXACT: f64 = 1e-9;
/// Steps of Newton's method.
const STEPS: usize = 12;

/// Changes the values of `pieces` as little as need be so that they lead from `start` to `goal`; `false`
/// where that takes a negative length, or more steps than usual.
pub(super) fn fit(pieces: &mut [Piece], start: Pose, goal: Pose) -> bool {
    let mut ways: Vec<(Way, Way)> = Vec::with_capacity(pieces.len());
    let mut poses: Vec<(Way, f64, f64)> = Vec::with_capacity(pieces.len());
    let mut columns: Vec<Move> = Vec::with_capacity(pieces.len());
    let mut clothoids: Vec<Option<[Way; 2]>> = vec![None; pieces.len()];
    let mut fixed = vec![false; pieces.len()];
    // Angles in metres: as the tightest turn sweeps them.
    let tightest = pieces.iter().map(|p| p.curvature.abs()).fold(0.0, f64::max);
    if tightest == 0.0 {
        let start = [start.x, start.y, start.heading];
        let end = pieces.iter().fold(start, |a, piece| then(a, piece.way(&mut None).0));
        return has_met(missed(end, goal));
    }
    let radius = 1.0 / tightest;
    for _ in 0..STEPS {
        ways.clear();
        ways.extend(pieces.iter().zip(&mut clothoids).map(|(piece, kept)| piece.way(kept)));
        // Where each piece ends, and how the car stands where it begins.
        poses.clear();
        let mut whole = [start.x, start.y, start.heading];
        for (way, _) in &ways {
            let (sin, cos) = whole[2].sin_cos();
            whole = then_turned(whole, (sin, cos), *way);
            poses.push((whole, sin, cos));
        }
        let miss = missed(whole, goal);
        if has_met(miss) {
            return true;
        }
        if !miss.iter().all(|v| v.is_finite()) {
            return false;
        }
        let target = [-miss[0], -miss[1], -miss[2] * radius];
        columns.clear();
        for ((piece, (_, change)), &(after, sin, cos)) in pieces.iter().zip(&ways).zip(&poses) {
            let rest = [whole[0] - after[0], whole[1] - after[1]];
            let dx = cos * change[0] - sin * change[1] - change[2] * rest[1];
            let dy = sin * change[0] + cos * change[1] + change[2] * rest[0];
            // Per metre: turns are measured along the tightest arc.
            let unit = if piece.is_straight() { 1.0 } else { tightest };
            columns.push([dx, dy, change[2] * radius].map(|v| v * unit));
        }
        if !step(pieces, &columns, &mut fixed, target, tightest) {
            return false;
        }
    }
    false
}

/// One step of Newton's method: the smallest change that would lead to `target` if `columns` told the whole
/// truth, and lets no value go below its least. `false` where there is none.
fn step(
    pieces: &mut [Piece],
    columns: &[Move],
    fixed: &mut [bool],
    target: Move,
    tightest: f64,
) -> bool {
    /// Of the radius, so far at once at most.
    const FAR: f64 = 0.5;
    fixed.fill(false);
    let mut target = target;
    // What would go below its least goes there, and the others share what is left.
    for _ in 0..=pieces.len() {
        let free = || columns.iter().zip(&*fixed).filter(|(_, fixed)| !**fixed).map(|(c, _)| *c);
        if free().count() < 3 {
            return false;
        }
        let Some(share) = multipliers(free(), target, 0.0, 0.0) else { return false };
        let largest = free().map(|c| dot(c, share).abs()).fold(0.0, f64::max);
        if !largest.is_finite() {
            return false;
        }
        let scale = (FAR / tightest / largest).min(1.0);
        let change = |i: usize, piece: &Piece| {
            let metres = dot(columns[i], share) * scale;
            if piece.is_straight() { metres } else { metres * tightest }
        };
        let mut held = false;
        for (i, piece) in pieces.iter().enumerate() {
            let least = piece.least();
            if !fixed[i] && piece.value + change(i, piece) < least - 1e-12 {
                let unit = if piece.is_straight() { 1.0 } else { tightest };
                let by = (least - piece.value) / unit;
                (0..3).for_each(|k| target[k] -= columns[i][k] * by);
                (fixed[i], held) = (true, true);
            }
        }
        if held {
            continue;
        }
        for (i, piece) in pieces.iter_mut().enumerate() {
            let value = if fixed[i] { piece.least() } else { piece.value + change(i, piece) };
            piece.value = value.max(piece.least());
        }
        return true;
    }
    false
}

/// How far the end of a way is from `goal`, metres and radians.
fn missed(whole: Way, goal: Pose) -> Move {
    [whole[0] - goal.x, whole[1] - goal.y, signed_angle(goal.heading, whole[2])]
}

fn has_met(miss: Move) -> bool {
    miss.iter().all(|v| v.abs() < EXACT)
}
