//! Leaving a spot: parking, driven backwards.
//!
//! Driving is reversible. A car that stands where it can hardly move, and is to come where it can, plans the way out as
//! the way in: that is what planners know manoeuvres for, and a search finds its way out of a tight place much
//! sooner than into it.

use super::continuous;
use super::problem::Terms;
use super::{Budget, Guidance, PlanResult, Planner, Problem};
use crate::curves::{Path, Segment};
use crate::geometry::Pose;
use crate::world::Scene;

/// Whether no turn at full lock, of half the turning radius, is free from `pose`.
fn is_confined(problem: &Problem, pose: Pose) -> bool {
    let most = problem.vehicle.max_curvature();
    let turn = |curvature, length| Segment { curvature, length };
    let turns =
        [most, -most].into_iter().flat_map(|k| [0.5, -0.5].map(|part| turn(k, part / most)));
    turns.into_iter().all(|s| !problem.collision.segment_is_free(pose, s))
}

/// The way to the goal of `problem`, which is that of `scene`, if it leads out of a confined place into a free
/// one: planned as the way in. `None` where it does not.
pub(super) fn plan(
    planner: &mut dyn Planner,
    scene: &Scene,
    problem: &Problem,
    terms: &Terms,
    budget: Budget,
) -> Option<PlanResult> {
    let is_way_out = || is_confined(problem, problem.start) && !is_confined(problem, problem.goal);
    if problem.contact.is_some() || !is_way_out() {
        return None;
    }
    let goal = problem.frame.world_from_local(problem.goal);
    let parking = Scene {
        start: goal,
        start_steer: 0.0,
        goal: scene.start,
        goals: Vec::new(),
        goal_tolerance: None,
        parking_type: None,
        previous: None,
        ..scene.clone()
    };
    let terms_of_parking = Terms { margin: terms.margin, ..Terms::default() };
    let parking = Problem::unexplained(&parking, terms_of_parking).ok()?;
    let result = planner.plan(&parking, budget);
    let none = |reason| PlanResult::none(reason, result.expansions);
    let path = match &result.outcome {
        Ok(path) => path.to_world(&parking.frame).reversed().seen_from(&problem.frame),
        Err(reason) => return Some(none(*reason)),
    };
    // A policy stops beside its goal; the car starts where it stands, and the lengths of the path are fitted to that.
    let path = Path { start: problem.start, ..path };
    let exactly = |fitted: PlanResult| PlanResult { smooth: None, ..fitted };
    let fitted = continuous::fitted(problem, &path, &Terms::default()).map(exactly)?;
    let preparatory = |pose| problem.frame.local_from_world(parking.frame.world_from_local(pose));
    let guidance =
        result.guidance.map(|g| Guidance { preparatory: g.preparatory.map(preparatory), ..g });
    Some(PlanResult { expansions: result.expansions, guidance, ..fitted })
}
