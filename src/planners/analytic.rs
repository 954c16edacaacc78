//! Analytic expansion: Reeds-Shepp curves straight to the goal.
//!
//! As the paper says, a car aligned with a bay reaches any depth by driving straight, so
//! the goal of a bay is a set: the parked pose shifted outward along its axis, joined by a
//! straight that is checked itself. Curves to several of these *entries* are tried, the
//! cheapest first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::curves::Segment;
use crate::curves::reeds_shepp::{self, Word};
use crate::geometry::Pose;
use crate::vehicle::{Gear, Vehicle};

use crate::world::collision::Contact;

use super::Problem;
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

/// Multiples of the entry step that settings within their ranges can ask for.
const MOST_STRAIGHTS: u32 = 1001;

/// What a curve with a motion too short to drive counts as more, in changes of gear.
const TINY_MOTION: f64 = 2.0;

/// A goal pose, and the poses from which the rest of the way into it is known.
#[derive(Clone, Debug)]
pub(crate) struct GoalSet {
    /// The goal itself, or its stand-in where only preparatory poses are meant.
    pub pose: Pose,
    entries: Vec<Entry>,
}

/// A pose to end a curve at, and the free motion from there to the goal.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    /// The pose.
    pub pose: Pose,
    /// The motion from the pose to the goal; empty at the goal itself.
    pub rest: Vec<Segment>,
    /// Whether this is a preparatory pose (else a straight leads into the goal).
    pub preparatory: bool,
    /// Cost of `rest` when arriving in its gear with its steering.
    cost: f64,
    departure: DriveState,
}

impl Entry {
    /// An entry at `pose`, from which `rest` leads to the goal.
    pub fn new(
        pose: Pose,
        rest: Vec<Segment>,
        preparatory: bool,
        vehicle: &Vehicle,
        model: &CostModel,
    ) -> Self {
        let departure = rest.first().map_or(DriveState::PARKED, |s| DriveState {
            gear: Some(s.gear()),
            steer: vehicle.steer(s.curvature),
        });
        let mut state = departure;
        let mut cost = 0.0;
        for s in &rest {
            let (c, next) = model.segment(state, s.length, vehicle.steer(s.curvature));
            cost += c;
            state = next;
        }
        Self { pose, rest, preparatory, cost, departure }
    }

    /// Cost of `rest` when arriving in its gear with its steering.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// Gear and steering that `rest` begins with.
    pub fn departure(&self) -> DriveState {
        self.departure
    }
}

impl GoalSet {
    /// Only the pose itself.
    pub fn single(pose: Pose) -> Self {
        let (rest, departure) = (Vec::new(), DriveState::PARKED);
        let goal = Entry { pose, rest, preparatory: false, cost: 0.0, departure };
        Self { pose, entries: vec![goal] }
    }

    /// Only the preparatory poses of this set; `None` without any.
    pub fn only_preparatory(&self) -> Option<GoalSet> {
        let entries: Vec<Entry> = self.entries.iter().filter(|e| e.preparatory).cloned().collect();
        let pose = entries.first()?.pose;
        Some(GoalSet { pose, entries })
    }

    /// The poses to end a curve at.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Adds every free entry straight into the goal of `problem` whose length is `offset`
    /// plus a multiple of `step`, more than 0 and at most `longest`, all in metres. At most
    /// [`MOST_STRAIGHTS`] multiples are tried, whatever the settings.
    pub fn add_straights(
        &mut self,
        problem: &Problem,
        model: &CostModel,
        offset: f64,
        step: f64,
        longest: f64,
    ) {
        let lengths =
            (0..MOST_STRAIGHTS).map(|i| offset + f64::from(i) * step).filter(|l| *l > 0.0);
        for gear in problem.entry_gears() {
            for length in lengths.clone().take_while(|l| *l <= longest + 1e-9) {
                let entry = Segment::straight(gear.sign() * length);
                let outward = entry.reversed();
                if !problem.collision.segment_is_free(self.pose, outward) {
                    break;
                }
                let pose = outward.end(self.pose);
                self.entries.push(Entry::new(pose, vec![entry], false, &problem.vehicle, model));
            }
        }
    }

    /// Adds a preparatory pose from which `rest` leads to the goal without contact.
    pub fn add_preparatory(
        &mut self,
        pose: Pose,
        rest: Vec<Segment>,
        vehicle: &Vehicle,
        model: &CostModel,
    ) {
        self.entries.push(Entry::new(pose, rest, true, vehicle, model));
    }
}

/// Tries curves to a goal set; buffers are reused.
#[derive(Debug, Default)]
pub(super) struct AnalyticExpansion {
    words: Vec<Word>,
    /// Words not tried yet.
    candidates: BinaryHeap<Candidate>,
    /// Entries whose words were not asked for yet, the most promising last.
    waiting: Vec<Waiting>,
    /// What the last word that was not free touched.
    suspect: Option<Contact>,
}

/// A word by its number in `words`; ordered so that the heap pops the cheapest, of equals the
/// one to the first target, and of these the one that was found first.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    cost: f64,
    target: u32,
    word: u32,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_cost = other.cost.total_cmp(&self.cost);
        by_cost.then_with(|| (other.target, other.word).cmp(&(self.target, self.word)))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// An entry that no way costs less to than `bound`.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    bound: f64,
    target: u32,
}

/// A free way into a goal set: a curve, then the rest of an entry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Connection<'a> {
    /// Where the curve begins.
    pub from: Pose,
    /// The curve.
    pub word: Word,
    /// Where the curve ends and what follows.
    pub entry: &'a Entry,
    /// Its index in the goal set.
    pub entry_index: usize,
    /// Cost of curve and rest.
    pub cost: f64,
}

impl Connection<'_> {
    /// Curve and rest.
    pub fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        self.word.segments().iter().chain(&self.entry.rest).copied()
    }

    /// The curve as a tail; the entry must not be preparatory.
    pub fn tail(&self) -> AnalyticTail {
        let entry = self.entry.rest.first().map_or(0.0, |s| s.length);
        AnalyticTail { from: self.from, word: self.word, entry }
    }
}

impl AnalyticExpansion {
    /// The cheapest free way from the free pose `from` into `goal`, if it costs less than `bound`.
    pub fn connect<'a>(
        &mut self,
        from: Pose,
        goal: &'a GoalSet,
        bound: f64,
        problem: &Problem,
        model: &CostModel,
    ) -> Option<Connection<'a>> {
        self.words.clear();
        self.candidates.clear();
        self.waiting.clear();
        let curves = Curves::new(from, &problem.vehicle, model);
        for (target, entry) in (0..).zip(&goal.entries) {
            let bound = curves.bound(entry.pose) + entry.cost;
            self.waiting.push(Waiting { bound, target });
        }
        self.waiting.sort_unstable_by(|a, b| b.bound.total_cmp(&a.bound));
        loop {
            let cheapest = self.candidates.peek().map_or(bound, |c| c.cost);
            if let Some(w) = self.waiting.pop_if(|w| w.bound <= cheapest) {
                let e = &goal.entries[w.target as usize];
                let add = |cost| Some(cost + e.cost).filter(|total| *total < bound);
                self.add(&curves, e.pose, e.departure, w.target, add);
            } else {
                let c = self.candidates.pop()?;
                let word = self.words[c.word as usize];
                let world = &problem.collision;
                if world.segments_are_free_of(&mut self.suspect, from, word.segments()) {
                    let entry_index = c.target as usize;
                    let entry = &goal.entries[entry_index];
                    return Some(Connection { from, word, entry, entry_index, cost: c.cost });
                }
            }
        }
    }

    /// The cheapest free curve from the free pose `from`, where the car stands, to `to`, where the
    /// way goes on with `departure`, and its cost, which is less than `bound`.
    pub fn curve(
        &mut self,
        from: Pose,
        to: Pose,
        departure: DriveState,
        bound: f64,
        problem: &Problem,
        model: &CostModel,
    ) -> Option<(Word, f64)> {
        self.curve_after(DriveState::PARKED, from, to, departure, bound, problem, model)
    }

    /// [`AnalyticExpansion::curve`] for a car that comes to `from` with `arrival`.
    #[allow(clippy::too_many_arguments, reason = "two poses, two states, and what is to be kept")]
    pub fn curve_after(
        &mut self,
        arrival: DriveState,
        from: Pose,
        to: Pose,
        departure: DriveState,
        bound: f64,
        problem: &Problem,
        model: &CostModel,
    ) -> Option<(Word, f64)> {
        self.words.clear();
        self.candidates.clear();
        let mut curves = Curves::new(from, &problem.vehicle, model);
        curves.arrival = arrival;
        if curves.bound(to) >= bound {
            return None;
        }
        self.add(&curves, to, departure, 0, |cost| (cost < bound).then_some(cost));
        while let Some(c) = self.candidates.pop() {
            let word = self.words[c.word as usize];
            let world = &problem.collision;
            if world.segments_are_free_of(&mut self.suspect, from, word.segments()) {
                return Some((word, c.cost));
            }
        }
        None
    }

    /// Adds the words to one target as candidates, those that `cost` keeps.
    fn add(
        &mut self,
        curves: &Curves,
        to: Pose,
        departure: DriveState,
        target: u32,
        cost: impl Fn(f64) -> Option<f64>,
    ) {
        let first = self.words.len();
        reeds_shepp::words(curves.from, to, curves.radius, &mut self.words);
        let least = CostModel::shortest_motion(curves.vehicle);
        for (word, w) in (first as u32..).zip(&mut self.words[first..]) {
            if w.shortest_segment() < least
                && let Some(tidy) = w.without_shorter_than(least, curves.from, to)
            {
                *w = tidy;
            }
            let (mut curve, arrival) = curve_cost(w, curves.arrival, curves.vehicle, curves.model);
            if w.shortest_segment() < least {
                curve += TINY_MOTION * curves.model.gear_change;
            }
            if let Some(cost) = cost(curve + curves.model.change(arrival, departure)) {
                self.candidates.push(Candidate { cost, target, word });
            }
        }
    }
}

/// What the costs of all curves from one pose share.
struct Curves<'a> {
    from: Pose,
    /// How the car comes to `from`.
    arrival: DriveState,
    radius: f64,
    vehicle: &'a Vehicle,
    model: &'a CostModel,
}

impl<'a> Curves<'a> {
    fn new(from: Pose, vehicle: &'a Vehicle, model: &'a CostModel) -> Self {
        let (arrival, radius) = (DriveState::PARKED, vehicle.turning_radius());
        Self { from, arrival, radius, vehicle, model }
    }

    /// A cost that no curve to `to` goes below.
    fn bound(&self, to: Pose) -> f64 {
        /// Metres that rounding may cost a word.
        const ROUNDING: f64 = 1e-6;
        (self.from.distance(to) - ROUNDING) * self.model.forward.min(self.model.backward)
    }
}

/// Cost of a word, and gear and steering at its end.
fn curve_cost(
    word: &Word,
    mut state: DriveState,
    vehicle: &Vehicle,
    model: &CostModel,
) -> (f64, DriveState) {
    let mut total = 0.0;
    for s in word.segments() {
        let steer = vehicle.max_steer * sign_or_zero(s.curvature);
        let (cost, next) = model.segment(state, s.length, steer);
        total += cost;
        state = next;
    }
    (total, state)
}

/// −1, 0 or 1.
fn sign_or_zero(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

/// The least cost of any word from `from` into `goal`, ignoring obstacles.
pub(super) fn lower_bound(
    from: Pose,
    goal: &GoalSet,
    vehicle: &Vehicle,
    model: &CostModel,
    words: &mut Vec<Word>,
) -> f64 {
    let costs = goal
        .entries()
        .iter()
        .map(|e| e.cost + least_curve_cost(from, e.pose, vehicle, model, words));
    costs.fold(f64::INFINITY, f64::min)
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
    least_curve_cost_before(None, from, to, vehicle, model, words)
}

/// [`least_curve_cost`] where the way goes on in a gear.
pub(super) fn least_curve_cost_before(
    gear: Option<Gear>,
    from: Pose,
    to: Pose,
    vehicle: &Vehicle,
    model: &CostModel,
    words: &mut Vec<Word>,
) -> f64 {
    words.clear();
    reeds_shepp::words(from, to, vehicle.turning_radius(), words);
    // Straightening the wheels at the start is not charged: a lower bound for any state.
    let costs = words.iter().map(|w| {
        let steer =
            w.segments().first().map_or(0.0, |s| vehicle.max_steer * sign_or_zero(s.curvature));
        let (cost, arrival) = curve_cost(w, DriveState { gear: None, steer }, vehicle, model);
        cost + model.change(arrival, DriveState { gear, ..arrival })
    });
    costs.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planners::{HybridAStar, HybridAStarConfig};
    use crate::rng::{Stream, rng};
    use crate::world::generate::{GeneratorConfig, generate};
    use crate::world::{Level, ParkingType};
    use rand::RngExt;

    /// Every word to every entry, sorted by cost: the first free one.
    fn exhaustive(
        from: Pose,
        goal: &GoalSet,
        problem: &Problem,
        model: &CostModel,
    ) -> Option<(f64, usize, Word)> {
        let vehicle = &problem.vehicle;
        let mut all = Vec::new();
        for (i, entry) in goal.entries().iter().enumerate() {
            let mut words = Vec::new();
            reeds_shepp::words(from, entry.pose, vehicle.turning_radius(), &mut words);
            for word in words {
                let (cost, arrival) = curve_cost(&word, DriveState::PARKED, vehicle, model);
                all.push((cost + model.change(arrival, entry.departure) + entry.cost, i, word));
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let is_free = |word: &Word| problem.collision.segments_are_free(from, word.segments());
        all.into_iter().find(|(_, _, word)| is_free(word))
    }

    #[test]
    fn best_first_finds_what_trying_all_finds() {
        let (config, vehicle) = (GeneratorConfig::default(), crate::vehicle::Vehicle::default());
        let model = CostModel::default();
        let mut expansion = AnalyticExpansion::default();
        let mut rng = rng(4, Stream::Start, 0);
        let (mut found, mut none) = (0, 0);
        for index in 0..40 {
            for (kind, level) in ParkingType::ALL.into_iter().zip(Level::ALL) {
                let scene = generate(&config, &vehicle, kind, level, 77, index);
                let problem = Problem::new(&scene).unwrap();
                let mut goal = HybridAStar::new(HybridAStarConfig::default()).goal_set(&problem);
                // The same entry twice: of equal costs the first is taken.
                for entry in goal.entries.clone() {
                    goal.entries.insert(rng.random_range(0..=goal.entries.len()), entry);
                }
                for _ in 0..20 {
                    let mut r = |a: f64| rng.random_range(-a..a);
                    let (s, reach) = (problem.start, 2.0);
                    let from = Pose::new(s.x + r(reach), s.y + r(reach), s.heading + r(1.0));
                    let expected = exhaustive(from, &goal, &problem, &model);
                    let got = expansion.connect(from, &goal, f64::INFINITY, &problem, &model);
                    assert_eq!(got.map(|c| (c.cost, c.entry_index, c.word)), expected);
                    *(if expected.is_some() { &mut found } else { &mut none }) += 1;
                }
            }
        }
        assert!(found > 100 && none > 100, "{found} {none}");
    }
}
