//! Scenario-based Hybrid A*, the method `sha`: parallel spots only.
//!
//! Known here from the paper's section V, which compares with it: a geometric manoeuvre of
//! full-lock arcs out of the spot (`exit_manoeuvre.rs`) gives an easier goal, and Hybrid A*
//! with Reeds-Shepp expansion drives there. Ours offers every end of the manoeuvre at once:
//! they are roots of one search, priced with the way in that follows them.
//!
//! 1. One curve from the start to the goal set or to any exit, the cheapest free one.
//! 2. A search to the exits, with half of the budget.
//! 3. The search of `ha-rs` with the rest, where there is no exit or no way to one.

use super::config::HybridAStarConfig;
use super::hybrid_astar::{HybridAStar, Leg};
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
        let start = problem.start;
        let plain = self.search.goal_set(problem);
        let mut goal = plain.clone();
        for exit in exit_manoeuvre::exits(problem) {
            let cost = self.search.cost(&problem.vehicle);
            goal.add_preparatory(exit.pose, exit.way_in, &problem.vehicle, &cost);
        }
        if let Some(leg) = self.search.direct(problem, start, &goal) {
            return Ok(leg);
        }
        if let Some(exits) = goal.only_preparatory() {
            let reserve = *expansions / 2;
            *expansions -= reserve;
            let leg = self.search.search(problem, start, &exits, None, expansions);
            *expansions += reserve;
            if leg.is_ok() {
                return leg;
            }
        }
        self.search.search(problem, start, &plain, None, expansions)
    }
}

impl Planner for ScenarioHybridAStar {
    fn name(&self) -> &str {
        "sha"
    }

    fn config(&self) -> HybridAStarConfig {
        *self.search.config()
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
