//! mhha
use super::hybrid_astar::{HybridAStar, HybridAStarConfig};
use super::search::Estimate;
use super::{Budget, PlanResult, Planner, Problem};

/// An ordering of the open nodes besides the anchor's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guide {
    mode: u8,
    weight: f32,
    turn: f32,
}

impl Guide {
    pub fn priority(self, e: Estimate) -> f32 {
        let base = match self.mode {
            0 => e.cost(),
            1 => e.curve,
            2 => e.grid,
            _ => e.grid + e.curve,
        };
        self.weight * base + self.turn * e.misaligned
    }
}

/// x
#[derive(Debug)]
pub struct MultiHeuristicHybridAStar {
    search: HybridAStar,
}

impl MultiHeuristicHybridAStar {
    /// x
    pub fn new(config: HybridAStarConfig) -> Self {
        let spec = std::env::var("MH").unwrap_or("2;0,2,0;1,2,0".into());
        let mut it = spec.split(';');
        let slack: f32 = it.next().unwrap().parse().unwrap();
        let guides = it
            .map(|g| {
                let v: Vec<f32> = g.split(',').map(|x| x.parse().unwrap()).collect();
                Guide { mode: v[0] as u8, weight: v[1], turn: v[2] }
            })
            .collect();
        Self { search: HybridAStar::guided(config, guides, slack) }
    }
}

impl Planner for MultiHeuristicHybridAStar {
    fn name(&self) -> &str {
        "mhha"
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        self.search.plan(problem, budget)
    }
}
