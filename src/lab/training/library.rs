//! The few manoeuvres that serve many samples.
//!
//! Condensing (P. E. Hart, "The condensed nearest neighbor rule", 1968): sample by sample,
//! from narrow lanes to wide ones, the manoeuvre that ends its path is added to the
//! library, unless the library already has a plan for the sample that costs hardly more.
//! Then the samples are planned once more with the whole library, and what hardly any of
//! them uses, or what is mostly tried in vain, is left out.

use crate::curves::{Path, Segment, reeds_shepp};
use crate::geometry::{Aabb, Pose};
use crate::lab::dataset::{Metadata, Sample};
use crate::planners::hybrid_astar::GoalSet;
use crate::planners::library::{Library, LibrarySearch, Verdicts};
use crate::planners::{HybridAStar, Problem};
use crate::selectors::fleet::scaled;
use crate::vehicle::Vehicle;
use crate::world::cell::Cell;
use crate::world::collision::BodyFrame;

/// A plan that costs at most this much more than a sample's own serves it.
const TOLERANCE: f64 = 0.5;
/// A manoeuvre must serve this many samples to stay.
const LEAST_USES: usize = 2;
/// A manoeuvre must serve one of this many samples that it was tried for: what looks good and
/// is not reached costs every plan time.
const MOST_TRIES_PER_USE: usize = 20;
/// More samples than this find hardly any new manoeuvre; those of lowest index in their cells
/// are taken.
const MOST_SAMPLES: usize = 10_000;

/// Solved samples of one vehicle and one way to stand parked, ordered by cell.
pub(super) struct Source<'a> {
    /// Of the data set they belong to.
    pub metadata: &'a Metadata,
    /// The samples.
    pub solved: &'a [&'a Sample],
    /// Metres per unit of length of the manoeuvres: 1, or the vehicle's turning radius where they
    /// are to serve other vehicles, too.
    pub unit: f64,
}

impl Source<'_> {
    /// The library of `manoeuvres` for this vehicle.
    pub fn library(&self, manoeuvres: &[Vec<Segment>]) -> Library {
        let Metadata { vehicle, planner, .. } = self.metadata;
        let own: Vec<_> = manoeuvres.iter().map(|m| scaled(m, self.unit)).collect();
        Library::new(
            &own,
            vehicle,
            vehicle.footprint(Problem::usual_margin(vehicle)),
            &planner.cost.scaled(vehicle.scale()),
        )
    }
}

/// Manoeuvres that serve all `sources`, in their units.
pub(super) fn condense(sources: &[Source]) -> Vec<Vec<Segment>> {
    let mut search = LibrarySearch::default();
    let mut manoeuvres = Vec::new();
    let mut verdicts_of = Vec::new();
    for source in sources {
        let Metadata { planner, manoeuvres_per_cell, .. } = source.metadata;
        let mut hars = HybridAStar::new(*planner);
        let mut library = source.library(&manoeuvres);
        let taken = spread(source.solved, *manoeuvres_per_cell);
        let mut cells = Vec::new();
        for_each_cell(source.metadata, &taken, |problem, samples| {
            let mut verdicts = Verdicts::default();
            for sample in samples {
                problem.start = sample.start;
                let Some((manoeuvre, cost)) = ending(&mut hars, source.metadata, sample, problem)
                else {
                    continue;
                };
                let bound = cost + TOLERANCE;
                let known = search.plan(&library, &mut verdicts, problem, &planner.cost, bound);
                if known.is_none() {
                    manoeuvres.push(scaled(&manoeuvre, 1.0 / source.unit));
                    library.add(manoeuvre, &planner.cost);
                }
            }
            cells.push(verdicts);
        });
        verdicts_of.push(cells);
    }
    let mut records = vec![Record::default(); manoeuvres.len()];
    for (source, cells) in sources.iter().zip(verdicts_of) {
        let Metadata { planner, manoeuvres_per_cell, .. } = source.metadata;
        let library = source.library(&manoeuvres);
        let taken = spread(source.solved, *manoeuvres_per_cell);
        let mut cells = cells.into_iter();
        for_each_cell(source.metadata, &taken, |problem, samples| {
            let mut verdicts = cells.next().expect("the same cells");
            for sample in samples {
                problem.start = sample.start;
                let any = f64::INFINITY;
                let plan = search.plan(&library, &mut verdicts, problem, &planner.cost, any);
                if let Some(plan) = plan {
                    records[plan.manoeuvre].uses += 1;
                    search.tried().for_each(|i| records[i].tries += 1);
                }
            }
        });
    }
    let mut records = records.into_iter();
    manoeuvres.retain(|_| records.next().is_some_and(|r| r.is_worth_it()));
    manoeuvres
}

/// How a manoeuvre of the whole library fared.
#[derive(Clone, Copy, Default)]
struct Record {
    /// Samples planned with it.
    uses: usize,
    /// Samples where it was free and a curve to it was looked for.
    tries: usize,
}

impl Record {
    fn is_worth_it(self) -> bool {
        self.uses >= LEAST_USES && self.uses * MOST_TRIES_PER_USE >= self.tries
    }
}

/// At most [`MOST_SAMPLES`] of those that may have a manoeuvre, the first `per_cell` ones of every
/// cell; in order of cells.
fn spread<'a>(solved: &[&'a Sample], per_cell: u32) -> Vec<&'a Sample> {
    let kept = solved.iter().filter(|s| s.sample_index < per_cell);
    let mut taken: Vec<&Sample> = kept.copied().collect();
    taken.sort_by_key(|s| (s.sample_index, s.cell_index));
    taken.truncate(MOST_SAMPLES);
    taken.sort_by_key(|s| (s.cell_index, s.sample_index));
    taken
}

/// Calls `each` with the problem of every cell and its samples. Those whose start or goal is
/// nearer to the walls than the planners' margin are left out.
fn for_each_cell(
    metadata: &Metadata,
    samples: &[&Sample],
    mut each: impl FnMut(&mut Problem, &[&Sample]),
) {
    let Metadata { vehicle, grid, .. } = metadata;
    let footprint = vehicle.footprint(Problem::usual_margin(vehicle));
    let goal = |cell: &Cell| grid.goal(cell.stance, vehicle);
    let longer = grid.with_lane_behind(metadata.start_behind);
    for of_cell in samples.chunk_by(|a, b| a.cell_index == b.cell_index) {
        let cell = &of_cell[0].cell;
        // The goal stands in as start.
        let Ok(mut problem) = Problem::in_cell(&longer, cell, *vehicle, goal(cell)) else {
            continue;
        };
        if *problem.collision.footprint() != footprint {
            continue;
        }
        let is_free = |s: &&&Sample| problem.collision.pose_is_free(s.start);
        let samples: Vec<&Sample> = of_cell.iter().filter(is_free).copied().collect();
        each(&mut problem, &samples);
    }
}

/// How a sample's path ends, from outside the spot on, and the cost of the whole path.
fn ending(
    hars: &mut HybridAStar,
    metadata: &Metadata,
    sample: &Sample,
    problem: &Problem,
) -> Option<(Vec<Segment>, f64)> {
    let (vehicle, model) = (&problem.vehicle, hars.cost(&problem.vehicle));
    let known = known_ending(sample, problem)?;
    let begin = known.iter().rev().fold(problem.goal, |pose, s| s.reversed().end(pose));
    let mut goal = GoalSet::single(problem.goal);
    goal.add_preparatory(begin, known.clone(), vehicle, &model);
    let leg = hars.direct(problem, problem.start, &goal.only_preparatory()?)?;
    let known_length = known.iter().map(|s| s.length.abs()).sum::<f64>() - 1e-6;
    let boundary = metadata.grid.lane_boundary(sample.cell.stance);
    let footprint = problem.collision.footprint();
    Some((outside(&leg.path, known_length, boundary, footprint), leg.cost))
}

/// The end of `path` that is at least `length` metres long and begins where the car stands
/// clear of the spot's row: what happens within the spot is part of the manoeuvre, and the curve
/// that joins it stays in the lane.
fn outside(path: &Path, length: f64, boundary: f64, footprint: &Aabb) -> Vec<Segment> {
    /// Distance between the poses looked at, metres.
    const STEP: f64 = 0.1;
    let is_outside = |pose: Pose| {
        let body = BodyFrame::new(pose);
        footprint.corners().into_iter().all(|c| body.parent(c).y >= boundary)
    };
    let mut driven = 0.0;
    let mut ending = Vec::new();
    let legs: Vec<(Pose, Segment)> = path.legs().collect();
    for (begin, segment) in legs.into_iter().rev() {
        let whole = segment.length.abs();
        let steps = (whole / STEP).ceil().max(1.0) as usize;
        for i in (0..steps).rev() {
            let cut = segment.length * i as f64 / steps as f64;
            let rest = Segment { length: segment.length - cut, ..segment };
            if driven + rest.length.abs() >= length && is_outside(segment.at(begin, cut)) {
                ending.push(rest);
                ending.reverse();
                return ending;
            }
        }
        driven += whole;
        ending.push(segment);
    }
    ending.reverse();
    ending
}

/// The motions that a sample keeps of its path's end: the stored manoeuvre, or else the curve
/// and the entry straight.
fn known_ending(sample: &Sample, problem: &Problem) -> Option<Vec<Segment>> {
    if !sample.manoeuvre.is_empty() {
        return Some(sample.manoeuvre.clone());
    }
    let Problem { vehicle, goal, .. } = problem;
    let entry = Segment::straight(sample.entry);
    let word = stored_word(sample, entry.reversed().end(*goal), vehicle)?;
    let entry = (entry.length != 0.0).then_some(entry);
    Some(word.segments().iter().copied().chain(entry).collect())
}

/// The curve of a sample, exact: the stored lengths are rounded.
fn stored_word(sample: &Sample, to: Pose, vehicle: &Vehicle) -> Option<reeds_shepp::Word> {
    let mut words = Vec::new();
    reeds_shepp::words(sample.rs_start, to, vehicle.turning_radius(), &mut words);
    let difference = |w: &reeds_shepp::Word| -> f64 {
        w.segments().iter().zip(sample.rs_lengths).map(|(s, l)| (s.length - l).abs()).sum()
    };
    words.retain(|w| w.name() == sample.rs_word && !w.segments().is_empty());
    words.into_iter().min_by(|a, b| difference(a).total_cmp(&difference(b)))
}
