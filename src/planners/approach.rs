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
    /// The gear of going on: which of the tables.
    gear: Vec<u8>,
}

impl Poses {
    pub fn push(&mut self, pose: Pose, cost: f64, gear: Option<Gear>) {
        self.x.push(pose.x as f32);
        self.y.push(pose.y as f32);
        self.turn.push(steps(pose.heading));
        self.cost.push(cost as f32);
        self.gear.push(GEARS.iter().position(|g| *g == gear).unwrap_or(0) as u8);
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

/// Poses as they are seen from one start.
pub(super) struct View<'a> {
    poses: &'a Poses,
    /// The frame of the poses.
    frame: Pose,
    vehicle: &'a Vehicle,
    /// Metres in a step of the table.
    step: f64,
    model: &'a CostModel,
    /// By pose: its entry in the table, beyond its end where the table does not reach.
    entries: &'a [u32],
    table: &'a mut [f32],
    words: &'a mut Vec<Word>,
}

impl Approaches {
    /// Sees `poses`, given in a frame that lies at `frame`, from the origin.
    pub fn view<'a>(
        &'a mut self,
        poses: &'a Poses,
        frame: Pose,
        vehicle: &'a Vehicle,
        model: &'a CostModel,
    ) -> View<'a> {
        if self.made_for != Some((*vehicle, *model)) {
            self.made_for = Some((*vehicle, *model));
            self.table.clear();
            self.table.resize(GEARS.len() * ENTRIES, f32::NAN);
        }
        let (sin, cos) = frame.sin_cos();
        let (sin, cos) = (sin as f32, cos as f32);
        let step = vehicle.scale();
        let per_metre = (1.0 / step) as f32;
        let (at_x, at_y) = ((frame.x / step) as f32, (frame.y / step) as f32);
        let (sin, cos, turned) = (sin * per_metre, cos * per_metre, steps(frame.heading));
        let columns = poses.x.iter().zip(&poses.y).zip(&poses.turn);
        self.entries.clear();
        self.entries.extend(columns.map(|((x, y), turn)| {
            let seen_y = at_y + sin * x + cos * y;
            let side = 1.0_f32.copysign(seen_y);
            entry(at_x + cos * x - sin * y, side * seen_y, side * (turned + turn))
        }));
        let Self { table, words, entries, .. } = self;
        View { poses, frame, vehicle, step, model, entries, table, words }
    }
}

impl View<'_> {
    /// Estimated cost from the start by way of pose `index`.
    #[inline]
    pub fn cost(&mut self, index: usize) -> f32 {
        let entry = self.entries[index] as usize;
        let stored = if entry < ENTRIES { self.table[self.at(index)] } else { f32::NAN };
        let approach = if stored.is_nan() { self.compute(index) } else { stored };
        self.poses.cost[index] + approach
    }

    /// Where the table of the pose's gear has its bin.
    #[inline]
    fn at(&self, index: usize) -> usize {
        usize::from(self.poses.gear[index]) * ENTRIES + self.entries[index] as usize
    }

    /// The least cost to the middle of the pose's bin, which is kept, or to a far pose.
    #[cold]
    fn compute(&mut self, index: usize) -> f32 {
        let (entry, at) = (self.entries[index] as usize, self.at(index));
        let Poses { x, y, turn, gear, .. } = self.poses;
        let (gear, from) = (GEARS[usize::from(gear[index])], Pose::default());
        let mut least = |to| {
            least_curve_cost_before(gear, from, to, self.vehicle, self.model, self.words) as f32
        };
        if entry >= ENTRIES {
            let heading = f64::from(turn[index] / HEADINGS) * TAU;
            return least(self.frame.compose(Pose::new(x[index].into(), y[index].into(), heading)));
        }
        let (headings, side) = (HEADINGS as usize, SIDE as usize);
        let position = entry / headings;
        self.table[at] = least(Pose::new(
            ((position % side) as f64 - f64::from(REACH)) * self.step,
            (position / side) as f64 * self.step,
            (entry % headings) as f64 / headings as f64 * TAU,
        ));
        self.table[at]
    }
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
            let mut view = approaches.view(&poses, frame, &vehicle, &model);
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
                for _ in 0..2 {
                    let got = f64::from(view.cost(i));
                    assert!((got - expected).abs() < 1e-3, "{p:?}: {got}, not {expected}");
                }
            }
        }
        assert!(near > 500 && far > 50, "{near} {far}");
    }
}
