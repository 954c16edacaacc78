//! Reeds-Shepp curves: shortest paths of a car that drives both ways.
//!
//! J. A. Reeds and L. A. Shepp, "Optimal paths for a car that goes both forwards and
//! backwards", Pacific J. Math. 145(2), 1990. Formula numbers below are theirs. A *word*
//! is a sequence of at most five segments, each a left or right arc of smallest radius or
//! a straight, each forward or backward; 48 words suffice. Nine base formulas give all of
//! them through time flip, reflection and reversal.
//!
//! Inside this module lengths are in turning radii and the goal is seen from the start.

mod centres;
mod shortest;
mod tidy;
mod words;

use self::centres::UnitGoal;
use self::shortest::shortest;
use self::words::{Sink, Turn, enumerate};
use super::Segment;
use crate::geometry::Pose;

/// Lengths below this (in radii) count as zero, so that a word which needs an arc of
/// −1e-17 is not lost to rounding.
const ZERO: f64 = 1e-9;

/// One word between two poses: up to five segments, lengths in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Word {
    segments: [Segment; Word::MOST],
    len: usize,
}

impl Word {
    /// No word has more segments.
    const MOST: usize = 5;

    /// The segments in driving order, metres.
    pub fn segments(&self) -> &[Segment] {
        &self.segments[..self.len]
    }

    /// Driven length, metres.
    pub fn length(&self) -> f64 {
        self.segments().iter().map(|s| s.length.abs()).sum()
    }

    /// The shortest segment, metres; infinite for the word without segments.
    pub fn shortest_segment(&self) -> f64 {
        self.segments().iter().map(|s| s.length.abs()).fold(f64::INFINITY, f64::min)
    }

    /// Its name: turn (`L`, `S`, `R`) and gear (`+`, `-`) per segment, such as `L+R-S-`.
    pub fn name(&self) -> String {
        let turn = |s: &Segment| match s.curvature {
            k if k > 0.0 => 'L',
            k if k < 0.0 => 'R',
            _ => 'S',
        };
        let gear = |s: &Segment| if s.length < 0.0 { '-' } else { '+' };
        self.segments().iter().flat_map(|s| [turn(s), gear(s)]).collect()
    }
}

/// Lateral offsets below this (metres) and turns below this (radians) are those of rounding: the
/// way is straight.
const STRAIGHT: f64 = 5e-7;

/// All words from `from` to `to` that exist, unsorted, appended to `out` (at most 49).
///
/// `radius`: turning radius, metres. Every arc turns by at most π. Where the poses lie on one line
/// up to rounding, the straight comes first, exact to a micrometre, and where they coincide, the
/// word without segments is the only one: the formulas would mend the rounding by arcs of
/// millimetres.
pub fn words(from: Pose, to: Pose, radius: f64, out: &mut Vec<Word>) {
    let first = out.len();
    let seen = from.relative(to);
    if seen.y.abs() < STRAIGHT && seen.heading.abs() < STRAIGHT.min(STRAIGHT / radius) {
        let mut word = Word::default();
        if seen.x.abs() >= STRAIGHT {
            word.segments[0] = Segment::straight(seen.x);
            word.len = 1;
        }
        out.push(word);
        if word.len == 0 {
            return;
        }
    }
    enumerate(UnitGoal::new(from, to, radius), &mut Collect { radius, out });
    if out.len() == first {
        // Only when the poses coincide: the formulas give words of length zero or none.
        debug_assert!(from.distance(to) < 1e-6 * radius);
        out.push(Word::default());
    }
}

/// Makes words of metres.
struct Collect<'a> {
    radius: f64,
    out: &'a mut Vec<Word>,
}

impl Sink for Collect<'_> {
    #[inline]
    fn word<const N: usize>(&mut self, turns: [Turn; N], lengths: [f64; N]) {
        let mut word = Word::default();
        for (turn, length) in turns.into_iter().zip(lengths) {
            if length.abs() > ZERO {
                let curvature = f64::from(turn) / self.radius;
                word.segments[word.len] = Segment { curvature, length: length * self.radius };
                word.len += 1;
            }
        }
        self.out.push(word);
    }
}

/// Length of the shortest word from `from` to `to`, metres.
pub fn shortest_length(from: Pose, to: Pose, radius: f64) -> f64 {
    let length = shortest(UnitGoal::new(from, to, radius));
    // Only coinciding poses may have no word.
    if length.is_finite() { length * radius } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    use super::*;
    use crate::curves::Path;
    use crate::geometry::wrap_angle;
    use crate::rng::{Stream, rng};
    use rand::RngExt;

    const RADIUS: f64 = 4.057;

    fn random_pose(rng: &mut impl rand::Rng, reach: f64) -> Pose {
        let mut r = |a: f64| rng.random_range(-a..a);
        Pose::new(r(reach), r(reach), r(7.0))
    }

    #[test]
    fn every_word_reaches_its_goal() {
        let mut rng = rng(1, Stream::Start, 0);
        let mut out = Vec::new();
        let mut names = std::collections::BTreeSet::new();
        for i in 0..100_000 {
            let reach = [3.0, 10.0, 30.0][i % 3];
            let (from, to) = (random_pose(&mut rng, reach), random_pose(&mut rng, reach));
            out.clear();
            words(from, to, RADIUS, &mut out);
            assert!(!out.is_empty() && out.len() <= 48, "{from:?} {to:?}");
            for w in &out {
                let end = w.segments().iter().fold(from, |p, s| s.end(p));
                let miss = end.distance(to) + wrap_angle(end.heading - to.heading).abs();
                assert!(miss < 1e-6, "{from:?} {to:?} {} {miss}", w.name());
                assert!(w.segments().iter().all(|s| s.turn().abs() <= PI + 1e-9));
                names.insert(w.name());
            }
            let best = out.iter().map(Word::length).fold(f64::INFINITY, f64::min);
            let shortest = shortest_length(from, to, RADIUS);
            assert!((best - shortest).abs() < 1e-6);
            assert!(shortest >= from.distance(to) - 1e-9);
        }
        assert_eq!(names.len(), 48, "{names:?}");
    }

    /// Poses around the origin, most of them on or near the borders where one word takes over
    /// from another.
    fn delicate_pose(rng: &mut impl rand::Rng, i: usize) -> Pose {
        let mut r = |a: f64| rng.random_range(-a..a);
        let reach = [0.3, 2.0, 5.0, 100.0][i % 4];
        let tiny = [0; 3].map(|_| r(1.0).signum() * 10.0_f64.powf(r(6.0) - 6.0));
        let eighth = r(4.0).round() * FRAC_PI_4;
        match i / 4 % 6 {
            0 => Pose::new(r(reach), r(reach), r(PI)),
            1 => Pose::new(tiny[0], tiny[1], tiny[2]),
            2 => Pose::new((2.0 * r(reach)).round() / 2.0, (2.0 * r(reach)).round() / 2.0, eighth),
            3 => Pose::new(r(reach), tiny[0], eighth + tiny[1]),
            4 => Pose::new(r(1.0).round() * reach, r(1.0).round() * reach, r(1.5).round() * PI),
            // Where words of few segments end.
            _ => (0..1 + i % 4).fold(Pose::default(), |pose, _| {
                let length = if i.is_multiple_of(5) { r(4.0).round() * FRAC_PI_4 } else { r(3.0) };
                Segment { curvature: r(1.5).round(), length }.end(pose)
            }),
        }
    }

    #[test]
    fn the_shortest_length_is_that_of_the_shortest_word() {
        let mut rng = rng(3, Stream::Start, 0);
        let mut out = Vec::new();
        let mut check = |to: Pose| {
            out.clear();
            words(Pose::default(), to, 1.0, &mut out);
            let best = out.iter().map(Word::length).fold(f64::INFINITY, f64::min);
            let shortest = shortest_length(Pose::default(), to, 1.0);
            if to.y.abs() < STRAIGHT && wrap_angle(to.heading).abs() < STRAIGHT {
                assert!(best <= shortest + 4.0 * ZERO && best >= to.x.abs() - STRAIGHT, "{to:?}");
                return;
            }
            // Words leave out segments of up to ZERO.
            assert!((best - shortest).abs() < 1e-9 * best + 4.0 * ZERO, "{to:?} {best} {shortest}");
        };
        for i in 0..2_000_000 {
            check(delicate_pose(&mut rng, i));
        }
        for heading in [0.0, -0.0, PI, -PI, FRAC_PI_2, -FRAC_PI_2] {
            for x in [0.0, -0.0, 1.0, -1.0, 2.0, -4.0] {
                for y in [0.0, -0.0, 1.0, -1.0, 2.0, -4.0] {
                    check(Pose::new(x, y, heading));
                }
            }
        }
    }

    #[test]
    fn shortest_length_is_symmetric() {
        let mut rng = rng(2, Stream::Start, 0);
        for _ in 0..10_000 {
            let (a, b) = (random_pose(&mut rng, 10.0), random_pose(&mut rng, 10.0));
            let there = shortest_length(a, b, RADIUS);
            assert!((there - shortest_length(b, a, RADIUS)).abs() < 1e-6);
            let mirror = |p: Pose| Pose::new(p.x, -p.y, -p.heading);
            assert!((there - shortest_length(mirror(a), mirror(b), RADIUS)).abs() < 1e-6);
        }
    }

    #[test]
    fn equal_poses_need_no_motion() {
        let p = Pose::new(3.0, 4.0, 1.0);
        let mut out = Vec::new();
        words(p, p, RADIUS, &mut out);
        assert!(out.iter().any(|w| w.length() < 1e-6));
        assert!(shortest_length(p, p, RADIUS) < 1e-6);
        assert!(Path::new(p, out[0].segments().iter().copied()).end().distance(p) < 1e-6);
    }

    #[test]
    fn straight_ahead_is_one_straight() {
        let mut out = Vec::new();
        words(Pose::default(), Pose::new(5.0, 0.0, 0.0), 1.0, &mut out);
        let best = out.iter().min_by(|a, b| a.length().total_cmp(&b.length())).unwrap();
        assert_eq!(best.name(), "S+");
    }
}
