//! A library of known manoeuvres into a spot, and the best of them for a start.
//!
//! What is hard about parking happens near the spot, and the same few hundred ways of doing
//! it serve nearly every scene. So instead of searching, one of them is looked up: each is
//! valued by its own cost plus an estimate of the cost of getting to where it begins, the
//! most promising are checked first, exactly, against the obstacles of the scene, and the
//! first that is free and reached by a free Reeds-Shepp curve is the plan. Ours; the paper
//! has one preparatory pose instead.
//!
//! Where the manoeuvres come from: `lab::training::library`.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::OnceLock;

use crate::curves::reeds_shepp::Word;
use crate::curves::{Path, Segment};
use crate::geometry::{Aabb, Pose};
use crate::vehicle::Vehicle;
use crate::world::collision::{BodyFrame, Contact, Sweep};

use self::detour::Detours;
pub use self::detour::Reach;
use self::rest::Passages;
use super::Problem;
use super::analytic::{AnalyticExpansion, Entry};
use super::approach::{Approaches, Poses};
use super::cost::CostModel;

mod detour;
mod rest;
#[cfg(test)]
mod tests;

/// Free manoeuvres tried for something cheaper than a plan, and by which share at least.
const BETTER: usize = 10;
const GAIN: f64 = 0.03;
/// Manoeuvres begin beside the start within so many turning radii.
const BEGIN_BESIDE: f64 = 0.6;
/// Manoeuvres prepared for one footprint and one cost model.
#[derive(Clone, Debug)]
pub struct Library {
    vehicle: Vehicle,
    footprint: Aabb,
    manoeuvres: Vec<Manoeuvre>,
    /// Where they begin, seen from the goal, and their costs: all that ranking looks at.
    begins: Poses,
    /// Where they pass, found out once somebody asks.
    passages: OnceLock<Passages>,
}

/// A known way to the goal; poses are seen from the goal.
#[derive(Clone, Debug)]
struct Manoeuvre {
    /// Where it begins, and the motions from there.
    entry: Entry,
    /// Where its motions begin, in driving order, and the goal.
    begins: Vec<Pose>,
    /// What its motions sweep when driven back from the goal, the longest first: it touches
    /// something most often. A verdict presumes that the motion begins free of contact; where it
    /// does not, that of another motion is the right one.
    motions: Vec<(BodyFrame, Sweep)>,
}

impl Library {
    /// Prepares `manoeuvres`, each the motions that lead to the goal in driving order, for
    /// `vehicle` with the `footprint` (margin included) that its problems have.
    pub fn new(
        manoeuvres: &[Vec<Segment>],
        vehicle: &Vehicle,
        footprint: Aabb,
        model: &CostModel,
    ) -> Self {
        let (all, begins, passages) = Default::default();
        let mut library = Self { vehicle: *vehicle, footprint, manoeuvres: all, begins, passages };
        for segments in manoeuvres {
            library.add(segments.clone(), model);
        }
        library
    }

    /// Adds one more.
    ///
    /// What turns a little tighter than the vehicle can is driven at full lock: a manoeuvre begins
    /// wherever its motions lead back to from the goal.
    pub fn add(&mut self, mut segments: Vec<Segment>, model: &CostModel) {
        // For the same reason what is too short to be worth driving is left out.
        let least = CostModel::shortest_motion(&self.vehicle);
        segments.retain(|s| s.length.abs() >= least);
        let limit = self.vehicle.max_curvature();
        for s in &mut segments {
            s.curvature = s.curvature.clamp(-limit, limit);
        }
        let mut pose = Pose::default();
        let (mut motions, mut begins) = (Vec::new(), vec![pose]);
        for back in segments.iter().rev().map(|s| s.reversed()) {
            motions.push((BodyFrame::new(pose), Sweep::new(&self.footprint, back)));
            pose = back.end(pose);
            begins.push(pose);
        }
        begins.reverse();
        let length = |(_, sweep): &(BodyFrame, Sweep)| sweep.segment().length.abs();
        motions.sort_by(|a, b| length(b).total_cmp(&length(a)));
        let entry = Entry::new(pose, segments, true, &self.vehicle, model);
        self.begins.push(entry.pose, entry.cost(), entry.departure().gear);
        self.manoeuvres.push(Manoeuvre { entry, begins, motions });
        self.passages.take();
    }

    /// Whether it was prepared for the vehicle and the footprint of `problem`.
    pub fn fits(&self, problem: &Problem) -> bool {
        self.vehicle == problem.vehicle && self.footprint == *problem.collision.footprint()
    }

    /// The manoeuvres, each with its cost when begun in its gear with its steering.
    pub fn manoeuvres(&self) -> impl Iterator<Item = (&[Segment], f64)> {
        self.manoeuvres.iter().map(|m| (m.entry.rest.as_slice(), m.entry.cost()))
    }

    /// Number of manoeuvres.
    pub fn len(&self) -> usize {
        self.manoeuvres.len()
    }

    /// Whether it knows nothing.
    pub fn is_empty(&self) -> bool {
        self.manoeuvres.is_empty()
    }
}

impl Manoeuvre {
    /// Whether driving it to the goal, which `base` is at, touches nothing; `suspect` is what the
    /// last one touched.
    fn is_free(&self, base: &BodyFrame, problem: &Problem, suspect: &mut Option<Contact>) -> bool {
        let world = &problem.collision;
        self.motions
            .iter()
            .all(|(at, sweep)| world.sweep_is_free_of(suspect, &base.compose(at), sweep))
    }
}

/// Which manoeuvres of a library are free in one environment when they end at one pose, as far as it
/// was asked: the same for every start there.
#[derive(Clone, Debug, Default)]
pub struct Verdicts {
    free: Vec<Option<bool>>,
    suspect: Option<Contact>,
}

impl Verdicts {
    /// For another environment; buffers stay.
    pub fn clear(&mut self) {
        self.free.clear();
        self.suspect = None;
    }

    fn is_free(&mut self, library: &Library, index: usize, problem: &Problem, end: Pose) -> bool {
        // The library may have grown.
        self.free.resize(library.len(), None);
        *self.free[index].get_or_insert_with(|| {
            let base = BodyFrame::new(end);
            library.manoeuvres[index].is_free(&base, problem, &mut self.suspect)
        })
    }
}

/// A plan found in a library.
#[derive(Clone, Debug, PartialEq)]
pub struct LibraryPlan {
    /// From the start to the goal.
    pub path: Path,
    /// Its cost.
    pub cost: f64,
    /// Index of the manoeuvre.
    pub manoeuvre: usize,
    /// Where the manoeuvre begins, and the curve from the start ends.
    pub preparatory: Pose,
}

/// A manoeuvre that was tried, in the problem's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// Where it begins.
    pub preparatory: Pose,
    /// Its motions from there, in driving order.
    pub motions: Vec<Segment>,
    /// What came of it.
    pub fate: Fate,
}

/// What came of a manoeuvre that was tried.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// It touches an obstacle.
    Touches,
    /// It is free, but no free curve joins it at a cost below that of what is known already.
    NotJoined,
    /// It is free and joined.
    Joined {
        /// The curve from the start to where the manoeuvre begins.
        curve: Vec<Segment>,
        /// The cost of both.
        cost: f64,
    },
}

/// Looks plans up; buffers and the table of estimates are reused.
#[derive(Debug, Default)]
pub struct LibrarySearch {
    /// What is not tried yet, once it is asked for in order.
    queue: BinaryHeap<Reverse<Candidate>>,
    /// The candidates that are free, in the order they were checked.
    free: Vec<Candidate>,
    /// What every manoeuvre is estimated to cost.
    estimates: Vec<f32>,
    approaches: Approaches,
    analytic: AnalyticExpansion,
    detours: Detours,
    /// What was tried, where somebody asked.
    trail: Option<Vec<Tried>>,
}

/// One problem being looked up.
pub struct LookUp<'a> {
    search: &'a mut LibrarySearch,
    library: &'a Library,
    verdicts: &'a mut Verdicts,
    problem: &'a Problem,
    /// Where the manoeuvres end.
    end: Pose,
    model: &'a CostModel,
    /// What is estimated to cost as much is not tried.
    bound: f64,
    is_queued: bool,
}

/// A manoeuvre and its estimated cost, ordered by cost, then by index: the bits of the cost above
/// those of the index. Floats that are not negative are ordered like their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate(u64);

impl Candidate {
    fn new(estimate: f32, index: usize) -> Self {
        Self(u64::from(estimate.to_bits()) << 32 | index as u64)
    }

    fn index(self) -> usize {
        (self.0 & u64::from(u32::MAX)) as usize
    }

    fn estimate(self) -> f64 {
        f64::from(f32::from_bits((self.0 >> 32) as u32))
    }

    /// The cost up to which a plan by this candidate is preferred to the next one's: one more
    /// change of gear and some steering than estimated. Two more for the straight into the spot:
    /// that is what a car near its goal needs for a correction.
    fn window(self, library: &Library, model: &CostModel) -> f64 {
        let is_straight = library.manoeuvres[self.index()].entry.rest.len() < 2;
        self.estimate() + if is_straight { 8.0 } else { 4.0 } / 3.0 * model.gear_change
    }
}

impl LibrarySearch {
    /// Ranks all manoeuvres by which a plan of `problem` may cost less than `bound`. The `verdicts`
    /// are those of its environment, or new.
    pub fn look_up<'a>(
        &'a mut self,
        library: &'a Library,
        verdicts: &'a mut Verdicts,
        problem: &'a Problem,
        model: &'a CostModel,
        bound: f64,
    ) -> LookUp<'a> {
        self.look_up_at(library, verdicts, problem, problem.goal, model, bound)
    }

    /// [`LibrarySearch::look_up`] of manoeuvres that end at another pose than the goal, such as one
    /// from which a straight leads to it. Plans end there, too.
    pub fn look_up_at<'a>(
        &'a mut self,
        library: &'a Library,
        verdicts: &'a mut Verdicts,
        problem: &'a Problem,
        end: Pose,
        model: &'a CostModel,
        bound: f64,
    ) -> LookUp<'a> {
        debug_assert!(library.fits(problem));
        let seen = problem.start.relative(end);
        let (begins, costs) = (&library.begins, &mut self.estimates);
        self.approaches.costs(begins, seen, &problem.vehicle, model, costs);
        self.free.clear();
        LookUp { search: self, library, verdicts, problem, end, model, bound, is_queued: false }
    }

    /// The first plan of `problem`, in order of estimated cost, that is free and costs less
    /// than `bound`; rather a long way round than none.
    pub fn plan(
        &mut self,
        library: &Library,
        verdicts: &mut Verdicts,
        problem: &Problem,
        model: &CostModel,
        bound: f64,
    ) -> Option<LibraryPlan> {
        let mut look_up = self.look_up(library, verdicts, problem, model, bound);
        look_up.next(bound, usize::MAX).or_else(|| look_up.long_way(bound, usize::MAX))
    }

    /// From now on keeps what is tried, for [`LibrarySearch::take_trail`].
    pub fn keep_trail(&mut self) {
        self.trail = Some(Vec::new());
    }

    /// What was tried since [`LibrarySearch::keep_trail`], in that order; nothing more is kept.
    pub fn take_trail(&mut self) -> Vec<Tried> {
        self.trail.take().unwrap_or_default()
    }

    /// The manoeuvres found free in the last call, in the order they were tried.
    pub fn tried(&self) -> impl Iterator<Item = usize> + '_ {
        self.free.iter().map(|c| c.index())
    }
}

impl LookUp<'_> {
    /// What every manoeuvre is estimated to cost, in their order.
    pub fn estimates(&self) -> &[f32] {
        &self.search.estimates
    }

    /// The cheapest plan by one of the manoeuvres `order`ed by promise, all but those estimated to cost
    /// more than what is found before, if it costs less than `bound`; the first that costs little `enough`.
    pub fn promising(&mut self, order: &[u32], mut bound: f64, enough: f64) -> Option<LibraryPlan> {
        let mut best = None;
        for index in order.iter().map(|index| *index as usize) {
            let candidate = Candidate::new(self.search.estimates[index], index);
            if candidate.estimate() < bound
                && self.is_free(candidate)
                && let Some((word, cost)) = self.joint(candidate, bound)
            {
                bound = cost;
                best = Some((candidate, word));
                if bound <= enough {
                    break;
                }
            }
        }
        best.map(|(candidate, word)| self.plan(candidate, word, bound))
    }

    /// What plans by the manoeuvres cost that are free and joined by a free curve, and no more than so many
    /// `times` the cheapest.
    pub fn costs_within(&mut self, times: f64) -> Vec<(usize, f64)> {
        self.queue();
        let (mut costs, mut bound) = (Vec::new(), f64::INFINITY);
        while let Some(Reverse(candidate)) = self.search.queue.pop() {
            if candidate.estimate() >= bound {
                break;
            }
            if self.is_free(candidate)
                && let Some((_, cost)) = self.joint(candidate, bound)
            {
                bound = bound.min(times * cost);
                costs.push((candidate.index(), cost));
            }
        }
        costs.retain(|(_, cost)| *cost < bound);
        costs
    }

    /// The least estimate of the first `count` manoeuvres and of the others, free or not.
    pub fn least_estimates(&self, count: usize) -> (f64, f64) {
        let (first, others) = self.search.estimates.split_at(count.min(self.library.len()));
        let least = |all: &[f32]| f64::from(all.iter().copied().fold(f32::INFINITY, f32::min));
        (least(first), least(others))
    }

    /// Puts what may be tried into order, unless that was done.
    fn queue(&mut self) {
        if std::mem::replace(&mut self.is_queued, true) {
            return;
        }
        let LibrarySearch { queue, estimates, .. } = &mut *self.search;
        let mut all = std::mem::take(queue).into_vec();
        all.clear();
        let within = estimates.iter().enumerate().filter(|(_, e)| f64::from(**e) < self.bound);
        all.extend(within.map(|(index, estimate)| Reverse(Candidate::new(*estimate, index))));
        *queue = BinaryHeap::from(all);
    }

    /// The next plan in order of estimated cost that is free, costs less than `bound` and little
    /// more than estimated. Gives up after `tries` free manoeuvres that cannot be joined like that;
    /// when called again it goes on from there.
    pub fn next(&mut self, bound: f64, tries: usize) -> Option<LibraryPlan> {
        self.queue();
        let last = self.search.free.len().saturating_add(tries);
        while self.search.free.len() < last {
            let &Reverse(candidate) = self.search.queue.peek()?;
            if candidate.estimate() >= bound {
                // So do all others.
                return None;
            }
            self.search.queue.pop();
            if self.is_free(candidate) {
                self.search.free.push(candidate);
                let window = candidate.window(self.library, self.model);
                let plan = self.join(candidate, bound.min(window));
                if plan.is_some() {
                    return plan;
                }
            }
        }
        None
    }

    /// The next plan, as [`LookUp::next`] finds it, or one that costs less where one of the next few costs
    /// clearly less, and so on; where the cost of some plan is `known`, one that costs clearly less.
    pub fn cheapest(
        &mut self,
        known: Option<f64>,
        bound: f64,
        tries: usize,
    ) -> Option<LibraryPlan> {
        let mut best = match known {
            Some(cost) => self.better(cost)?,
            None => self.next(bound, tries)?,
        };
        while let Some(better) = self.better(best.cost) {
            best = better;
        }
        Some(best)
    }

    /// The next plan that costs clearly less than one of this `cost`, if one of the next few does.
    fn better(&mut self, cost: f64) -> Option<LibraryPlan> {
        self.next(cost * (1.0 - GAIN), BETTER)
    }

    /// The cheapest plan by one of the manoeuvres that begin beside the start, if it costs less than `bound`:
    /// so near estimates are too coarse to choose by.
    pub fn cheapest_beside(&mut self, mut bound: f64) -> Option<LibraryPlan> {
        let near = BEGIN_BESIDE * self.problem.vehicle.turning_radius();
        let start = self.end.relative(self.problem.start);
        let mut best = None;
        for (index, manoeuvre) in self.library.manoeuvres.iter().enumerate() {
            let Entry { pose, .. } = manoeuvre.entry;
            if pose.distance(start) > near {
                continue;
            }
            let candidate = Candidate::new(self.search.estimates[index], index);
            if self.is_free(candidate)
                && let Some((word, cost)) = self.joint(candidate, bound)
            {
                bound = cost;
                best = Some((candidate, word));
            }
        }
        best.map(|(candidate, word)| self.plan(candidate, word, bound))
    }

    /// The cheapest plan by one of the next `tries` free manoeuvres, if it costs less than `bound`, however
    /// much more that is than estimated.
    pub fn cheapest_of(&mut self, mut bound: f64, tries: usize) -> Option<LibraryPlan> {
        self.queue();
        let last = self.search.free.len().saturating_add(tries);
        let mut best = None;
        while self.search.free.len() < last
            && let Some(&Reverse(candidate)) = self.search.queue.peek()
            && candidate.estimate() < bound
        {
            self.search.queue.pop();
            if self.is_free(candidate) {
                self.search.free.push(candidate);
                if let Some((word, cost)) = self.joint(candidate, bound) {
                    bound = cost;
                    best = Some((candidate, word));
                }
            }
        }
        best.map(|(candidate, word)| self.plan(candidate, word, bound))
    }

    /// The first plan by one of the first `tries` manoeuvres that [`LookUp::next`] found free, whose
    /// curve may be as long as `bound` allows. For when none of them could be joined otherwise.
    pub fn long_way(&mut self, bound: f64, tries: usize) -> Option<LibraryPlan> {
        let tries = tries.min(self.search.free.len());
        (0..tries).find_map(|i| {
            let candidate = self.search.free[i];
            if candidate.window(self.library, self.model) < bound {
                self.join(candidate, bound)
            } else {
                None
            }
        })
    }

    /// Whether driving a manoeuvre to its end touches nothing.
    fn is_free(&mut self, candidate: Candidate) -> bool {
        let index = candidate.index();
        let free = self.verdicts.is_free(self.library, index, self.problem, self.end);
        if !free {
            self.note(candidate, || Fate::Touches);
        }
        free
    }

    /// Tells what came of a manoeuvre, where somebody asked.
    fn note(&mut self, candidate: Candidate, fate: impl FnOnce() -> Fate) {
        let Some(trail) = &mut self.search.trail else { return };
        let entry = &self.library.manoeuvres[candidate.index()].entry;
        let preparatory = self.end.compose(entry.pose);
        trail.push(Tried { preparatory, motions: entry.rest.clone(), fate: fate() });
    }

    /// The plan through a free manoeuvre, if a free curve joins it within `bound`.
    fn join(&mut self, candidate: Candidate, bound: f64) -> Option<LibraryPlan> {
        let (word, cost) = self.joint(candidate, bound)?;
        Some(self.plan(candidate, word, cost))
    }

    /// The free curve that joins a free manoeuvre at the least cost, and what it costs with the manoeuvre, if that
    /// is less than `bound`.
    fn joint(&mut self, candidate: Candidate, bound: f64) -> Option<(Word, f64)> {
        let Self { library, problem, end, model, .. } = *self;
        let entry = &library.manoeuvres[candidate.index()].entry;
        let preparatory = end.compose(entry.pose);
        let (departure, bound) = (entry.departure(), bound - entry.cost());
        let joint = self
            .search
            .analytic
            .curve(problem.start, preparatory, departure, bound, problem, model)
            .map(|(word, cost)| (word, cost + entry.cost()));
        self.note(candidate, || match &joint {
            Some((word, cost)) => Fate::Joined { curve: word.segments().to_vec(), cost: *cost },
            None => Fate::NotJoined,
        });
        joint
    }

    /// The plan by a curve and the manoeuvre that it joins.
    fn plan(&self, candidate: Candidate, word: Word, cost: f64) -> LibraryPlan {
        let manoeuvre = candidate.index();
        let entry = &self.library.manoeuvres[manoeuvre].entry;
        let segments = word.segments().iter().chain(&entry.rest).copied();
        let path = Path::new(self.problem.start, segments);
        LibraryPlan { path, cost, manoeuvre, preparatory: self.end.compose(entry.pose) }
    }
}
