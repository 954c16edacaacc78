//! Plans a scene with any planner: to the cheapest of its goals, or within their tolerance.
//!
//! A scene is a list of candidates, each a [`Problem`] with one goal: every goal of the scene, and
//! where there is a tolerance also the poses that stand for it. Planners know nothing of each
//! other's goals. Costs are those of [`CostModel`]. What cannot become the
//! cheapest, because the shortest curve through empty space costs too much already, is not planned.
//! The order of the goals does not matter, but among equals the first is taken.

use super::contact;
use super::cost::CostModel;
use super::{Budget, NoPath, PlanResult, Planner, Problem, ProblemError};
use crate::curves::{Path, Segment, reeds_shepp};
use crate::geometry::Pose;
use crate::world::Scene;

/// What plans keep to besides reaching a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Clearance where start and goal allow it, metres: see [`Problem::with_margin`].
    pub margin: f64,
    /// How deep start and goal may reach into obstacles, metres: see [`Problem::allowing_contact`].
    pub contact: f64,
}

impl Default for Terms {
    /// The usual margin and no contact.
    fn default() -> Self {
        Self { margin: Problem::MARGIN, contact: 0.0 }
    }
}

/// A plan to one of a scene's goals, or why there is none to any.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Which of [`Scene::all_goals`]; without a path the one that was tried first.
    pub goal_index: usize,
    /// The problem of this goal.
    pub problem: Problem,
    /// What was found; expansions are those of all goals.
    pub result: PlanResult,
    /// Goals that cannot be parked at, and why, in the order of the scene.
    pub passed_over: Vec<(usize, PassedOver)>,
}

/// Why a goal was not taken, other than for its cost.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PassedOver {
    /// The car does not fit there.
    #[error("{0}")]
    NotFree(ProblemError),
    /// No path leads there.
    #[error("{0}")]
    NoPath(NoPath),
}

/// One goal of a scene.
struct Candidate {
    index: usize,
    /// The problem with exactly this goal, unless the car does not fit there.
    exact: Option<Problem>,
    /// The problems of poses within its tolerance, in a fixed order.
    beside: Vec<Problem>,
    /// What any path to any of them costs at least.
    bound: f64,
}

/// The problem by which a scene is introduced to those who need one before it is planned: that of its
/// first goal that is free. An error where there is none.
pub fn first_problem(scene: &Scene, terms: Terms) -> Result<Problem, ProblemError> {
    let mut errors = Vec::new();
    for (index, &goal) in scene.all_goals().iter().enumerate() {
        match candidate(scene, index, goal, terms, true)? {
            Ok(Candidate { exact, beside, .. }) => {
                return Ok(exact.into_iter().chain(beside).next().expect("a candidate has one"));
            }
            Err(error) => errors.push((index, error)),
        }
    }
    Err(none_free(scene, errors))
}

/// The error of a scene of whose goals none is free.
fn none_free(scene: &Scene, mut errors: Vec<(usize, ProblemError)>) -> ProblemError {
    if scene.goals.is_empty() {
        return errors.remove(0).1;
    }
    let field = |(i, error)| (scene.goal_field(i), error);
    ProblemError::NoGoalFree(errors.into_iter().map(field).collect())
}

/// The candidate of one goal, or why the car does not fit there. Other errors are the scene's.
/// With `one` no more problems than one are made.
fn candidate(
    scene: &Scene,
    index: usize,
    goal: Pose,
    terms: Terms,
    one: bool,
) -> Result<Result<Candidate, ProblemError>, ProblemError> {
    let to = |pose: Pose| {
        let single;
        // Most scenes have one goal and are not copied.
        let scene = if scene.goals.is_empty() && pose == scene.goal {
            scene
        } else {
            single = scene.with_goal(pose);
            &single
        };
        match Problem::allowing_contact(scene, terms.margin, terms.contact) {
            Ok(problem) => Ok(Ok(problem)),
            Err(error @ ProblemError::GoalInCollision(..)) => Ok(Err(error)),
            Err(error) => Err(error),
        }
    };
    let (exact, error) = match to(goal)? {
        Ok(problem) => (Some(problem), None),
        Err(error) => (None, Some(error)),
    };
    let mut beside = Vec::new();
    if let Some(tolerance) = scene.goal_tolerance {
        let mut poses = tolerance.poses(goal).split_off(1);
        // Who stands within the tolerance may stay there.
        if tolerance.holds(goal, scene.start, 0.0) && goal != scene.start {
            poses.insert(0, scene.start);
        }
        for pose in poses {
            if one && (exact.is_some() || !beside.is_empty()) {
                break;
            }
            if let Ok(mut problem) = to(pose)? {
                let centre = problem.frame.local_from_world(goal);
                problem.tolerance = Some((centre, tolerance));
                beside.push(problem);
            }
        }
    }
    Ok(match error {
        Some(error) if beside.is_empty() => Err(error),
        _ => {
            let bounds = exact.iter().chain(&beside).map(least_cost_near);
            let bound = bounds.fold(f64::INFINITY, f64::min);
            Ok(Candidate { index, exact, beside, bound })
        }
    })
}

/// What driving from start to goal costs at least, obstacles aside.
fn least_cost(problem: &Problem) -> f64 {
    let radius = 1.0 / problem.vehicle.max_curvature();
    let length = reeds_shepp::shortest_length(problem.start, problem.goal, radius);
    // A rounding less, so that equals are compared by what they cost.
    per_metre(problem) * length * (1.0 - 1e-9)
}

/// What driving from the start to the goal or anywhere within its tolerance costs at least.
fn least_cost_near(problem: &Problem) -> f64 {
    problem.tolerance.map_or_else(
        || least_cost(problem),
        |(goal, t)| per_metre(problem) * (problem.start.distance(goal) - t.position_m).max(0.0),
    )
}

fn per_metre(problem: &Problem) -> f64 {
    let model = model(problem);
    model.forward.min(model.backward)
}

fn model(problem: &Problem) -> CostModel {
    CostModel::default().scaled(problem.vehicle.scale())
}

fn cost(problem: &Problem, segments: &[Segment]) -> f64 {
    model(problem).path(&problem.vehicle, segments)
}

/// Plans `scene` by `planner` to the cheapest of its goals.
///
/// Every goal has the budget for itself, and where there is a tolerance once more for the poses
/// beside it. An error where the scene is none, its start is not free or none of its goals.
pub fn plan(
    planner: &mut dyn Planner,
    scene: &Scene,
    terms: Terms,
    budget: Budget,
) -> Result<Planned, ProblemError> {
    let mut candidates = Vec::new();
    let mut errors = Vec::new();
    for (index, &goal) in scene.all_goals().iter().enumerate() {
        match candidate(scene, index, goal, terms, false)? {
            Ok(candidate) => candidates.push(candidate),
            Err(error) => errors.push((index, error)),
        }
    }
    if candidates.is_empty() {
        return Err(none_free(scene, errors));
    }
    let not_free = |(index, error)| (index, PassedOver::NotFree(error));
    let mut passed_over: Vec<_> = errors.into_iter().map(not_free).collect();
    // The nearest first: what they cost leaves out most of the others. Sorting is stable.
    candidates.sort_by(|a, b| a.bound.total_cmp(&b.bound));
    let mut best: Option<Found> = None;
    let mut failed: Option<Found> = None;
    let mut expansions = 0;
    for candidate in candidates {
        let (index, bound) = (candidate.index, candidate.bound);
        if best.as_ref().is_some_and(|b| bound > b.cost) {
            break;
        }
        let found = plan_one(planner, candidate, budget);
        expansions += found.result.expansions;
        match &found.result.outcome {
            Ok(_) => {
                let better = |b: &Found| (found.cost, index) < (b.cost, b.index);
                if best.as_ref().is_none_or(better) {
                    best = Some(found);
                }
            }
            Err(reason) => {
                passed_over.push((index, PassedOver::NoPath(*reason)));
                failed = failed.or(Some(found));
            }
        }
    }
    passed_over.sort_by_key(|(index, _)| *index);
    let found = best.or(failed).expect("there is a candidate");
    let Found { index: goal_index, problem, result, .. } = found;
    let result = PlanResult { expansions, ..result };
    Ok(Planned { goal_index, problem, result, passed_over })
}

/// What came of one goal.
struct Found {
    index: usize,
    problem: Problem,
    result: PlanResult,
    cost: f64,
}

/// The cheapest path to a goal, exactly there or within its tolerance.
fn plan_one(planner: &mut dyn Planner, candidate: Candidate, budget: Budget) -> Found {
    let Candidate { index, exact, beside, .. } = candidate;
    let found = |problem: Problem, result: PlanResult| {
        let result = ended_early(&problem, result);
        let path = result.outcome.as_ref();
        let cost = path.map_or(f64::INFINITY, |path| cost(&problem, &path.segments));
        Found { index, problem, result, cost }
    };
    let mut best = exact.map(|problem| {
        let result = contact::plan(planner, &problem, budget);
        found(problem, result)
    });
    let mut expansions = best.as_ref().map_or(0, |b| b.result.expansions);
    let mut left = budget.max_expansions;
    for problem in beside {
        let known = best.as_ref().map_or(f64::INFINITY, |b| b.cost);
        if best.is_some() && (left == 0 || least_cost(&problem) >= known) {
            continue;
        }
        // Who has arrived already stays.
        let stays = PlanResult::certified(&problem, Path::new(problem.start, []), 0);
        let result = match stays.outcome {
            Ok(_) => stays,
            Err(_) => contact::plan(planner, &problem, Budget { max_expansions: left }),
        };
        expansions += result.expansions;
        left = left.saturating_sub(result.expansions);
        let other = found(problem, result);
        if best.as_ref().is_none_or(|b| other.cost < b.cost) {
            best = Some(other);
        }
    }
    let mut best = best.expect("a candidate has a problem");
    best.result.expansions = expansions;
    best
}

/// The same plan, ended where it first comes within the tolerance.
fn ended_early(problem: &Problem, result: PlanResult) -> PlanResult {
    let (Some((goal, tolerance)), Ok(path), None) =
        (problem.tolerance, &result.outcome, result.covered)
    else {
        return result;
    };
    let Some(path) = up_to(path, |pose| tolerance.holds(goal, pose, 0.0)) else { return result };
    let early = PlanResult::certified(problem, path, result.expansions);
    match early.outcome {
        Ok(_) => PlanResult { guidance: result.guidance, ..early },
        Err(_) => result,
    }
}

/// `path` to the first of its poses that has `arrived`, to the centimetre.
fn up_to(path: &Path, arrived: impl Fn(Pose) -> bool) -> Option<Path> {
    const STEP: f64 = 0.01;
    let mut driven = Vec::new();
    for (from, segment) in path.legs() {
        let steps = (segment.length.abs() / STEP).ceil().max(1.0);
        let mut lengths = (0..=steps as u32).map(|i| segment.length * f64::from(i) / steps);
        if let Some(length) = lengths.find(|&l| arrived(segment.at(from, l))) {
            driven.push(Segment { length, ..segment });
            return Some(Path::new(path.start, driven));
        }
        driven.push(segment);
    }
    None
}
