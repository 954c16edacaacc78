//! One sample: a start pose drawn in a cell, solved by Hybrid A* with Reeds-Shepp expansion.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::config::CollectConfig;
use super::schema::{Sample, Status, to_step};
use crate::geometry::{Aabb, Pose, wrap_angle};
use crate::planners::{
    AnalyticTail, Budget, Effort, HybridAStar, NoPath, PlanResult, Planner, Problem,
};
use crate::rng::{Stream, rng};
use crate::world::ParkingType;
use crate::world::cell::{Cell, Grid};

/// A cell none of whose first samples is solved is given up: in most such cells the car
/// cannot park at all, and every further sample would spend its whole budget.
const PROBES: u32 = 4;

/// Draws per sample before the cell counts as having no free start.
const MAX_DRAWS: usize = 200;

/// Solves samples one after the other; keeps the planner's buffers and the cell's problem.
/// A sample depends on the settings and its own indices alone.
pub struct Sampler<'a> {
    config: &'a CollectConfig,
    planner: HybridAStar,
    current: Option<CellProblem>,
}

/// A cell, ready to be planned in.
struct CellProblem {
    cell: Cell,
    index: u32,
    /// `None` when the car does not fit the spot.
    problems: Option<CellProblems>,
    /// The first samples, once solved.
    probes: Vec<Sample>,
}

/// The cell, and the same with a longer lane behind, where starts may lie as well.
struct CellProblems {
    cell: Problem,
    with_lane_behind: Problem,
}

impl CellProblem {
    fn is_hopeless(&self) -> bool {
        self.probes.len() == PROBES as usize
            && self.probes.iter().all(|s| s.status != Status::Solved)
    }
}

impl<'a> Sampler<'a> {
    /// A sampler with `config`, which must be valid.
    pub fn new(config: &'a CollectConfig) -> Self {
        Self {
            config,
            planner: HybridAStar::hold(config.planner, config.solutions as usize),
            current: None,
        }
    }

    /// The sample `sample_index` of the cell `cell_index`.
    pub fn sample(&mut self, kind: ParkingType, cell_index: u32, sample_index: u32) -> Sample {
        let config = self.config;
        let known = self.current.take().filter(|c| c.index == cell_index && c.cell.kind() == kind);
        let mut here = known.unwrap_or_else(|| CellProblem::new(config, kind, cell_index));
        // The probes are solved whichever sample is asked for first, so that a sample does
        // not depend on that.
        for i in here.probes.len() as u32..PROBES.min(config.samples_per_cell) {
            let probe = self.solve(&mut here, i);
            here.probes.push(probe);
        }
        let sample = match here.probes.get(sample_index as usize) {
            Some(probe) => probe.clone(),
            None if here.is_hopeless() => {
                let nowhere = Pose::new(f64::NAN, f64::NAN, f64::NAN);
                let (cell, status) = (here.cell, Status::GivenUp);
                Sample::unsolved(cell, cell_index, sample_index, nowhere, status, config.seed)
            }
            None => self.solve(&mut here, sample_index),
        };
        self.current = Some(here);
        sample
    }

    fn solve(&mut self, here: &mut CellProblem, sample_index: u32) -> Sample {
        let config = self.config;
        let (kind, cell_index) = (here.cell.kind(), here.index);
        let unsolved = |start, status| {
            Sample::unsolved(here.cell, cell_index, sample_index, start, status, config.seed)
        };
        let nan = f64::NAN;
        let no_start = unsolved(Pose::new(nan, nan, nan), Status::NoStart);
        let Some(CellProblems { cell, with_lane_behind: problem }) = &mut here.problems else {
            return no_start;
        };
        let mut rng = rng(config.seed, Stream::Start, stream_index(kind, cell_index, sample_index));
        let lane = config.grid_with_lane_behind().lane(&here.cell);
        let Some(start) = (0..MAX_DRAWS)
            .map(|_| draw(&mut rng, &lane, config.start_heading_max))
            .find(|pose| problem.collision.pose_is_free(*pose))
        else {
            return no_start;
        };

        problem.start = start;
        let budget = Budget { max_expansions: config.max_expansions, effort: Effort::First };
        let result = self.planner.plan(problem, budget);
        let tail = result.outcome.as_ref().ok().and_then(|path| {
            let snap = |p: Pose| to_step(Pose { heading: wrap_angle(p.heading), ..p });
            self.planner.preparatory_tail(problem, cell, path, snap)
        });
        let mut row = fill(unsolved(start, Status::NoPath), &result, tail.as_ref()).rounded();
        if let Ok(path) = &result.outcome
            && result.expansions > 0
            && sample_index < config.manoeuvres_per_cell
        {
            row.manoeuvre = self.planner.manoeuvre(problem, path).unwrap_or_default();
            row = row.rounded();
        }
        row
    }
}

impl CellProblem {
    fn new(config: &CollectConfig, kind: ParkingType, index: u32) -> Self {
        let cell = config.grid.cell(kind, index as usize);
        // The goal stands in as start: with it, only a spot too narrow for the car fails.
        let goal = config.grid.goal(cell.stance, &config.vehicle);
        let problem = |grid: &Grid| Problem::in_cell(grid, &cell, config.vehicle, goal).ok();
        let (own, longer) = (problem(&config.grid), problem(&config.grid_with_lane_behind()));
        let problems =
            own.zip(longer).map(|(cell, with_lane_behind)| CellProblems { cell, with_lane_behind });
        Self { cell, index, problems, probes: Vec::new() }
    }
}

/// Different for every sample of a seed: an axis has at most 1001 values, so a cell index has
/// 30 bits.
fn stream_index(kind: ParkingType, cell_index: u32, sample_index: u32) -> u64 {
    let kind: u64 = match kind {
        ParkingType::Forward => 0,
        ParkingType::Parallel => 1,
        ParkingType::Reverse => 2,
        ParkingType::Angled => 3,
    };
    kind << 62 | u64::from(cell_index) << 32 | u64::from(sample_index)
}

/// A pose uniform over `lane`, its heading uniform in ± `heading_max` radians.
fn draw(rng: &mut ChaCha8Rng, lane: &Aabb, heading_max: f64) -> Pose {
    let mut between = |min: f64, max: f64| min + (max - min) * rng.random::<f64>();
    let x = between(lane.min.x, lane.max.x);
    let y = between(lane.min.y, lane.max.y);
    to_step(Pose::new(x, y, between(-heading_max, heading_max)))
}

/// `row` with what the planner found.
fn fill(mut row: Sample, result: &PlanResult, tail: Option<&AnalyticTail>) -> Sample {
    row.expansions = u32::try_from(result.expansions).unwrap_or(u32::MAX);
    let path = match &result.outcome {
        Ok(path) => path,
        Err(reason) => {
            let spent = *reason == NoPath::BudgetSpent;
            row.status = if spent { Status::BudgetSpent } else { Status::NoPath };
            return row;
        }
    };
    row.path_length = path.length();
    row.direction_changes = path.direction_changes() as u32;
    let Some(tail) = tail else {
        row.status = Status::NoCurve;
        return row;
    };
    row.status = Status::Solved;
    row.rs_start = tail.from;
    row.rs_word = tail.word.name();
    row.rs_lengths = [0.0; 5];
    for (length, segment) in row.rs_lengths.iter_mut().zip(tail.word.segments()) {
        *length = segment.length;
    }
    row.entry = tail.entry;
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::{Path, Segment};

    #[test]
    fn stream_indices_never_meet() {
        let mut all = Vec::new();
        for kind in ParkingType::ALL {
            for cell in [0, 1, 1001_u32.pow(3) - 1] {
                all.extend([0, 1, u32::MAX].map(|sample| stream_index(kind, cell, sample)));
            }
        }
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 36);
    }

    #[test]
    fn draws_stay_in_the_lane() {
        let lane = Aabb::new(-10.0, 2.75, 4.0, 6.75);
        let mut rng = rng(1, Stream::Start, 0);
        for _ in 0..1000 {
            let p = draw(&mut rng, &lane, 0.5);
            assert!(lane.contains(p.position()) && p.heading.abs() <= 0.5, "{p:?}");
        }
    }

    #[test]
    fn failures_keep_their_reason_and_paths_their_length() {
        let config = CollectConfig::default();
        let cell = config.grid.cell(ParkingType::Reverse, 0);
        let row = |result: PlanResult| {
            let start = Pose::new(0.0, 4.0, 0.0);
            let row = Sample::unsolved(cell, 0, 0, start, Status::NoPath, 1);
            fill(row, &result, None).rounded()
        };
        let spent = row(PlanResult::none(NoPath::BudgetSpent, 9));
        assert_eq!((spent.status, spent.expansions), (Status::BudgetSpent, 9));
        let enclosed = row(PlanResult::none(NoPath::Enclosed, 0));
        assert_eq!(enclosed.status, Status::NoPath);
        assert!(enclosed.path_length.is_nan() && !enclosed.rs_start.is_finite());

        let segments = [2.5, -1.0].map(Segment::straight);
        let path = Path::new(Pose::default(), segments);
        let solved = row(PlanResult {
            outcome: Ok(path),
            smooth: None,
            covered: None,
            expansions: 4,
            guidance: None,
        });
        assert_eq!((solved.path_length, solved.direction_changes), (3.5, 1));
        assert_eq!(solved.status, Status::NoCurve);
    }
}
