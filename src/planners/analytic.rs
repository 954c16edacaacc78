//! Analytic expansion: Reeds-Shepp curves straight to the goal.
//!
//! As the paper says, a car aligned with a bay reaches any depth by driving straight, so
//! the goal of a bay is a set: the parked pose shifted outward along its axis, joined by a
//! straight that is checked itself. Curves to several of these *entries* are tried, the
//! cheapest first.

use crate::curves::reeds_shepp::{self, Word};
use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::{Gear, Vehicle};
use crate::world::collision::CollisionWorld;

use super::cost::{CostModel, DriveState};

/// The Reeds-Shepp curve (and entry straight) that reached the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalyticTail {
    /// Where the curve begins, planning frame: the paper's x_rs, a preparatory pose.
    pub from: Pose,
    /// The curve.
    pub word: Word,
    /// Signed length of the straight from the curve's end to the goal, metres.
    pub entry: f64,
}

impl AnalyticTail {
    /// Curve and entry straight.
    pub fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        self.word.segments().iter().copied().chain([Segment::straight(self.entry)])
    }
}

/// A goal pose and the straights that may lead into it.
#[derive(Clone, Debug)]
pub(super) struct GoalSet {
    /// The goal itself.
    pub pose: Pose,
    /// Poses to end a curve at, with the signed straight from there to the goal; the goal
    /// itself (straight of zero) first.
    entries: Vec<(Pose, f64)>,
}

impl GoalSet {
    /// Only the pose itself.
    pub fn single(pose: Pose) -> Self {
        Self { pose, entries: vec![(pose, 0.0)] }
    }

    /// The pose and every free entry straight into it in one of `gears`, `step` metres
    /// apart and at most `longest` metres long.
    pub fn with_entries(
        pose: Pose,
        gears: &[Gear],
        step: f64,
        longest: f64,
        world: &CollisionWorld,
    ) -> Self {
        let mut set = Self::single(pose);
        for gear in gears {
            for i in 1..=(longest / step + 1e-9) as usize {
                let entry = gear.sign() * i as f64 * step;
                let outward = Segment::straight(-entry);
                if !world.segment_is_free(pose, outward) {
                    break;
                }
                set.entries.push((outward.end(pose), entry));
            }
        }
        set
    }
}

/// Tries curves to a goal set; buffers are reused.
#[derive(Debug, Default)]
pub(super) struct AnalyticExpansion {
    words: Vec<Word>,
    candidates: Vec<Candidate>,
}

#[derive(Debug)]
struct Candidate {
    cost: f64,
    word: Word,
    entry: f64,
}

impl AnalyticExpansion {
    /// The cheapest free curve from the free pose `from` into `goal`, and its cost.
    ///
    /// `state`: gear and steering on arrival at `from`. Curves of cost `bound` or more are
    /// not looked at.
    pub fn connect(
        &mut self,
        from: Pose,
        state: DriveState,
        goal: &GoalSet,
        vehicle: &Vehicle,
        cost: &CostModel,
        world: &CollisionWorld,
        bound: f64,
    ) -> Option<(AnalyticTail, f64)> {
        self.candidates.clear();
        let radius = vehicle.turning_radius();
        for &(to, entry) in &goal.entries {
            self.words.clear();
            reeds_shepp::words(from, to, radius, &mut self.words);
            for &word in &self.words {
                let cost = curve_cost(&word, entry, state, vehicle, cost);
                if cost < bound {
                    self.candidates.push(Candidate { cost, word, entry });
                }
            }
        }
        self.candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let free = self.candidates.iter().find(|c| world.segments_are_free(from, c.word.segments()));
        free.map(|c| (AnalyticTail { from, word: c.word, entry: c.entry }, c.cost))
    }
}

/// Cost of a word and its entry straight.
fn curve_cost(
    word: &Word,
    entry: f64,
    mut state: DriveState,
    vehicle: &Vehicle,
    model: &CostModel,
) -> f64 {
    let mut total = 0.0;
    for s in word.segments() {
        let steer = vehicle.max_steer * sign_or_zero(s.curvature);
        let (cost, next) = model.segment(state, s.length, steer);
        total += cost;
        state = next;
    }
    if entry != 0.0 {
        total += model.segment(state, entry, 0.0).0;
    }
    total
}

/// −1, 0 or 1.
fn sign_or_zero(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

/// The least cost of any word from `from` to `to`, ignoring obstacles: the non-holonomic
/// half of the heuristic.
pub(super) fn least_curve_cost(
    from: Pose,
    to: Pose,
    vehicle: &Vehicle,
    model: &CostModel,
    words: &mut Vec<Word>,
) -> f64 {
    words.clear();
    reeds_shepp::words(from, to, vehicle.turning_radius(), words);
    // Gear and wheels on arrival are unknown: neither is charged.
    let costs = words.iter().map(|w| {
        let steer = w.segments().first().map_or(0.0, |s| vehicle.max_steer * sign_or_zero(s.curvature));
        curve_cost(w, 0.0, DriveState { gear: None, steer }, vehicle, model)
    });
    costs.fold(f64::INFINITY, f64::min)
}
