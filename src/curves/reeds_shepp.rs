//! Reeds-Shepp curves: shortest paths of a car that drives both ways.
//!
//! J. A. Reeds and L. A. Shepp, "Optimal paths for a car that goes both forwards and
//! backwards", Pacific J. Math. 145(2), 1990. Formula numbers below are theirs. A *word*
//! is a sequence of at most five segments, each a left or right arc of smallest radius or
//! a straight, each forward or backward; 48 words suffice. Nine base formulas give all of
//! them through time flip, reflection and reversal.
//!
//! Inside this module lengths are in turning radii and the goal is seen from the start.

use std::f64::consts::{FRAC_PI_2, PI};

use super::Segment;
use crate::geometry::{Pose, wrap_angle};

/// Lengths below this (in radii) count as zero, so that a word which needs an arc of
/// −1e-17 is not lost to rounding.
const ZERO: f64 = 1e-9;

/// One word between two poses: up to five segments, lengths in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Word {
    segments: [Segment; 5],
    len: usize,
}

impl Word {
    /// The segments in driving order, metres.
    pub fn segments(&self) -> &[Segment] {
        &self.segments[..self.len]
    }

    /// Driven length, metres.
    pub fn length(&self) -> f64 {
        self.segments().iter().map(|s| s.length.abs()).sum()
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

/// All words from `from` to `to` that exist, unsorted, appended to `out` (at most 48).
///
/// `radius`: turning radius, metres. Every arc turns by at most π.
pub fn words(from: Pose, to: Pose, radius: f64, out: &mut Vec<Word>) {
    let first = out.len();
    enumerate(UnitGoal::new(from, to, radius), |turns, lengths| {
        let mut word = Word::default();
        for (turn, length) in turns.iter().zip(lengths) {
            if length.abs() > ZERO {
                let curvature = f64::from(*turn) / radius;
                word.segments[word.len] = Segment { curvature, length: length * radius };
                word.len += 1;
            }
        }
        out.push(word);
    });
    if out.len() == first {
        // Only when the poses coincide: the formulas give words of length zero or none.
        debug_assert!(from.distance(to) < 1e-6 * radius);
        out.push(Word::default());
    }
}

/// Length of the shortest word from `from` to `to`, metres.
pub fn shortest_length(from: Pose, to: Pose, radius: f64) -> f64 {
    let mut best = f64::INFINITY;
    enumerate(UnitGoal::new(from, to, radius), |_, lengths| {
        best = best.min(lengths.iter().map(|l| l.abs()).sum());
    });
    if best.is_finite() { best * radius } else { 0.0 }
}

/// The goal seen from the start, in turning radii, with its sine and cosine: computed
/// once for all words, since every symmetry only changes signs.
#[derive(Clone, Copy)]
struct UnitGoal {
    x: f64,
    y: f64,
    phi: f64,
    sin: f64,
    cos: f64,
}

impl UnitGoal {
    fn new(from: Pose, to: Pose, radius: f64) -> Self {
        let (s, c) = from.sin_cos();
        let (dx, dy) = ((to.x - from.x) / radius, (to.y - from.y) / radius);
        let phi = wrap_angle(to.heading - from.heading);
        let (sin, cos) = phi.sin_cos();
        Self { x: c * dx + s * dy, y: c * dy - s * dx, phi, sin, cos }
    }

    /// Driving the word with every gear swapped reaches the goal: (−x, y, −φ).
    fn time_flipped(self) -> Self {
        Self { x: -self.x, phi: -self.phi, sin: -self.sin, ..self }
    }

    /// Left and right swapped: (x, −y, −φ).
    fn reflected(self) -> Self {
        Self { y: -self.y, phi: -self.phi, sin: -self.sin, ..self }
    }

    /// The word driven from its end: the start seen from the goal, in the sense of § 8.
    fn reversed(self) -> Self {
        Self {
            x: self.x * self.cos + self.y * self.sin,
            y: self.x * self.sin - self.y * self.cos,
            ..self
        }
    }
}

/// Turn of a segment in the base orientation: left, straight, right.
type Turn = i8;
const L: Turn = 1;
const S: Turn = 0;
const R: Turn = -1;

/// Calls `emit(turns, lengths)` for every word that reaches `goal`.
fn enumerate(goal: UnitGoal, mut emit: impl FnMut(&[Turn], &[f64])) {
    for (time_flip, reflect) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut g = goal;
        if time_flip {
            g = g.time_flipped();
        }
        if reflect {
            g = g.reflected();
        }
        let gear = if time_flip { -1.0 } else { 1.0 };
        let side: Turn = if reflect { -1 } else { 1 };
        let mut put = |turns: &[Turn], lengths: &[f64]| {
            let (mut t, mut l) = ([0; 5], [0.0; 5]);
            for i in 0..turns.len() {
                t[i] = turns[i] * side;
                l[i] = lengths[i] * gear;
            }
            emit(&t[..turns.len()], &l[..turns.len()]);
        };
        base_words(g, &mut put);
    }
}

/// The words of one symmetry class.
fn base_words(g: UnitGoal, put: &mut impl FnMut(&[Turn], &[f64])) {
    const Q: f64 = -FRAC_PI_2;
    if let Some((t, u, v)) = lsl(g) {
        put(&[L, S, L], &[t, u, v]);
    }
    if let Some((t, u, v)) = lsr(g) {
        put(&[L, S, R], &[t, u, v]);
    }
    if let Some((t, u, v)) = lrl(g) {
        put(&[L, R, L], &[t, u, v]);
    }
    if let Some((t, u, v)) = lr_u_lr(g) {
        put(&[L, R, L, R], &[t, u, -u, v]);
    }
    if let Some((t, u, v)) = l_ru_lu_r(g) {
        put(&[L, R, L, R], &[t, u, u, v]);
    }
    if let Some((t, u, v)) = l_r_sl(g) {
        put(&[L, R, S, L], &[t, Q, u, v]);
    }
    if let Some((t, u, v)) = l_r_sr(g) {
        put(&[L, R, S, R], &[t, Q, u, v]);
    }
    if let Some((t, u, v)) = l_r_sl_r(g) {
        put(&[L, R, S, L, R], &[t, Q, u, Q, v]);
    }
    let b = g.reversed();
    // L|RL driven from its end is LR|L; when the last arc is backward (8.4) the word is its
    // own reversal class and was already put above only if its gears differ.
    if let Some((t, u, v)) = lrl(b) {
        put(&[L, R, L], &[v, u, t]);
    }
    if let Some((t, u, v)) = l_r_sl(b) {
        put(&[L, S, R, L], &[v, u, Q, t]);
    }
    if let Some((t, u, v)) = l_r_sr(b) {
        put(&[R, S, R, L], &[v, u, Q, t]);
    }
}

fn polar(x: f64, y: f64) -> (f64, f64) {
    // Lengths here are neither huge nor tiny: no need for hypot's scaling.
    ((x * x + y * y).sqrt(), y.atan2(x))
}

fn mod2pi(a: f64) -> f64 {
    wrap_angle(a)
}

/// L⁺S⁺L⁺, eq. 8.1.
fn lsl(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (u, t) = polar(g.x - g.sin, g.y - 1.0 + g.cos);
    if t < -ZERO {
        return None;
    }
    let v = mod2pi(g.phi - t);
    (v >= -ZERO).then_some((t, u, v))
}

/// L⁺S⁺R⁺, eq. 8.2.
fn lsr(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (x, y) = (g.x + g.sin, g.y - 1.0 - g.cos);
    let u1_sq = x * x + y * y;
    if u1_sq < 4.0 {
        return None;
    }
    let u = (u1_sq - 4.0).sqrt();
    let t = mod2pi(y.atan2(x) + 2.0_f64.atan2(u));
    if t < -ZERO {
        return None;
    }
    let v = mod2pi(t - g.phi);
    (v >= -ZERO).then_some((t, u, v))
}

/// L⁺R⁻L^±, eqs. 8.3 and 8.4 (with the misprint of 8.4 corrected: the sign of v tells
/// which of the two it is).
fn lrl(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (u1, theta) = polar(g.x - g.sin, g.y - 1.0 + g.cos);
    if u1 > 4.0 {
        return None;
    }
    let u = -2.0 * (0.25 * u1).asin();
    let t = mod2pi(theta + 0.5 * u + PI);
    let v = mod2pi(g.phi - t + u);
    (t >= -ZERO && u <= ZERO).then_some((t, u, v))
}

/// The outer arcs τ and ω of the four-arc words from their inner arcs.
fn tau_omega(u: f64, v: f64, xi: f64, eta: f64, phi: f64) -> (f64, f64) {
    let delta = mod2pi(u - v);
    let ((su, cu), (sd, cd)) = (u.sin_cos(), delta.sin_cos());
    let (a, b) = (su - sd, cu - cd - 1.0);
    let t1 = (eta * a - xi * b).atan2(xi * a + eta * b);
    let t2 = 2.0 * (cd - v.cos() - cu) + 3.0;
    let tau = if t2 < 0.0 { mod2pi(t1 + PI) } else { mod2pi(t1) };
    (tau, mod2pi(tau - u + v - phi))
}

/// L⁺R⁺ᵤL⁻ᵤR⁻, eq. 8.7.
fn lr_u_lr(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (xi, eta) = (g.x + g.sin, g.y - 1.0 - g.cos);
    let rho = 0.25 * (2.0 + (xi * xi + eta * eta).sqrt());
    if rho > 1.0 {
        return None;
    }
    let u = rho.acos();
    let (t, v) = tau_omega(u, -u, xi, eta, g.phi);
    (t >= -ZERO && v <= ZERO).then_some((t, u, v))
}

/// L⁺R⁻ᵤL⁻ᵤR⁺, eq. 8.8.
fn l_ru_lu_r(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (xi, eta) = (g.x + g.sin, g.y - 1.0 - g.cos);
    let rho = (20.0 - xi * xi - eta * eta) / 16.0;
    if !(0.0..=1.0).contains(&rho) {
        return None;
    }
    let u = -rho.acos();
    if u < -FRAC_PI_2 {
        return None;
    }
    let (t, v) = tau_omega(u, u, xi, eta, g.phi);
    (t >= -ZERO && v >= -ZERO).then_some((t, u, v))
}

/// L⁺R⁻(π/2)S⁻L⁻, eq. 8.9.
fn l_r_sl(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (rho, theta) = polar(g.x - g.sin, g.y - 1.0 + g.cos);
    if rho < 2.0 {
        return None;
    }
    let r = (rho * rho - 4.0).sqrt();
    let u = 2.0 - r;
    let t = mod2pi(theta + r.atan2(-2.0));
    let v = mod2pi(g.phi - FRAC_PI_2 - t);
    (t >= -ZERO && u <= ZERO && v <= ZERO).then_some((t, u, v))
}

/// L⁺R⁻(π/2)S⁻R⁻, eq. 8.10.
fn l_r_sr(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (rho, t) = polar(-(g.y - 1.0 - g.cos), g.x + g.sin);
    if rho < 2.0 {
        return None;
    }
    let u = 2.0 - rho;
    let v = mod2pi(t + FRAC_PI_2 - g.phi);
    (t >= -ZERO && u <= ZERO && v <= ZERO).then_some((t, u, v))
}

/// L⁺R⁻(π/2)S⁻L⁻(π/2)R⁺, eq. 8.11.
fn l_r_sl_r(g: UnitGoal) -> Option<(f64, f64, f64)> {
    let (xi, eta) = (g.x + g.sin, g.y - 1.0 - g.cos);
    let rho_sq = xi * xi + eta * eta;
    if rho_sq < 4.0 {
        return None;
    }
    let u = 4.0 - (rho_sq - 4.0).sqrt();
    if u > ZERO {
        return None;
    }
    let t = mod2pi(((4.0 - u) * xi - 2.0 * eta).atan2(-2.0 * xi + (u - 4.0) * eta));
    let v = mod2pi(t - g.phi);
    (t >= -ZERO && v >= -ZERO).then_some((t, u, v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::Path;
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
