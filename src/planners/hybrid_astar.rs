//! Hybrid A*.
use super::{Budget, PlanResult, Planner, Problem, cost::CostModel};
use serde::{Deserialize, Serialize};

/// Settings of the search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HybridAStarConfig {
    /// The cost of driving.
    pub cost: CostModel,
}
impl HybridAStarConfig {
    /// Checks every field; the error says field, value and what would be right.
    pub fn validate(&self) -> Result<(), String> {
        self.cost.validate()
    }
}
/// Hybrid A* with Reeds-Shepp expansion: the method `ha-rs`.
pub struct HybridAStar {}
impl HybridAStar {
    /// A planner with `config`; buffers grow at first use.
    pub fn new(_config: HybridAStarConfig) -> Self {
        Self {}
    }
}
impl Planner for HybridAStar {
    fn name(&self) -> &str {
        "ha-rs"
    }
    fn plan(&mut self, _problem: &Problem, _budget: Budget) -> PlanResult {
        unimplemented!()
    }
}
