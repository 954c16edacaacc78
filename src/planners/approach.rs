//! Estimates of the way from a start to each of many poses: what ranks a library's manoeuvres.
//!
//! Least Reeds-Shepp cost like the heuristic's (`nonholonomic`), from a table of coarser steps,
//! filled after a few dozen problems. There are hundreds of poses and little is needed of each,
//! so they lie in columns of single precision, and the compiler makes their table entries out
//! several at a time.

use std::f64::consts::TAU;

use crate::curves::reeds_shepp::Word;
use crate::geometry::Pose;
use crate::vehicle::{Gear, Vehicle};

use super::analytic::least_curve_cost_before;
use super::cost::CostModel;

/// The table's steps: 1 m (for the default vehicle; scaled for others), so that a position's bin
/// is its nearest integers, and 15°.
const HEADINGS: f32 = 24.0;
/// It reaches so many metres along x to both sides and along y to one: driving is
/// mirror-symmetric.
const REACH: f32 = 32.0;
/// Bins along x.
const SIDE: f32 = 2.0 * REACH + 1.0;
/// What a way may go on in: nothing, where it ends, or a gear. A table for each.
const GEARS: [Option<Gear>; 3] = [None, Some(Gear::Forward), Some(Gear::Backward)];
const ENTRIES: usize = (SIDE * (REACH + 1.0) * HEADINGS) as usize;

/// Poses in one frame, each with a cost of going on from there.
#[derive(Clone, Debug, Default)]
pub(super) struct Poses {
    x: Vec<f32>,
    y: Vec<f32>,
    /// Headings in steps of the table.
    turn: Vec<f32>,
    cost: Vec<f32>,
    /// Where the table of the gear of going on begins.
    table: Vec<u32>,
}

impl Poses {
    pub fn push(&mut self, pose: Pose, cost: f64, gear: Option<Gear>) {
        self.x.push(pose.x as f32);
        self.y.push(pose.y as f32);
        self.turn.push(steps(pose.heading));
        self.cost.push(cost as f32);
        let table = GEARS.iter().position(|g| *g == gear).unwrap_or(0);
        self.table.push((table * ENTRIES) as u32);
    }

    /// The entries of the tables where the poses are seen whose frame lies at `frame`, beyond the last where no
    /// table reaches. `step`: metres in a step of a table.
    fn seen_from(&self, frame: Pose, step: f64, entries: &mut Vec<u32>) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.seen_from_avx2(frame, step, entries) };
        }
        self.seen_from_plain(frame, step, entries);
    }

    /// The same loop compiled for eight numbers per register.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn seen_from_avx2(&self, frame: Pose, step: f64, entries: &mut Vec<u32>) {
        self.seen_from_plain(frame, step, entries);
    }

    #[inline(always)]
    fn seen_from_plain(&self, frame: Pose, step: f64, entries: &mut Vec<u32>) {
        let (sin, cos) = frame.sin_cos();
        let (sin, cos) = (sin as f32, cos as f32);
        let per_metre = (1.0 / step) as f32;
        let (at_x, at_y) = ((frame.x / step) as f32, (frame.y / step) as f32);
        let (sin, cos, turned) = (sin * per_metre, cos * per_metre, steps(frame.heading));
        let columns = self.x.iter().zip(&self.y).zip(&self.turn).zip(&self.table);
        entries.clear();
        entries.extend(columns.map(|(((x, y), turn), table)| {
            let seen_y = at_y + sin * x + cos * y;
            let side = 1.0_f32.copysign(seen_y);
            table + entry(at_x + cos * x - sin * y, side * seen_y, side * (turned + turn))
        }));
    }
}

/// The table of estimates; buffers are reused.
#[derive(Debug, Default)]
pub(super) struct Approaches {
    made_for: Option<(Vehicle, CostModel)>,
    table: Vec<f32>,
    words: Vec<Word>,
    entries: Vec<u32>,
}

impl Approaches {
    /// Estimates what it costs to come from the origin to each of the `poses`, whose frame lies at `frame`, and
    /// to go on from there.
    pub fn costs(
        &mut self,
        poses: &Poses,
        frame: Pose,
        vehicle: &Vehicle,
        model: &CostModel,
        costs: &mut Vec<f32>,
    ) {
        if self.made_for != Some((*vehicle, *model)) {
            self.made_for = Some((*vehicle, *model));
            self.table.clear();
            self.table.resize(GEARS.len() * ENTRIES, f32::NAN);
        }
        let step = vehicle.scale();
        poses.seen_from(frame, step, &mut self.entries);
        let stored = |entry: &u32| self.table.get(*entry as usize).copied().unwrap_or(f32::NAN);
        costs.clear();
        costs.extend(self.entries.iter().zip(&poses.cost).map(|(e, cost)| cost + stored(e)));
        for (index, cost) in costs.iter_mut().enumerate().filter(|(_, cost)| cost.is_nan()) {
            let (table, from) = (poses.table[index] as usize, Pose::default());
            let gear = GEARS[table / ENTRIES];
            let mut least = |to| {
                least_curve_cost_before(gear, from, to, vehicle, model, &mut self.words) as f32
            };
            let at = self.entries[index] as usize;
            let approach = match self.table.get_mut(at) {
                Some(stored) if stored.is_nan() => {
                    *stored = least(middle(at - table, step));
                    *stored
                }
                Some(stored) => *stored,
                None => {
                    let [x, y, turn] = [&poses.x, &poses.y, &poses.turn].map(|v| v[index]);
                    let heading = f64::from(turn / HEADINGS) * TAU;
                    least(frame.compose(Pose::new(x.into(), y.into(), heading)))
                }
            };
            *cost = poses.cost[index] + approach;
        }
    }
}

/// The middle of a bin of the table.
fn middle(entry: usize, step: f64) -> Pose {
    let (headings, side) = (HEADINGS as usize, SIDE as usize);
    let position = entry / headings;
    Pose::new(
        ((position % side) as f64 - f64::from(REACH)) * step,
        (position / side) as f64 * step,
        (entry % headings) as f64 / headings as f64 * TAU,
    )
}

/// `heading` in steps of the table, from 0 to less than [`HEADINGS`].
fn steps(heading: f64) -> f32 {
    (heading / TAU).rem_euclid(1.0) as f32 * HEADINGS
}

/// The table's entry at a pose with `y ≥ 0`; beyond its end where it does not reach.
#[inline]
fn entry(x: f32, y: f32, turn: f32) -> u32 {
    let (x, y, turn) = (nearest(x), nearest(y), nearest(turn));
    let turns = nearest((turn + 0.5) / HEADINGS - 0.5);
    let entry = (y * SIDE + x + REACH) * HEADINGS + (turn - turns * HEADINGS);
    // One comparison: with two there would be a branch.
    let inside = x.abs().max(y) <= REACH;
    bits(if inside { entry } else { INTEGERS - 1.0 })
}

/// From here to twice this single precision has integers and nothing between.
const INTEGERS: f32 = 8_388_608.0;

/// The nearest integer of a number of less than seven digits. Two sums, where rounding would be
/// a call.
#[inline]
fn nearest(v: f32) -> f32 {
    (v + 1.5 * INTEGERS) - 1.5 * INTEGERS
}

/// An integer from 0 to less than [`INTEGERS`], without the checks of a conversion.
#[inline]
fn bits(v: f32) -> u32 {
    (v + INTEGERS).to_bits() - INTEGERS.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, rng};
    use rand::RngExt;

    #[test]
    fn an_estimate_is_the_least_cost_to_the_middle_of_a_bin_or_to_a_far_pose() {
        let (vehicle, model) = (Vehicle::default(), CostModel::default());
        let mut rng = rng(5, Stream::Start, 0);
        let mut r = |a: f64| rng.random_range(-a..a);
        let mut words = Vec::new();
        let mut cost = |gear, to| {
            least_curve_cost_before(gear, Pose::default(), to, &vehicle, &model, &mut words)
        };
        let mut approaches = Approaches::default();
        let (mut near, mut far) = (0, 0);
        for _ in 0..50 {
            let frame = Pose::new(r(30.0), r(30.0), r(9.0));
            let given: Vec<Pose> = (0..20).map(|_| Pose::new(r(9.0), r(9.0), r(9.0))).collect();
            let mut poses = Poses::default();
            let gear = |i: usize| GEARS[i % GEARS.len()];
            (0..).zip(&given).for_each(|(i, &p)| poses.push(p, 1.0, gear(i)));
            let mut all = [Vec::new(), Vec::new()];
            for costs in &mut all {
                approaches.costs(&poses, frame, &vehicle, &model, costs);
            }
            for (i, &pose) in given.iter().enumerate() {
                let p = frame.compose(pose);
                let step = TAU / 24.0;
                let middle = Pose::new(p.x.round(), p.y.round(), (p.heading / step).round() * step);
                // At a border rounding may go either way.
                let off = [p.x, p.y, p.heading / step].map(|v| (v.fract().abs() - 0.5).abs());
                if off.iter().any(|off| *off < 1e-4) {
                    continue;
                }
                let inside = middle.x.abs() <= 32.0 && middle.y.abs() <= 32.0;
                *(if inside { &mut near } else { &mut far }) += 1;
                let expected = 1.0 + cost(gear(i), if inside { middle } else { p });
                for costs in &all {
                    let got = f64::from(costs[i]);
                    assert!((got - expected).abs() < 1e-3, "{p:?}: {got}, not {expected}");
                }
            }
        }
        assert!(near > 500 && far > 50, "{near} {far}");
    }
}
