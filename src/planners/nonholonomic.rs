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

/// How finely poses are told apart.
#[derive(Clone, Copy, Debug)]
struct Bins {
    per_metre: f64,
    /// Half the table's width, bins.
    half: i32,
    headings: usize,
}

#[derive(Debug)]
pub(super) struct NonHolonomic {
    bins: Bins,
    made_for: Option<(Vehicle, CostModel)>,
    table: Vec<f32>,
    words: Vec<Word>,
}

impl Default for NonHolonomic {
    /// Steps of 0.4 m and 5°, up to 20 m: for a search, which asks again and again.
    fn default() -> Self {
        Self::new(Bins { per_metre: 2.5, half: 50, headings: 72 })
    }
}

impl NonHolonomic {
    /// Steps of 1 m and 15°, up to 32 m: filled after a few dozen problems.
    pub fn coarse() -> Self {
        Self::new(Bins { per_metre: 1.0, half: 32, headings: 24 })
    }

    fn new(bins: Bins) -> Self {
        Self { bins, made_for: None, table: Vec::new(), words: Vec::new() }
    }

    /// Forgets the table when the vehicle or the cost is another one.
    pub fn reset(&mut self, vehicle: &Vehicle, model: &CostModel) {
        if self.made_for != Some((*vehicle, *model)) {
            let Bins { half, headings, .. } = self.bins;
            self.made_for = Some((*vehicle, *model));
            self.table.clear();
            self.table.resize((2 * half as usize + 1) * (half as usize + 1) * headings, f32::NAN);
        }
    }

    /// Least cost from the start to `pose`, given in the start's frame; its heading must lie
    /// in [−8π, 8π].
    pub fn cost(&mut self, pose: Pose, vehicle: &Vehicle, model: &CostModel) -> f64 {
        // Mirror symmetry: only y ≥ 0 is stored.
        let (y, heading) =
            if pose.y < 0.0 { (-pose.y, -pose.heading) } else { (pose.y, pose.heading) };
        let Bins { per_metre, half, headings } = self.bins;
        let side = 2 * half as usize + 1;
        // Truncation of what is not negative: cheaper than rounding without SSE 4.1.
        let (x, y_bin) = (pose.x * per_metre + f64::from(half) + 0.5, y * per_metre + 0.5);
        let (ix, iy) = (x as usize, y_bin as usize);
        let start = Pose::default();
        if x < 0.0 || ix >= side || iy > half as usize {
            let far = Pose::new(pose.x, y, heading);
            return least_curve_cost(start, far, vehicle, model, &mut self.words);
        }
        let turn = heading * (headings as f64 / TAU) + 0.5 + (4 * headings) as f64;
        let ih = turn as usize % headings;
        let index = (iy * side + ix) * headings + ih;
        let stored = self.table[index];
        if !stored.is_nan() {
            return f64::from(stored);
        }
        let center = Pose::new(
            (ix as f64 - f64::from(half)) / per_metre,
            iy as f64 / per_metre,
            ih as f64 / headings as f64 * TAU,
        );
        let cost = least_curve_cost(start, center, vehicle, model, &mut self.words) as f32;
        self.table[index] = cost;
        f64::from(cost)
    }
}
