//! The non-holonomic half of the heuristic: least Reeds-Shepp cost from the start, tabulated in
//! steps of 0.4 m and 5° up to 20 m (for the default vehicle; scaled for others).
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

/// Bins per metre.
const PER_METRE: f64 = 2.5;
/// Half the table's width, bins.
const HALF: usize = 50;
/// Bins along x.
const SIDE: usize = 2 * HALF + 1;
/// Bins of headings.
const HEADINGS: usize = 72;

#[derive(Debug, Default)]
pub(super) struct NonHolonomic {
    made_for: Option<(Vehicle, CostModel)>,
    /// Bins per metre.
    per_metre: f64,
    table: Vec<f32>,
    words: Vec<Word>,
}

impl NonHolonomic {
    /// Forgets the table when the vehicle or the cost is another one.
    pub fn reset(&mut self, vehicle: &Vehicle, model: &CostModel) {
        if self.made_for != Some((*vehicle, *model)) {
            self.made_for = Some((*vehicle, *model));
            self.per_metre = PER_METRE / vehicle.scale();
            self.table.clear();
            self.table.resize(SIDE * (HALF + 1) * HEADINGS, f32::NAN);
        }
    }

    /// Least cost from the start to `pose`, given in the start's frame; its heading must lie
    /// in [−8π, 8π].
    pub fn cost(&mut self, pose: Pose, vehicle: &Vehicle, model: &CostModel) -> f64 {
        // Mirror symmetry: only y ≥ 0 is stored.
        let (y, heading) =
            if pose.y < 0.0 { (-pose.y, -pose.heading) } else { (pose.y, pose.heading) };
        // Truncation of what is not negative: cheaper than rounding without SSE 4.1.
        let per_metre = self.per_metre;
        let (x, y_bin) = (pose.x * per_metre + HALF as f64 + 0.5, y * per_metre + 0.5);
        let (ix, iy) = (x as usize, y_bin as usize);
        let start = Pose::default();
        if x < 0.0 || ix >= SIDE || iy > HALF {
            let far = Pose::new(pose.x, y, heading);
            return least_curve_cost(start, far, vehicle, model, &mut self.words);
        }
        let turn = heading * (HEADINGS as f64 / TAU) + 0.5 + (4 * HEADINGS) as f64;
        let ih = turn as usize % HEADINGS;
        let index = (iy * SIDE + ix) * HEADINGS + ih;
        let stored = self.table[index];
        if !stored.is_nan() {
            return f64::from(stored);
        }
        let center = Pose::new(
            (ix as f64 - HALF as f64) / per_metre,
            iy as f64 / per_metre,
            ih as f64 / HEADINGS as f64 * TAU,
        );
        let cost = least_curve_cost(start, center, vehicle, model, &mut self.words) as f32;
        self.table[index] = cost;
        f64::from(cost)
    }
}
