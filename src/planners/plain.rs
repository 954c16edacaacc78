//! Hybrid A* without analytic expansion, the method `ha`.
//!
//! D. Dolgov, S. Thrun, M. Montemerlo, J. Diebel, "Practical Search Techniques in Path
//! Planning for Autonomous Driving", 2008, without its Reeds-Shepp step: the search goes on
//! until a node lies in the goal region (`HybridAStarConfig::goal_region`). Everything else
//! is that of `ha-rs`: it runs from the goal set to the start, so the region is around the
//! *start*, with the same lattices, cost and heuristics (the non-holonomic one included,
//! which is Dolgov's). The last centimetres are closed by bending the motions found
//! (`joint.rs`); where that fails the search goes on.

use super::analytic::GoalSet;
use super::config::{Attempt, HybridAStarConfig};
use super::search::Search;
use super::{Budget, NoPath, PlanResult, Planner, Problem, joint};
use crate::curves::Path;

/// Hybrid A* without Reeds-Shepp curves.
#[derive(Debug)]
pub struct PlainHybridAStar {
    config: HybridAStarConfig,
    search: Search,
}

impl PlainHybridAStar {
    /// Buffers grow at first use.
    pub fn new(config: HybridAStarConfig) -> Self {
        Self { config, search: Search::default() }
    }

    /// One search at one resolution.
    fn search(
        &mut self,
        attempt: Attempt,
        problem: &Problem,
        goal: &GoalSet,
        expansions: &mut usize,
    ) -> Result<Path, NoPath> {
        let (config, search) = (attempt.config, &mut self.search);
        search.begin(attempt, problem, problem.start, goal);
        while let Some(node) = search.pop() {
            if config.goal_region.contains(problem.start, search.pose(node)) {
                let (way, entry) = search.way(node);
                let rest = goal.entries()[entry].rest.iter().copied();
                let near = Path::new(search.pose(node), way.into_iter().chain(rest));
                if let Some(path) = joint::close(problem, &near) {
                    return Ok(path);
                }
            }
            if *expansions == 0 {
                return Err(NoPath::BudgetSpent);
            }
            *expansions -= 1;
            search.expand(node, goal, config, problem);
        }
        Err(search.stop())
    }
}

impl Planner for PlainHybridAStar {
    fn name(&self) -> &str {
        "ha"
    }

    fn config(&self) -> HybridAStarConfig {
        self.config
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let config = match self.config.for_search(problem) {
            Ok(config) => config,
            Err(reason) => return PlanResult::none(reason, 0),
        };
        let goal = config.goal_set(problem);
        let domains = config.domains(problem, problem.start, problem.goal);
        let mut left = budget.max_expansions;
        let path = config.coarse_to_fine(&domains, false, &mut left, |attempt, left| {
            self.search(attempt, problem, &goal, left)
        });
        let expansions = budget.max_expansions - left;
        match path {
            Ok(path) => PlanResult::certified(problem, path, expansions),
            Err(reason) => PlanResult::none(reason, expansions),
        }
    }
}
