//! One episode: one method on one scene, timed, checked and told.

pub mod clearance;
pub mod comparison;
mod row;
mod spot_report;

pub use clearance::{Clearance, WAY_ENDS, measured};
pub use comparison::{CHANGE_M, FLOOR_M, fill};
pub use row::Row;
pub use spot_report::{SpotReport, abstraction, regions};

use std::time::Instant;

use crate::output::PathFile;
use crate::planners::goals::{self, PassedOver, Planned, Terms};
use crate::planners::{Budget, PARKED_COVER, PlanResult, Planner, Problem, ProblemError};
use crate::world::{Level, ParkingType, Scene};

/// A scene to evaluate, and how it is labelled.
#[derive(Clone, Debug)]
pub struct Case {
    /// The scene; its name is unique in a run.
    pub scene: Scene,
    /// Parking type, where known.
    pub kind: Option<ParkingType>,
    /// Difficulty, for generated scenes.
    pub level: Option<Level>,
    /// Which of a run's sets of scenes it belongs to: `home`, `lots`, or the name of a folder;
    /// empty where there is only one.
    pub set: String,
}

/// How episodes are run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpisodeConfig {
    /// How much work a plan may take.
    pub budget: Budget,
    /// What plans keep to.
    pub terms: Terms,
    /// At most so many timed runs after the first.
    pub repeats: usize,
    /// No further run begins once the runs so far took this long together, seconds.
    pub repeat_within_s: f64,
}

impl EpisodeConfig {
    /// The usual timing and terms with `budget`.
    pub fn new(budget: Budget) -> Self {
        Self { budget, terms: Terms::default(), repeats: 5, repeat_within_s: 0.05 }
    }
}

/// Who looks at a path after its planner.
pub struct Judge {
    /// What it says of a path that it accepts: [`Row::checked`].
    pub verdict: &'static str,
    /// How near the path comes to obstacles, or why it refuses it. The other
    /// arguments: the share of the parked footprint that must be covered, where a path need not end
    /// exactly at the goal, and how deep start and goal may reach into obstacles, metres.
    pub check: fn(&Scene, &PathFile, Option<f64>, f64) -> Result<Clearance, String>,
}

/// Nobody: the path has passed the exact swept check of [`PlanResult::certified`], and is measured.
pub const CERTIFICATE: Judge =
    Judge { verdict: "certified", check: |scene, path, _, _| Ok(clearance::of(scene, path)) };

/// What an episode leaves.
#[derive(Clone, Debug)]
pub struct Episode {
    /// The row.
    pub row: Row,
    /// Which of the scene's goals the path leads to.
    pub goal_index: usize,
    /// Goals that the path could not lead to, and why.
    pub passed_over: Vec<(usize, PassedOver)>,
    /// The problem of that goal as the planner saw it.
    pub problem: Problem,
    /// What the planner returned.
    pub result: PlanResult,
    /// The path in the scene's frame, if there is one.
    pub path: Option<PathFile>,
}

/// The reason in rows whose path the independent check refuses.
pub const REJECTED: &str = "rejected by the independent check";
/// The reason in rows of planners that do not repeat their own result.
pub const UNREPEATABLE: &str = "two runs gave different results";

/// Runs `planner` on `case`, checks its path and makes the row.
///
/// A run is timed from the scene's obstacles in hand to the certified path. The first run
/// warms caches up: where it is cheap it is thrown away, and the time is the median of
/// the runs after it. A first run beyond `repeat_within_s` counts itself.
pub fn run(
    case: &Case,
    planner: &mut dyn Planner,
    config: &EpisodeConfig,
    judge: &Judge,
) -> Result<Episode, ProblemError> {
    let (planned, first_s) = timed(&case.scene, planner, config)?;
    let Planned { goal_index, problem, result, passed_over } = planned;
    let mut times = Vec::new();
    let mut total_s = first_s;
    let mut repeatable = true;
    while total_s < config.repeat_within_s && times.len() < config.repeats {
        let (Planned { result: again, .. }, seconds) = timed(&case.scene, planner, config)?;
        repeatable &= again.outcome == result.outcome && again.expansions == result.expansions;
        times.push(seconds);
        total_s += seconds;
    }
    if times.is_empty() {
        times.push(first_s);
    }
    times.sort_unstable_by(f64::total_cmp);
    let mut row = blank_row(case, planner.name(), times[times.len() / 2]);
    let path = describe(case, goal_index, &problem, &result, (config, judge), &mut row);
    if !repeatable {
        row.ok = false;
        row.reason = UNREPEATABLE.to_owned();
    }
    Ok(Episode { row, goal_index, passed_over, problem, result, path })
}

fn timed(
    scene: &Scene,
    planner: &mut dyn Planner,
    config: &EpisodeConfig,
) -> Result<(Planned, f64), ProblemError> {
    let start = Instant::now();
    let planned = goals::plan(planner, scene, config.terms, config.budget)?;
    Ok((planned, start.elapsed().as_secs_f64()))
}

fn blank_row(case: &Case, method: &str, plan_time_s: f64) -> Row {
    Row {
        scene: case.scene.name.clone(),
        kind: case.kind,
        level: case.level,
        method: method.to_owned(),
        ok: false,
        reason: String::new(),
        plan_time_s,
        length_m: None,
        direction_changes: None,
        max_abs_steer_rad: None,
        mean_abs_steer_change_rad: None,
        nodes: 0,
        min_clearance_m: None,
        fallback: false,
        checked: String::new(),
        route: String::new(),
        cost_over_best: None,
        changes_over_fewest: None,
        way_clearance_m: None,
        set: case.set.clone(),
    }
}

/// Fills `row` from the result; returns the exported path, if any.
fn describe(
    case: &Case,
    goal_index: usize,
    problem: &Problem,
    result: &PlanResult,
    (config, judge): (&EpisodeConfig, &Judge),
    row: &mut Row,
) -> Option<PathFile> {
    row.nodes = result.expansions as u32;
    if let Some(guidance) = &result.guidance {
        row.fallback = guidance.route.is_fallback();
        row.route = guidance.route.name().to_owned();
    }
    let path = match &result.outcome {
        Ok(path) => path,
        Err(reason) => {
            row.reason = reason.to_string();
            return None;
        }
    };
    let vehicle = &problem.vehicle;
    row.length_m = Some(path.length());
    row.direction_changes = Some(path.direction_changes() as u32);
    row.max_abs_steer_rad = Some(vehicle.steer(path.max_abs_curvature()));
    row.mean_abs_steer_change_rad = Some(path.mean_abs_steer_change(vehicle));
    // Checked against the goal that it claims to lead to.
    let scene = case.scene.with_goal(case.scene.all_goals()[goal_index]);
    let driven = result.driven()?;
    let file = PathFile::of_smooth(&scene, &problem.frame, &driven, &row.method);
    let share = result.covered.map(|_| PARKED_COVER);
    match (judge.check)(&scene, &file, share, config.terms.contact) {
        Ok(clearance) => {
            row.ok = true;
            row.min_clearance_m = Some(clearance.least).filter(|c| c.is_finite());
            row.way_clearance_m = clearance.on_the_way.filter(|c| c.is_finite());
            row.checked = judge.verdict.to_owned();
        }
        Err(violation) => {
            row.reason = REJECTED.to_owned();
            row.checked = violation;
        }
    }
    Some(file)
}
