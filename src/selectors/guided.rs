//! N3P: guided planning.
use std::sync::Arc;

use super::PoseSelector;
use crate::planners::{Budget, HybridAStarConfig, PlanResult, Planner, Problem};

/// N3P over a selector.
pub struct GuidedPlanner {}
impl GuidedPlanner {
    /// The paper's Algorithm 1 (`knn-n3p`, `mlp-n3p`): one preparatory pose, two searches.
    pub fn paper(_name: &str, _s: Arc<dyn PoseSelector>, _config: HybridAStarConfig) -> Self {
        Self {}
    }
    /// Ours (`n3p`): ranked candidates, double Reeds-Shepp test before any search.
    pub fn ranked(_name: &str, _s: Arc<dyn PoseSelector>, _config: HybridAStarConfig) -> Self {
        Self {}
    }
}
impl Planner for GuidedPlanner {
    fn name(&self) -> &str {
        unimplemented!()
    }
    fn plan(&mut self, _problem: &Problem, _budget: Budget) -> PlanResult {
        unimplemented!()
    }
}
