//! Closing the joint between a start and a path that begins near it, without any new
//! manoeuvre: the path's own motions are bent a little.
//!
//! A search without analytic expansion arrives near its target, never on it. What is left
//! is closed by *shooting* over the parameters of the motions found: as few of the first as
//! suffice get new lengths and curvatures, such that they lead from the exact start to
//! where they led before. Gears stay, curvatures stay within the steering limit, and the
//! result is checked like any path.

use crate::curves::{Path, Segment, least_norm};
use crate::geometry::{Pose, signed_angle};

use super::Problem;
use super::cost::CostModel;
use crate::vehicle::Vehicle;

/// Newton steps per attempt.
const STEPS: usize = 12;
/// Remaining error that counts as none, metres and radians.
const EXACT: f64 = 1e-10;
/// Least determinant of what a step is solved with.
const SINGULAR: f64 = 1e-12;

/// The free path from the start of `problem` to the end of `path`, which begins nearby,
/// with as many as possible of its last motions unchanged.
pub(super) fn close(problem: &Problem, path: &Path) -> Option<Path> {
    // Nothing is to be bent for who stands on the path.
    let as_it_is = Path { start: problem.start, ..path.clone() };
    let error = difference(as_it_is.end(), path.end());
    if error.iter().all(|e| e.abs() < Problem::ROUNDING / 2.0) {
        return problem.collision.path_is_free(&as_it_is).then_some(as_it_is);
    }
    let mut target = path.start;
    path.segments.iter().enumerate().find_map(|(i, s)| {
        target = s.end(target);
        let (first, rest) = path.segments.split_at(i + 1);
        let bent = bend(first, problem.start, target, &problem.vehicle)?;
        let path = Path::new(problem.start, bent.into_iter().chain(rest.iter().copied()));
        problem.collision.path_is_free(&path).then_some(path)
    })
}

/// `segments` with other lengths and curvatures, such that they lead from `start` to
/// `target`: Newton's method with steps of least norm, lengths in metres and curvatures in
/// multiples of `max_curvature`.
fn bend(
    segments: &[Segment],
    start: Pose,
    target: Pose,
    vehicle: &Vehicle,
) -> Option<Vec<Segment>> {
    const H: f64 = 1e-6;
    let (max_curvature, shortest) = (vehicle.max_curvature(), CostModel::shortest_motion(vehicle));
    if segments.len() < 2 {
        return None; // Two parameters cannot meet three numbers.
    }
    let mut bent = segments.to_vec();
    // Where a parameter reaches its limit it stays.
    let mut fixed = vec![[false; 2]; segments.len()];
    for _ in 0..STEPS {
        let end = end_of(&bent, start);
        let error = difference(end, target);
        if error.iter().all(|e| e.abs() < EXACT) {
            return Some(bent);
        }
        let mut columns = Vec::with_capacity(bent.len());
        for i in 0..bent.len() {
            let kept = bent[i];
            bent[i].length += H;
            let by_length = difference(end, end_of(&bent, start)).map(|d| d / H);
            bent[i] = Segment { curvature: kept.curvature + H * max_curvature, ..kept };
            let by_curvature = difference(end, end_of(&bent, start)).map(|d| d / H);
            bent[i] = kept;
            let unless = |fixed: bool, column: [f64; 3]| if fixed { [0.0; 3] } else { column };
            columns.push([unless(fixed[i][0], by_length), unless(fixed[i][1], by_curvature)]);
        }
        let moves = columns.as_flattened().iter().copied();
        let by = least_norm::multipliers(moves, error, 0.0, SINGULAR)?;
        for ((s, c), fixed) in bent.iter_mut().zip(&columns).zip(&mut fixed) {
            let [by_length, by_curvature] = c.map(|c| least_norm::dot(c, by));
            let gear = s.gear().sign();
            let length = gear * (s.length + by_length);
            let curvature = s.curvature + by_curvature * max_curvature;
            fixed[0] |= length < shortest;
            fixed[1] |= curvature.abs() > max_curvature;
            s.length = gear * length.max(shortest);
            s.curvature = curvature.clamp(-max_curvature, max_curvature);
        }
    }
    None
}

fn end_of(segments: &[Segment], start: Pose) -> Pose {
    segments.iter().fold(start, |pose, s| s.end(pose))
}

/// `to` less `from`: x, y, heading.
fn difference(from: Pose, to: Pose) -> [f64; 3] {
    [to.x - from.x, to.y - from.y, signed_angle(from.heading, to.heading)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bent_path_meets_both_ends_within_the_limits() {
        let vehicle = Vehicle::default();
        let max = vehicle.max_curvature();
        let segments = [(0.24, 2.0), (0.0, 3.0), (-0.125, 1.6), (0.24, -2.4)]
            .map(|(curvature, length)| Segment { curvature, length });
        let near = Pose::new(1.0, 2.0, 0.3);
        let target = end_of(&segments, near);
        for (dx, dy, turn) in
            [(0.2, 0.0, 0.0), (0.0, -0.2, 0.0), (0.1, 0.1, 0.08), (0.0, 0.0, -0.08)]
        {
            let start = Pose::new(near.x + dx, near.y + dy, near.heading + turn);
            let bent = bend(&segments, start, target, &vehicle).expect("enough motions to bend");
            let end = end_of(&bent, start);
            assert!(end.distance(target) < 1e-9, "{dx} {dy} {turn}: {end:?}");
            assert!(signed_angle(end.heading, target.heading).abs() < 1e-9);
            assert!(bent.iter().all(|s| s.curvature.abs() <= max));
            assert!(bent.iter().zip(&segments).all(|(a, b)| a.gear() == b.gear()));
        }
    }

    #[test]
    fn what_cannot_be_met_is_not_claimed() {
        let straight = [Segment::straight(1.0), Segment::straight(-1.0)];
        let far = Pose::new(0.0, 50.0, 3.0);
        assert_eq!(bend(&straight, Pose::default(), far, &Vehicle::default()), None);
    }
}
