//! Keeping to the path that the car follows already.
//!
//! Two plans that cost about the same may differ much, such as in the gear that they begin with, and noise decides between
//! them from one cycle to the next. A car that replans all the time must not go back and forth for that.

use super::continuous;
use super::problem::Terms;
use super::{Guidance, PlanResult, Problem, Route};
use crate::curves::Path;
use crate::geometry::{Pose, signed_angle};
use crate::world::Scene;

/// A new plan must cost less than so much of what is left of the previous path to take its place.
pub(super) const BETTER: f64 = 0.95;

/// What is left of the scene's previous path, its lengths fitted to lead from the start to the goal of `problem`;
/// `None` where it leads elsewhere, is not free or cannot be driven as `terms` ask.
pub(super) fn kept(scene: &Scene, problem: &Problem, terms: &Terms) -> Option<PlanResult> {
    let previous = scene.previous.as_ref()?;
    let end = problem.frame.local_from_world(previous.end()?);
    if !leads_to(problem, end) {
        return None;
    }
    let mut rest = previous.rest(scene.start, &problem.vehicle)?;
    for segment in &mut rest {
        segment.curvature = problem.frame.flip_curvature(segment.curvature);
    }
    let result = continuous::fitted(problem, &Path::new(problem.start, rest), terms)?;
    Some(PlanResult {
        guidance: Some(Guidance { preparatory: None, route: Route::Kept }),
        ..result
    })
}

/// Whether a path that ends at `end` was planned to the goal of `problem`: measurements of a goal err, too.
fn leads_to(problem: &Problem, end: Pose) -> bool {
    /// Metres for the default vehicle, and radians.
    const NEAR: f64 = 0.3;
    const TURNED: f64 = 0.1;
    let turned = signed_angle(end.heading, problem.goal.heading).abs();
    end.distance(problem.goal) < NEAR * problem.vehicle.scale() && turned < TURNED
}
