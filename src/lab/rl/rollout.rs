//! A policy as a planner: a row of the tables.

use rand_chacha::ChaCha8Rng;

use super::{Policy, PolicyFault};
use crate::curves::Path;
use crate::environment::motion::drive;
use crate::environment::senses::Senses;
use crate::n3p::RolloutConfig;
use crate::planners::{
    Budget, HybridAStarConfig, NoPath, PARKED_COVER, PlanResult, Planner, Problem,
};
use crate::rng::{Stream, rng};

/// Drives a policy until a free Reeds-Shepp curve (and entry straight) leads to the goal, or until
/// the car stands well enough in its spot.
///
/// The curve is looked for before the first step, too. Contact ends a step early; it is no
/// failure. Steps count as expansions.
pub struct PolicyPlanner<P> {
    name: String,
    policy: P,
    config: RolloutConfig,
    curves: HybridAStarConfig,
    /// Kept for the next problem.
    senses: Option<Senses>,
}

impl<P: Policy> PolicyPlanner<P> {
    /// The row `name` of `policy`; `curves` says which curves lead to the goal.
    pub fn new(
        name: impl Into<String>,
        policy: P,
        config: RolloutConfig,
        curves: HybridAStarConfig,
    ) -> Self {
        Self { name: name.into(), policy, config, curves, senses: None }
    }
}

impl<P: Policy> Planner for PolicyPlanner<P> {
    fn name(&self) -> &str {
        &self.name
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let senses = match &mut self.senses {
            Some(senses) => {
                senses.enter(problem);
                senses
            }
            empty => empty.insert(Senses::new(problem, &self.curves)),
        };
        // The same for every problem, so that a result depends on the problem alone.
        let mut rng: ChaCha8Rng = rng(0, Stream::Policy, 0);
        let mut path = Path::new(problem.start, []);
        let mut pose = problem.start;
        for step in 0.. {
            let near = pose.distance(problem.goal) < self.config.curve_distance;
            if near && let Some(curve) = senses.curve_to_goal(problem, pose) {
                path.extend(curve);
                return PlanResult::certified(problem, path, step as usize);
            }
            if problem.vehicle.overlap(pose, problem.goal) >= PARKED_COVER {
                return PlanResult::certified_cover(problem, path, step as usize);
            }
            if step >= self.config.horizon {
                return PlanResult::none(NoPath::OutOfSteps, step as usize);
            }
            if step as usize >= budget.max_expansions {
                return PlanResult::none(NoPath::BudgetSpent, step as usize);
            }
            match self.policy.act(&senses.observe(problem, pose, step), &mut rng) {
                Ok(action) if action.is_finite() => {
                    let driven = drive(problem, pose, action.motion(&problem.vehicle));
                    pose = driven.end(pose);
                    path.extend([driven]);
                }
                Ok(_) => return failed(PolicyFault::NotFinite, step),
                Err(fault) => return failed(fault, step),
            }
        }
        unreachable!("the horizon ends the loop")
    }
}

fn failed(fault: PolicyFault, step: u32) -> PlanResult {
    PlanResult::none(NoPath::Failed(fault.reason()), step as usize)
}
