//! A policy as a planner: a row of the tables.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::actor::Choice;
use super::motion::drive;
use super::senses::Senses;
use super::{Policy, PolicyFault};
use crate::curves::Path;
use crate::planners::{
    Budget, HybridAStarConfig, NoPath, PARKED_COVER, PlanResult, Planner, Problem,
};
use crate::rng::{Stream, rng};

/// Rules of a rollout.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RolloutConfig {
    /// How a trained actor's Gaussian becomes an action; other policies decide themselves.
    pub choice: Choice,
    /// Steps after which a policy has failed.
    pub horizon: u32,
    /// Curves to the goal are tried from poses nearer to it than this, metres.
    pub curve_distance: f64,
}

impl Default for RolloutConfig {
    fn default() -> Self {
        Self { choice: Choice::default(), horizon: 400, curve_distance: 10.0 }
    }
}

impl RolloutConfig {
    /// Checks every setting.
    pub fn validate(&self) -> Result<(), String> {
        let within = |field: &str, v: f64, low: f64, high: f64| {
            if (low..=high).contains(&v) {
                return Ok(());
            }
            Err(format!("{field} is {v}; expected a number from {low} to {high}"))
        };
        within("horizon", f64::from(self.horizon), 1.0, 1e6)?;
        within("curve_distance", self.curve_distance, 0.0, 1000.0)
    }
}

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
