//! The nine base formulas, and the 48 words they give.

use std::f64::consts::{FRAC_PI_2, PI};

use super::ZERO;
use super::centres::{Opposite, Same, UnitGoal, wrap};

/// Turn of a segment: left, straight, right.
pub(super) type Turn = i8;
const L: Turn = 1;
const S: Turn = 0;
const R: Turn = -1;

/// Takes words as they are found.
pub(super) trait Sink {
    /// One word: the turn and the signed length, in radii, of every segment.
    fn word<const N: usize>(&mut self, turns: [Turn; N], lengths: [f64; N]);
}

/// Hands every word that reaches `goal` to `sink`.
pub(super) fn enumerate(goal: UnitGoal, sink: &mut impl Sink) {
    let left = (Same::new(goal.left_left()), Opposite::new(goal.left_right()));
    let right = (Same::new(goal.right_right()), Opposite::new(goal.right_left()));
    let flip = |(same, opposite): (Same, Opposite)| (same.time_flipped(), opposite.time_flipped());
    let (left_flipped, right_flipped) = (flip(left), flip(right));
    let phi = goal.phi;
    Class::new(phi, left, right).words(&mut Mapped { gear: 1.0, side: 1, sink });
    Class::new(-phi, left_flipped, right_flipped).words(&mut Mapped { gear: -1.0, side: 1, sink });
    Class::new(-phi, right, left).words(&mut Mapped { gear: 1.0, side: -1, sink });
    Class::new(phi, right_flipped, left_flipped).words(&mut Mapped { gear: -1.0, side: -1, sink });
}

/// Undoes the symmetry of a class in the words it gives.
struct Mapped<'a, T> {
    gear: f64,
    side: Turn,
    sink: &'a mut T,
}

impl<T: Sink> Mapped<'_, T> {
    fn put<const N: usize>(&mut self, turns: [Turn; N], lengths: [f64; N]) {
        self.sink.word(turns.map(|t| t * self.side), lengths.map(|l| l * self.gear));
    }
}

/// A goal in one of the four symmetries (time flip and reflection or neither).
struct Class {
    phi: f64,
    same: Same,
    opposite: Opposite,
    /// The same goal driven from its end.
    same_reversed: Same,
    opposite_reversed: Opposite,
}

impl Class {
    fn new(phi: f64, left: (Same, Opposite), right: (Same, Opposite)) -> Self {
        let (same_reversed, opposite_reversed) = (left.0.reversed(phi), right.1.reversed(phi));
        Self { phi, same: left.0, opposite: left.1, same_reversed, opposite_reversed }
    }

    #[inline]
    fn words(&self, to: &mut Mapped<'_, impl Sink>) {
        const Q: f64 = -FRAC_PI_2;
        let phi = self.phi;
        if let Some((t, u, v)) = lsl(&self.same, phi) {
            to.put([L, S, L], [t, u, v]);
        }
        if let Some((t, u, v)) = lsr(&self.opposite, phi) {
            to.put([L, S, R], [t, u, v]);
        }
        if let Some((t, u, v)) = lrl(&self.same, phi) {
            to.put([L, R, L], [t, u, v]);
        }
        if let Some((t, u, v)) = lr_u_lr(&self.opposite, phi) {
            to.put([L, R, L, R], [t, u, -u, v]);
        }
        if let Some((t, u, v)) = l_ru_lu_r(&self.opposite, phi) {
            to.put([L, R, L, R], [t, u, u, v]);
        }
        if let Some((t, u, v)) = l_r_sl(&self.same, phi) {
            to.put([L, R, S, L], [t, Q, u, v]);
        }
        if let Some((t, u, v)) = l_r_sr(&self.opposite, phi) {
            to.put([L, R, S, R], [t, Q, u, v]);
        }
        if let Some((t, u, v)) = l_r_sl_r(&self.opposite, phi) {
            to.put([L, R, S, L, R], [t, Q, u, Q, v]);
        }
        // L|RL driven from its end is LR|L; when the last arc is backward (8.4) the word is
        // its own reversal class and was already put above only if its gears differ.
        if let Some((t, u, v)) = lrl(&self.same_reversed, phi) {
            to.put([L, R, L], [v, u, t]);
        }
        if let Some((t, u, v)) = l_r_sl(&self.same_reversed, phi) {
            to.put([L, S, R, L], [v, u, Q, t]);
        }
        if let Some((t, u, v)) = l_r_sr(&self.opposite_reversed, phi) {
            to.put([R, S, R, L], [v, u, Q, t]);
        }
    }
}

/// The lengths t, u and v of a formula, signed.
pub(super) type Triple = (f64, f64, f64);

/// L⁺S⁺L⁺, eq. 8.1.
pub(super) fn lsl(c: &Same, phi: f64) -> Option<Triple> {
    let t = c.theta;
    let v = wrap(phi - t);
    (t >= -ZERO && v >= -ZERO).then_some((t, c.rho, v))
}

/// L⁺S⁺R⁺, eq. 8.2.
pub(super) fn lsr(c: &Opposite, phi: f64) -> Option<Triple> {
    let (u, beyond) = c.crossing?;
    let t = wrap(c.theta + beyond);
    let v = wrap(t - phi);
    (t >= -ZERO && v >= -ZERO).then_some((t, u, v))
}

/// L⁺R⁻L^±, eqs. 8.3 and 8.4 (with the misprint of 8.4 corrected: the sign of v tells
/// which of the two it is).
pub(super) fn lrl(c: &Same, phi: f64) -> Option<Triple> {
    let half = c.half_middle?;
    let u = -2.0 * half;
    let t = wrap(c.theta - half + PI);
    let v = wrap(phi - t + u);
    (t >= -ZERO).then_some((t, u, v))
}

/// L⁺R⁺ᵤL⁻ᵤR⁻, eq. 8.7; its τ is θ + π/2 + u.
pub(super) fn lr_u_lr(c: &Opposite, phi: f64) -> Option<Triple> {
    let u = c.outward?;
    let t = wrap(c.theta + FRAC_PI_2 + u);
    let v = wrap(t - 2.0 * u - phi);
    (t >= -ZERO && v <= ZERO).then_some((t, u, v))
}

/// L⁺R⁻ᵤL⁻ᵤR⁺, eq. 8.8.
pub(super) fn l_ru_lu_r(c: &Opposite, phi: f64) -> Option<Triple> {
    let (u, beyond) = c.inward?;
    let t = wrap(c.theta + beyond);
    let v = wrap(t - phi);
    (t >= -ZERO && v >= -ZERO).then_some((t, u, v))
}

/// L⁺R⁻(π/2)S⁻L⁻, eq. 8.9.
pub(super) fn l_r_sl(c: &Same, phi: f64) -> Option<Triple> {
    let (r, beyond) = c.crossing?;
    let u = 2.0 - r;
    let t = wrap(c.theta + FRAC_PI_2 + beyond);
    let v = wrap(phi - FRAC_PI_2 - t);
    (u <= ZERO && t >= -ZERO && v <= ZERO).then_some((t, u, v))
}

/// L⁺R⁻(π/2)S⁻R⁻, eq. 8.10.
pub(super) fn l_r_sr(c: &Opposite, phi: f64) -> Option<Triple> {
    let u = 2.0 - c.rho;
    if u > 0.0 {
        return None;
    }
    let t = wrap(c.theta + FRAC_PI_2);
    let v = wrap(t + FRAC_PI_2 - phi);
    (t >= -ZERO && v <= ZERO).then_some((t, u, v))
}

/// L⁺R⁻(π/2)S⁻L⁻(π/2)R⁺, eq. 8.11; its t is θ + π/2 and the angle of the crossing.
pub(super) fn l_r_sl_r(c: &Opposite, phi: f64) -> Option<Triple> {
    let (r, beyond) = c.crossing?;
    let u = 4.0 - r;
    let t = wrap(c.theta + FRAC_PI_2 + beyond);
    let v = wrap(t - phi);
    (u <= ZERO && t >= -ZERO && v >= -ZERO).then_some((t, u, v))
}
