//! Plans a scene with any planner: to the cheapest of its goals, or within their tolerance.
//!
//! A scene is a list of [`Problem`]s with one goal each: every goal of the scene, and where there is
//! a tolerance also the poses that stand for it. Planners know nothing of that. Costs are those of [`CostModel`]. What cannot become the
//! cheapest, because the shortest curve through empty space costs too much already, is not planned.
//! The order of the goals does not matter, but among equals the first is taken.

use super::contact;
use super::continuous;
use super::cost::CostModel;
use super::leaving;
use super::previous;
pub use super::problem::Terms;
use super::{Budget, NoPath, PlanResult, Planner, Problem, ProblemError};
use crate::curves::{Path, Segment, SmoothPath, reeds_shepp};
use crate::geometry::Pose;
use crate::world::Scene;

/// A plan to one of a scene's goals, or why there is none to any.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Which of [`Scene::all_goals`]; without a path the one that was tried first.
    pub goal_index: usize,
    /// The problem of this goal.
    pub problem: Problem,
    /// What was found; expansions are those of all goals.
    pub result: PlanResult,
    /// Goals that cannot be parked at, and why, in the order of the scene; of those that cost more
    /// anyway nobody asked.
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

/// The problem by which a scene is introduced to those who need one before it is planned: that of its
/// first goal that is free. An error where there is none.
pub fn first_problem(scene: &Scene, terms: Terms) -> Result<Problem, ProblemError> {
    let mut errors = Vec::new();
    for index in 0..scene.all_goals().len() {
        let goal = Goal::new(scene, index, terms, CostModel::default());
        let exact = goal.exact()?;
        match exact.or_else(|error| goal.beside().find_map(|p| p.map(Ok)).unwrap_or(Err(error))) {
            Ok(problem) => return Ok(problem),
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
    errors.sort_unstable_by_key(|(index, _)| *index);
    let field = |(i, error)| (scene.goal_field(i), error);
    ProblemError::NoGoalFree(errors.into_iter().map(field).collect())
}

/// One goal of a scene. Its problems are made one at a time: each holds all obstacles.
struct Goal<'a> {
    scene: &'a Scene,
    index: usize,
    pose: Pose,
    terms: Terms,
    model: CostModel,
}

impl<'a> Goal<'a> {
    fn new(scene: &'a Scene, index: usize, terms: Terms, cost: CostModel) -> Self {
        let model = cost.scaled(scene.vehicle.scale());
        Self { scene, index, pose: scene.all_goals()[index], terms, model }
    }

    /// The problem with exactly this goal, or why the car does not fit there. Other errors are the
    /// scene's.
    fn exact(&self) -> Result<Result<Problem, ProblemError>, ProblemError> {
        let Terms { margin, contact, .. } = self.terms;
        let single;
        // Most scenes have one goal and are not copied.
        let scene = if self.scene.goals.is_empty() {
            self.scene
        } else {
            single = self.scene.with_goal(self.pose);
            &single
        };
        match Problem::allowing_contact(scene, margin, contact) {
            Err(error @ ProblemError::GoalInCollision(..)) => Ok(Err(error)),
            other => other.map(Ok),
        }
    }

    /// The poses within its tolerance that are tried besides the goal itself, in a fixed order.
    fn poses_beside(&self) -> Vec<Pose> {
        let Some(tolerance) = self.scene.goal_tolerance else { return Vec::new() };
        tolerance.poses(self.pose).split_off(1)
    }

    /// Staying where the car is, where that is within the tolerance.
    fn stay(&self) -> Option<(Problem, PlanResult)> {
        let (tolerance, start) = (self.scene.goal_tolerance?, self.scene.start);
        let problem =
            if tolerance.holds(self.pose, start, 0.0) { self.to(start)? } else { return None };
        let stays = PlanResult::certified(&problem, Path::new(problem.start, []), 0);
        stays.outcome.is_ok().then_some((problem, stays))
    }

    /// The problem of one of [`Goal::poses_beside`]; `None` where the car does not fit.
    fn to(&self, pose: Pose) -> Option<Problem> {
        let scene = self.scene.with_goal(pose);
        let mut problem = Problem::unexplained(&scene, self.terms).ok()?;
        let centre = problem.frame.local_from_world(self.pose);
        problem.tolerance = self.scene.goal_tolerance.map(|tolerance| (centre, tolerance));
        Some(problem)
    }

    /// The problems of all these poses.
    fn beside(&self) -> impl Iterator<Item = Option<Problem>> + '_ {
        self.poses_beside().into_iter().map(|pose| self.to(pose))
    }

    /// What driving to `pose` costs at least, obstacles aside.
    fn least_cost_to(&self, pose: Pose) -> f64 {
        let Scene { start, vehicle, .. } = self.scene;
        // As far from the origin as the scene lies numbers are coarser.
        let here = Pose::new(0.0, 0.0, start.heading);
        let there = Pose::new(pose.x - start.x, pose.y - start.y, pose.heading);
        let length = reeds_shepp::shortest_length(here, there, 1.0 / vehicle.max_curvature());
        // A rounding less, so that equals are compared by what they cost.
        self.per_metre() * length * (1.0 - 1e-9)
    }

    /// What driving to the goal or anywhere within its tolerance costs at least.
    fn least_cost(&self) -> f64 {
        let Some(tolerance) = self.scene.goal_tolerance else {
            return self.least_cost_to(self.pose);
        };
        let apart = self.scene.start.distance(self.pose) - tolerance.position_m;
        self.per_metre() * apart.max(0.0) * (1.0 - 1e-9)
    }

    fn per_metre(&self) -> f64 {
        self.model.forward.min(self.model.backward)
    }

    /// What `planner` finds to the goal of `problem`: a way out of where the start is confined, or else a way in.
    fn out_or_in(
        &self,
        planner: &mut dyn Planner,
        problem: &Problem,
        budget: Budget,
    ) -> PlanResult {
        let half = Budget { max_expansions: budget.max_expansions / 2, ..budget };
        let out = leaving::plan(planner, self.scene, problem, &self.terms, half);
        let spent = match out {
            Some(out) if out.outcome.is_ok() => return out,
            out => out.map_or(0, |out| out.expansions),
        };
        let max_expansions = budget.max_expansions - spent;
        let result = contact::plan(planner, problem, Budget { max_expansions, ..budget });
        PlanResult { expansions: spent + result.expansions, ..result }
    }

    /// The cheapest path that `planner` finds there, exactly to the goal or within its tolerance, or
    /// why the car does not fit.
    fn plan(
        &self,
        planner: &mut dyn Planner,
        budget: Budget,
    ) -> Result<Result<Found, ProblemError>, ProblemError> {
        let found = |planner: &mut dyn Planner, problem: Problem, result: PlanResult| {
            let result = ended_early(&problem, result);
            let result = continuous::driven(planner, &problem, result, &self.terms, budget);
            let path = result.outcome.as_ref();
            let cost = |path: &Path| self.model.path(&problem.vehicle, &path.segments);
            let cost = path.map_or(f64::INFINITY, cost);
            Found { index: self.index, problem, result, cost }
        };
        if let Some((problem, stays)) = self.stay() {
            return Ok(Ok(found(planner, problem, stays)));
        }
        let exact = self.exact()?.map(|problem| {
            let result = self.out_or_in(planner, &problem, budget);
            found(planner, problem, result)
        });
        let mut expansions = exact.as_ref().map_or(0, |b| b.result.expansions);
        let mut best = exact;
        let mut left = budget.max_expansions;
        for pose in self.poses_beside() {
            let beaten = |b: &Found| left == 0 || b.beats(self.least_cost_to(pose));
            if best.as_ref().is_ok_and(beaten) {
                continue;
            }
            let Some(problem) = self.to(pose) else { continue };
            let result =
                contact::plan(planner, &problem, Budget { max_expansions: left, ..budget });
            expansions += result.expansions;
            left = left.saturating_sub(result.expansions);
            let other = found(planner, problem, result);
            if best.as_ref().is_ok_and(|b| b.rank() <= other.rank()) {
                continue;
            }
            best = Ok(other);
        }
        Ok(best.map(|b| Found { result: PlanResult { expansions, ..b.result }, ..b }))
    }
}

/// What came of one goal.
struct Found {
    index: usize,
    problem: Problem,
    result: PlanResult,
    cost: f64,
}

impl Found {
    /// What is compared: any path is better than none, and contact at the goal that can be avoided
    /// is, whatever it costs.
    fn rank(&self) -> (bool, bool, f64) {
        let touches = self.problem.contact.as_ref().is_some_and(|c| c.goal_depth > 0.0);
        (self.result.outcome.is_err(), touches, self.cost)
    }

    /// Whether nothing that costs `bound` or more can be better.
    fn beats(&self, bound: f64) -> bool {
        let (failed, touches, cost) = self.rank();
        !failed && !touches && cost <= bound
    }
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
    scene.check_numbers()?;
    let cost = planner.config().cost;
    let goals = (0..scene.all_goals().len()).map(|index| Goal::new(scene, index, terms, cost));
    let mut goals: Vec<(f64, Goal)> = goals.map(|goal| (goal.least_cost(), goal)).collect();
    // The nearest first: what they cost leaves out most of the others. Sorting is stable.
    goals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<Found> = None;
    let mut failed: Option<Found> = None;
    let (mut errors, mut no_path) = (Vec::new(), Vec::new());
    let mut expansions = 0;
    for (bound, goal) in goals {
        if best.as_ref().is_some_and(|b| b.beats(bound) && b.cost < bound) {
            break;
        }
        let found = match goal.plan(planner, budget)? {
            Ok(found) => found,
            Err(error) => {
                errors.push((goal.index, error));
                continue;
            }
        };
        expansions += found.result.expansions;
        if let Err(reason) = found.result.outcome {
            no_path.push((goal.index, reason));
            failed = failed.or(Some(found));
        } else if best.as_ref().is_none_or(|b| (found.rank(), found.index) < (b.rank(), b.index)) {
            best = Some(found);
        }
    }
    if let Some(kept) = kept(scene, terms, cost) {
        let is_clearly_better = |b: &Found| b.beats(previous::BETTER * kept.cost);
        if !best.as_ref().is_some_and(is_clearly_better) {
            best = Some(kept);
        }
    }
    let Some(Found { index: goal_index, problem, result, .. }) = best.or(failed) else {
        return Err(none_free(scene, errors));
    };
    let result = begun(&problem, PlanResult { expansions, ..result });
    let not_free = errors.into_iter().map(|(index, error)| (index, PassedOver::NotFree(error)));
    let no_path = no_path.into_iter().map(|(index, reason)| (index, PassedOver::NoPath(reason)));
    let mut passed_over: Vec<_> = not_free.chain(no_path).collect();
    passed_over.sort_unstable_by_key(|(index, _)| *index);
    Ok(Planned { goal_index, problem, result, passed_over })
}

/// What is left of the scene's previous path, with the goal that it leads to.
fn kept(scene: &Scene, terms: Terms, cost: CostModel) -> Option<Found> {
    scene.previous.as_ref()?;
    (0..scene.all_goals().len()).find_map(|index| {
        let goal = Goal::new(scene, index, terms, cost);
        let problem = goal.exact().ok()?.ok().filter(|p| p.contact.is_none())?;
        let result = previous::kept(scene, &problem, &terms)?;
        let cost = goal.model.path(&problem.vehicle, &result.outcome.as_ref().ok()?.segments);
        Some(Found { index, problem, result, cost })
    })
}

/// The result, whose path knows how the wheels stand before the car moves.
fn begun(problem: &Problem, result: PlanResult) -> PlanResult {
    let begin = problem.start_curvature;
    if begin == 0.0 || result.smooth.is_some() {
        return result;
    }
    let driven = |path: &Path| SmoothPath { begin, ..SmoothPath::of(path) };
    PlanResult { smooth: result.outcome.as_ref().ok().map(driven), ..result }
}

/// The same plan, ended where it first comes within the tolerance.
fn ended_early(problem: &Problem, result: PlanResult) -> PlanResult {
    let (Some((goal, tolerance)), Ok(path), None) =
        (problem.tolerance, &result.outcome, result.covered)
    else {
        return result;
    };
    // Half of what the certificate forgives: headings that are to be equal differ by roundings.
    let arrived = |pose| tolerance.holds(goal, pose, Problem::ROUNDING / 2.0);
    // Who arrives only at the end keeps the path as it is, to its last digit.
    let is_shorter = |early: &Path| early.length() < path.length() - Problem::ROUNDING;
    let Some(early) = up_to(path, arrived).filter(is_shorter) else { return result };
    let early = PlanResult::certified(problem, early, result.expansions);
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
