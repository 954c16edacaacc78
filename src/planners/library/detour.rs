//! Manoeuvres that are joined by way of another pose.
//!
//! Where no curve from the start joins a free manoeuvre, or only a dear one, the car first drives a motion of
//! constant steering, or one each way, to a pose from which a curve does: out of a corner of the lane, or
//! wide before a turn. All pairs of such a pose and a manoeuvre are valued like manoeuvres are for a start, and
//! tried in that order.

use std::cmp::Reverse;

use super::{Candidate, LibraryPlan, LookUp};
use crate::curves::reeds_shepp::Word;
use crate::curves::{Path, Segment};
use crate::geometry::Pose;
use crate::planners::approach::Poses;
use crate::planners::cost::DriveState;
use crate::vehicle::Gear;

/// Steering of the motions, as shares of full lock.
const STEERING: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];
/// Poses lie so far apart along a motion, in turning radii, so many at most, and no motion turns by more
/// (radians).
const STEP: f64 = 0.4;
const STEPS: u32 = 8;
const TURN: f64 = 1.6;
/// A curve may cost so many changes of gear more than estimated.
const WINDOW: f64 = 4.0 / 3.0;

/// How far a detour is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// Motions before the curve, at most; the fewest with which there is a plan are taken.
    pub motions: usize,
    /// Free manoeuvres to join, at most.
    pub manoeuvres: usize,
    /// Curves tried for each number of motions, at most.
    pub tries: usize,
}

/// Poses that the start leads to; buffers are reused.
#[derive(Debug, Default)]
pub(super) struct Detours {
    ways: Vec<Way>,
    /// What it is estimated to cost to go on from a pose by each manoeuvre.
    costs: Vec<f32>,
    /// The most promising pairs, the best first.
    pairs: Vec<Pair>,
}

/// A motion that leads to a pose.
#[derive(Clone, Copy, Debug)]
struct Way {
    to: Pose,
    /// Cost from the start.
    cost: f64,
    arrival: DriveState,
    motion: Segment,
    /// The way that leads to where the motion begins, if that is not the start.
    from: Option<usize>,
    /// Whether the motion goes as far as it may.
    is_whole: bool,
}

/// A way and a manoeuvre by their numbers, ordered by what they are estimated to cost together: floats that
/// are not negative are ordered like their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    estimate: u32,
    way: u32,
    manoeuvre: u32,
}

/// What was found: the last way, the manoeuvre, the curve between them, and the cost of all.
type Found = (usize, Candidate, Word, f64);

impl LookUp<'_> {
    /// The cheapest plan by way of another pose, if it costs less than `bound`.
    pub fn by_way(&mut self, bound: f64, reach: Reach) -> Option<LibraryPlan> {
        self.find_free(reach.manoeuvres);
        let free = std::mem::take(&mut self.search.free);
        let mut detours = std::mem::take(&mut self.search.detours);
        let found = self.detour(&mut detours, &free, bound, reach);
        let plan = found.map(|(last, candidate, word, cost)| {
            let LibraryPlan { path, manoeuvre, preparatory, .. } = self.plan(candidate, word, cost);
            let before = detours.motions_to(last).into_iter().chain(path.segments);
            LibraryPlan {
                path: Path::new(self.problem.start, before),
                cost,
                manoeuvre,
                preparatory,
            }
        });
        (self.search.free, self.search.detours) = (free, detours);
        plan
    }

    /// Checks more manoeuvres in order of their estimates until so many are free.
    fn find_free(&mut self, count: usize) {
        self.queue();
        while self.search.free.len() < count
            && let Some(Reverse(candidate)) = self.search.queue.pop()
        {
            if self.is_free(candidate) {
                self.search.free.push(candidate);
            }
        }
    }

    fn detour(
        &mut self,
        detours: &mut Detours,
        free: &[Candidate],
        mut bound: f64,
        reach: Reach,
    ) -> Option<Found> {
        let mut begins = Poses::default();
        for candidate in free {
            let entry = &self.library.manoeuvres[candidate.index()].entry;
            begins.push(entry.pose, entry.cost(), entry.departure().gear);
        }
        detours.ways.clear();
        let mut found = None;
        let mut first = 0;
        for motions in 0..reach.motions {
            let known = detours.ways.len();
            if motions == 0 {
                self.drive_on(&mut detours.ways, None, bound);
            } else {
                (first..known).for_each(|way| self.drive_on(&mut detours.ways, Some(way), bound));
            }
            first = known;
            self.pair(detours, first, &begins, bound, reach.tries);
            for &pair in &detours.pairs {
                let estimate = f64::from(f32::from_bits(pair.estimate));
                if estimate >= bound {
                    break;
                }
                let within = bound.min(estimate + WINDOW * self.model.gear_change);
                let way = detours.ways[pair.way as usize];
                let candidate = free[pair.manoeuvre as usize];
                if let Some((word, cost)) = self.joint_after(way, candidate, within) {
                    bound = cost;
                    found = Some((pair.way as usize, candidate, word, cost));
                }
            }
            if found.is_some() {
                break;
            }
        }
        found
    }

    /// The most promising pairs of the ways from number `first` on and all manoeuvres, in that order.
    fn pair(
        &mut self,
        detours: &mut Detours,
        first: usize,
        begins: &Poses,
        bound: f64,
        most: usize,
    ) {
        let Detours { ways, costs, pairs } = detours;
        pairs.clear();
        for (number, way) in (0..).zip(ways.iter()).skip(first) {
            let seen = way.to.relative(self.end);
            let vehicle = &self.problem.vehicle;
            self.search.approaches.costs(begins, seen, vehicle, self.model, costs);
            for (manoeuvre, cost) in (0..).zip(&*costs) {
                let estimate = way.cost as f32 + cost;
                if f64::from(estimate) < bound {
                    let estimate = estimate.to_bits();
                    pairs.push(Pair { estimate, way: number, manoeuvre });
                }
            }
        }
        if pairs.len() > most {
            pairs.select_nth_unstable(most);
            pairs.truncate(most);
        }
        pairs.sort_unstable();
    }

    /// The free curve from the end of a way that joins a free manoeuvre at the least cost, and what all that
    /// costs, if it is less than `bound`.
    fn joint_after(&mut self, way: Way, candidate: Candidate, bound: f64) -> Option<(Word, f64)> {
        let entry = &self.library.manoeuvres[candidate.index()].entry;
        let known = way.cost + entry.cost();
        let (word, cost) = self.search.analytic.curve_after(
            way.arrival,
            way.to,
            self.end.compose(entry.pose),
            entry.departure(),
            bound - known,
            self.problem,
            self.model,
        )?;
        Some((word, known + cost))
    }

    /// Adds the poses along the free motions from the start, or from the end of a whole motion the other
    /// way.
    fn drive_on(&self, ways: &mut Vec<Way>, from: Option<usize>, bound: f64) {
        let problem = self.problem;
        let before = from.map(|number| ways[number]);
        if before.is_some_and(|before| !before.is_whole) {
            return;
        }
        let (pose, cost, arrival) = before
            .map_or((problem.start, 0.0, DriveState::PARKED), |way| {
                (way.to, way.cost, way.arrival)
            });
        let vehicle = &problem.vehicle;
        let step = STEP * vehicle.turning_radius();
        let gears = [Gear::Forward, Gear::Backward].into_iter();
        for gear in gears.filter(|gear| arrival.gear != Some(*gear)) {
            for steering in STEERING {
                let curvature = steering * vehicle.max_curvature();
                let piece = Segment { length: gear.sign() * step, curvature };
                let known = ways.len();
                let mut to = pose;
                for steps in 1..=STEPS {
                    let length = piece.length * f64::from(steps);
                    let (driven, after) =
                        self.model.segment(arrival, length, vehicle.steer(curvature));
                    let cost = cost + driven;
                    if (length * curvature).abs() > TURN
                        || cost >= bound
                        || !problem.collision.segment_is_free(to, piece)
                    {
                        break;
                    }
                    to = piece.end(to);
                    let motion = Segment { length, curvature };
                    ways.push(Way { to, cost, arrival: after, motion, from, is_whole: false });
                }
                if let Some(last) = ways[known..].last_mut() {
                    last.is_whole = true;
                }
            }
        }
    }
}

impl Detours {
    /// The motions from the start to the end of a way.
    fn motions_to(&self, last: usize) -> Vec<Segment> {
        let ways = std::iter::successors(Some(last), |way| self.ways[*way].from);
        let mut motions: Vec<Segment> = ways.map(|way| self.ways[way].motion).collect();
        motions.reverse();
        motions
    }
}
