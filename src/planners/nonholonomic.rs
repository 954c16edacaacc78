//! The non-holonomic half of the heuristic: least Reeds-Shepp cost from the start, tabulated.
//!
//! Depends on the start-relative pose only, so the table serves every problem of one
//! vehicle. Entries are computed when first asked for, each at its bin's centre: the value
//! never depends on which problem asked.

use std::f64::consts::TAU;

use crate::curves::reeds_shepp::Word;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;

use super::analytic::least_curve_cost;
use super::cost::CostModel;

/// Bins per metre, half width in bins, heading bins.
const PER_METRE: f64 = 2.5;
const HALF: i32 = 50;
const SIDE: usize = 2 * HALF as usize + 1;
const HEADINGS: usize = 72;

#[derive(Debug, Default)]
pub(super) struct NonHolonomic {
    vehicle: Option<Vehicle>,
    table: Vec<f32>,
    words: Vec<Word>,
}

impl NonHolonomic {
    /// Forgets the table when the vehicle is another one.
    pub fn reset(&mut self, vehicle: &Vehicle) {
        if self.vehicle.as_ref() != Some(vehicle) {
            self.vehicle = Some(*vehicle);
            self.table.clear();
            self.table.resize(SIDE * (HALF as usize + 1) * HEADINGS, f32::NAN);
        }
    }

    /// Least cost from the start to `pose`, given in the start's frame.
    pub fn cost(&mut self, pose: Pose, vehicle: &Vehicle, model: &CostModel) -> f64 {
        // Mirror symmetry: only y ≥ 0 is stored.
        let (y, heading) =
            if pose.y < 0.0 { (-pose.y, -pose.heading) } else { (pose.y, pose.heading) };
        let (ix, iy) = ((pose.x * PER_METRE).round(), (y * PER_METRE).round());
        let turn = (heading / TAU).rem_euclid(1.0);
        let ih = (turn * HEADINGS as f64 + 0.5) as usize % HEADINGS;
        let start = Pose::default();
        if ix.abs() > f64::from(HALF) || iy > f64::from(HALF) {
            return least_curve_cost(start, pose, vehicle, model, &mut self.words);
        }
        let index = ((iy as usize * SIDE) + (ix as i32 + HALF) as usize) * HEADINGS + ih;
        let stored = self.table[index];
        if !stored.is_nan() {
            return f64::from(stored);
        }
        let center = Pose::new(ix / PER_METRE, iy / PER_METRE, ih as f64 / HEADINGS as f64 * TAU);
        let cost = least_curve_cost(start, center, vehicle, model, &mut self.words) as f32;
        self.table[index] = cost;
        f64::from(cost)
    }
}
