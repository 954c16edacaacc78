//! The length of the shortest word, from a quarter of the words.
//!
//! Time flip and reflection bring every goal to x ≥ 0 and y ≥ 0. There only 20 words and
//! C|C|C are ever the shortest, 12 or 13 of them for either sign of the heading. Which, was
//! counted over random goals, not derived; the tests compare the result with all words. For
//! a partition that needs 20 words see doi 10.1109/TRO.2025.3554406.

use std::f64::consts::{FRAC_PI_2, PI};

use super::centres::{Opposite, Same, UnitGoal};
use super::words::{Triple, l_r_sl, l_r_sl_r, l_r_sr, l_ru_lu_r, lr_u_lr, lrl, lsl, lsr};

/// Length of the shortest word to `goal` in radii; infinite without any.
pub(super) fn shortest(goal: UnitGoal) -> f64 {
    let goal = goal.in_first_quadrant();
    if goal.phi < 0.0 { turned_right(goal) } else { turned_left(goal) }
}

/// The candidates where the goal's heading is not to the right. Words are named as driven.
fn turned_left(goal: UnitGoal) -> f64 {
    let phi = goal.phi;
    // L⁺S⁺L⁺
    let ll = length(lsl(&Same::new(goal.left_left()), phi));
    // L⁺S⁺R⁺, L⁻R⁻L⁺R⁺, L⁺S⁺L⁺R⁻
    let lr = Opposite::new(goal.left_right());
    let flipped = lr.time_flipped();
    let lr = length(lsr(&lr, phi))
        .min(double(lr_u_lr(&flipped, -phi)))
        .min(length(l_r_sr(&flipped.reversed(phi), phi)) + FRAC_PI_2);
    // R⁻L⁺R⁺ and C|C|C, R⁺L⁺R⁻, R⁻L⁺S⁺R⁺, R⁺S⁺L⁺R⁻
    let rr = Same::new(goal.right_right()).time_flipped();
    let reversed = rr.reversed(phi);
    let rr = least_of_same(&rr, phi).min(least_of_same(&reversed, phi));
    // R⁺S⁺L⁺, R⁻L⁺R⁺L⁻, R⁻L⁺S⁺L⁺, R⁻L⁺S⁺R⁺L⁻
    let rl = Opposite::new(goal.right_left());
    let rl = length(lsr(&rl, -phi)).min(least_of_opposite(&rl.time_flipped(), phi));
    ll.min(lr).min(rr).min(rl)
}

/// The candidates where the goal's heading is to the right.
fn turned_right(goal: UnitGoal) -> f64 {
    let phi = goal.phi;
    // L⁺R⁺L⁻ and C|C|C, L⁺S⁺R⁺L⁻
    let ll = least_of_same(&Same::new(goal.left_left()).time_flipped().reversed(-phi), -phi);
    // L⁺S⁺R⁺, L⁺R⁺L⁻R⁻
    let lr = Opposite::new(goal.left_right());
    let lr = length(lsr(&lr, phi)).min(double(lr_u_lr(&lr, phi)));
    // R⁺L⁻R⁻ and C|C|C, R⁺L⁻S⁻R⁻
    let rr = least_of_same(&Same::new(goal.right_right()), -phi);
    // R⁺L⁻R⁻L⁺, R⁺L⁻S⁻L⁻, R⁺L⁻S⁻R⁻L⁺, R⁻L⁺R⁺L⁻, R⁻L⁺S⁺R⁺L⁻
    let rl = Opposite::new(goal.right_left());
    let flipped = rl.time_flipped();
    let rl = least_of_opposite(&rl, -phi)
        .min(double(l_ru_lu_r(&flipped, phi)))
        .min(length(l_r_sl_r(&flipped, phi)) + PI);
    ll.min(lr).min(rr).min(rl)
}

/// L⁺R⁻L^± and L⁺R⁻S⁻L⁻.
fn least_of_same(c: &Same, phi: f64) -> f64 {
    length(lrl(c, phi)).min(length(l_r_sl(c, phi)) + FRAC_PI_2)
}

/// L⁺R⁻L⁻R⁺, L⁺R⁻S⁻R⁻ and L⁺R⁻S⁻L⁻R⁺.
fn least_of_opposite(c: &Opposite, phi: f64) -> f64 {
    double(l_ru_lu_r(c, phi))
        .min(length(l_r_sr(c, phi)) + FRAC_PI_2)
        .min(length(l_r_sl_r(c, phi)) + PI)
}

/// The three lengths of a formula together; infinite where it has no word.
fn length(word: Option<Triple>) -> f64 {
    word.map_or(f64::INFINITY, |(t, u, v)| t.abs() + u.abs() + v.abs())
}

/// The same where the second length is driven twice.
fn double(word: Option<Triple>) -> f64 {
    word.map_or(f64::INFINITY, |(t, u, v)| t.abs() + 2.0 * u.abs() + v.abs())
}
