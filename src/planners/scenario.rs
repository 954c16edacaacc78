//! Scenario-based Hybrid A*, the method `sha` (parallel spots only).
//!
//! The paper describes it as Hybrid A* towards an easier goal that a geometric manoeuvre
//! of full-lock arcs from the parked pose provides.

use super::hybrid_astar::{HybridAStar, HybridAStarConfig, Leg};
use super::{Budget, NoPath, PlanResult, Planner, Problem, exit_manoeuvre};
use crate::world::ParkingType;

/// Hybrid A* to the end of an exit manoeuvre.
#[derive(Debug)]
pub struct ScenarioHybridAStar {
    search: HybridAStar,
}

impl ScenarioHybridAStar {
    /// Buffers grow at first use.
    pub fn new(config: HybridAStarConfig) -> Self {
        Self { search: HybridAStar::new(config) }
    }

    fn leg(&mut self, problem: &Problem, expansions: &mut usize) -> Result<Leg, NoPath> {
        let cost = self.search.config().cost;
        let plain = self.search.goal_set(problem);
        if let Some(leg) = self.search.direct(problem, problem.start, &plain) {
            return Ok(leg);
        }
        let mut goal = crate::planners::analytic::GoalSet::single(problem.goal);
        for exit in exit_manoeuvre::exits(problem) {
            goal.add_preparatory(exit.pose, exit.way_in, &problem.vehicle, &cost);
        }
        if let Some(exits) = goal.only_preparatory() {
            // The plain search is left its share.
            let reserve = *expansions / 2;
            *expansions -= reserve;
            let leg = self.search.leg(problem, problem.start, &exits, expansions);
            *expansions += reserve;
            if leg.is_ok() {
                return leg;
            }
        }
        self.search.search(problem, problem.start, &plain, None, expansions)
    }
}

impl Planner for ScenarioHybridAStar {
    fn name(&self) -> &str {
        "sha"
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        if problem.kind != Some(ParkingType::Parallel) {
            return PlanResult::none(NoPath::NotApplicable, 0);
        }
        let mut left = budget.max_expansions;
        let leg = self.leg(problem, &mut left);
        let expansions = budget.max_expansions - left;
        match leg {
            Ok(leg) => PlanResult::certified(problem, leg.path, expansions),
            Err(reason) => PlanResult::none(reason, expansions),
        }
    }
}
