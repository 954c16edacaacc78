//! The few manoeuvres that serve many samples.
//!
//! Condensing (P. E. Hart, "The condensed nearest neighbor rule", 1968): sample by sample,
//! from the tightest cells to the widest, the manoeuvre that ends its path is added to the
//! library, unless the library already has a plan for the sample that costs hardly more.
//! Then the samples are planned once more with the whole library, and what hardly any of
//! them uses is left out.

use crate::curves::{Segment, reeds_shepp};
use crate::dataset::{Metadata, Sample};
use crate::geometry::Pose;
use crate::planners::hybrid_astar::GoalSet;
use crate::planners::library::{Library, LibrarySearch};
use crate::planners::{HybridAStar, Problem};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// A plan that costs at most this much more than a sample's own serves it.
const TOLERANCE: f64 = 0.5;
/// A manoeuvre must serve this many samples to stay.
const LEAST_USES: usize = 2;
/// More samples than this find hardly any new manoeuvre; those of lowest index in their cells
/// are taken.
const MOST_SAMPLES: usize = 10_000;

/// Manoeuvres for spots of type `kind` from its `solved` samples, which are ordered by cell.
pub(super) fn condense(
    metadata: &Metadata,
    kind: ParkingType,
    solved: &[&Sample],
) -> Vec<Vec<Segment>> {
    let Metadata { vehicle, planner, .. } = metadata;
    let mut hars = HybridAStar::new(*planner);
    let mut search = LibrarySearch::default();
    let mut library = Library::new(&[], vehicle, vehicle.footprint(Problem::MARGIN), &planner.cost);
    let mut manoeuvres = Vec::new();
    let taken = spread(solved);
    for_each_problem(metadata, kind, &taken, |sample, problem| {
        let Some(manoeuvre) = manoeuvre(sample, problem) else { return };
        let goal = hars.goal_set(problem);
        let Some(own) = own_cost(&mut hars, &manoeuvre, problem) else { return };
        let bound = own + TOLERANCE;
        if search.plan(&library, problem, &goal, &planner.cost, bound).is_none() {
            library.add(manoeuvre.clone(), vehicle, &planner.cost);
            manoeuvres.push(manoeuvre);
        }
    });
    let mut uses = vec![0; manoeuvres.len()];
    for_each_problem(metadata, kind, &taken, |_, problem| {
        let goal = hars.goal_set(problem);
        let plan = search.plan(&library, problem, &goal, &planner.cost, f64::INFINITY);
        if let Some(used) = plan.and_then(|p| p.manoeuvre) {
            uses[used] += 1;
        }
    });
    let mut uses = uses.into_iter();
    manoeuvres.retain(|_| uses.next().is_some_and(|n| n >= LEAST_USES));
    manoeuvres
}

/// At most [`MOST_SAMPLES`]: the first ones of every cell, in order of cells.
fn spread<'a>(solved: &[&'a Sample]) -> Vec<&'a Sample> {
    let mut taken = solved.to_vec();
    taken.sort_by_key(|s| (s.sample_index, s.cell_index));
    taken.truncate(MOST_SAMPLES);
    taken.sort_by_key(|s| (s.cell_index, s.sample_index));
    taken
}

/// Calls `each` with every sample and its problem. Samples whose start or goal is nearer to
/// the walls than the planners' margin are left out.
fn for_each_problem(
    metadata: &Metadata,
    kind: ParkingType,
    samples: &[&Sample],
    mut each: impl FnMut(&Sample, &Problem),
) {
    let Metadata { vehicle, grid, .. } = metadata;
    let footprint = vehicle.footprint(Problem::MARGIN);
    let goal = grid.goal(kind, vehicle);
    for of_cell in samples.chunk_by(|a, b| a.cell_index == b.cell_index) {
        // The goal stands in as start.
        let Ok(mut problem) = Problem::in_cell(grid, &of_cell[0].cell, *vehicle, goal) else {
            continue;
        };
        if *problem.collision.footprint() != footprint {
            continue;
        }
        for sample in of_cell.iter().filter(|s| problem.collision.pose_is_free(s.start)) {
            problem.start = sample.start;
            each(sample, &problem);
        }
    }
}

/// How a sample's path ends: the stored manoeuvre, or else the curve and the entry straight.
fn manoeuvre(sample: &Sample, problem: &Problem) -> Option<Vec<Segment>> {
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

/// The least cost of a curve from the start to where `manoeuvre` begins, and of that.
fn own_cost(hars: &mut HybridAStar, manoeuvre: &[Segment], problem: &Problem) -> Option<f64> {
    let begin = manoeuvre.iter().rev().fold(problem.goal, |pose, s| s.reversed().end(pose));
    let (vehicle, cost) = (&problem.vehicle, &hars.config().cost);
    let mut goal = GoalSet::single(problem.goal);
    goal.add_preparatory(begin, manoeuvre.to_vec(), vehicle, cost);
    hars.direct(problem, problem.start, &goal.only_preparatory()?).map(|leg| leg.cost)
}
