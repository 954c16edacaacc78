//! Multi-heuristic Hybrid A*, the method `mhha`.
//!
//! J. Huang, Z. Liu, X. Chi, F. Hong, H. Su, "Search-Based Path Planning Algorithm for
//! Autonomous Parking: Multi-Heuristic Hybrid A*", arXiv 2210.08828, 2022, which puts
//! S. Aine et al., "Multi-Heuristic A*", 2014 (the shared variant, SMHA*) on the lattice of
//! Hybrid A*. All queues hold the same nodes with the same costs. The anchor's order is that
//! of `ha-rs`; the others follow [`Guides`], estimates that may be too high. They take
//! turns, each as long as its least priority is at most w2 times the anchor's (`open.rs`).
//! Everything else is `ha-rs`: goal set, lattices, cost, and the first free curve ends the
//! search. A departure: a node reached more cheaply later may be expanded again from any
//! queue, where SMHA* leaves that to the anchor; the bound below does not depend on it.
//!
//! **Bound.** Wherever a node is taken from, its cost is at most w2 times the anchor's
//! least priority, hence at most w1·w2 times the cost of the cheapest path of the lattice
//! (w1 = `heuristic_weight`), as far as the anchor's heuristic is a lower bound. So it holds
//! for the way from that node to the goal. The curve that joins it to the start lies
//! outside of the bound, as it does for every method here that ends with a curve.
//!
//! The guides are ours: neither half of the anchor's heuristic knows that a car in a narrow
//! spot cannot turn towards the start.

use serde::{Deserialize, Serialize};

use super::config::HybridAStarConfig;
use super::hybrid_astar::HybridAStar;
use super::search::Estimate;
use super::{Budget, PlanResult, Planner, Problem};
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// Settings of the method `mhha`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MultiHeuristicConfig {
    /// w2: how far beyond the anchor's least priority the other queues may go, a factor.
    pub slack: f64,
    /// Inflation of the anchor's estimate in the greedy queue, a factor.
    pub inflation: f64,
    /// Cost per metre that nose or tail stand in a parallel spot, in both of the other queues.
    pub depth: f64,
}

impl Default for MultiHeuristicConfig {
    fn default() -> Self {
        Self { slack: 2.0, inflation: 1.5, depth: 2.0 }
    }
}

/// The estimates of the queues besides the anchor. For a node's pose they give
///
/// 1. the *sum* of the two halves of the anchor's estimate (which takes the larger), and
/// 2. *greedily* the anchor's estimate times the inflation,
///
/// each plus a price per metre for how deep nose and tail stand in a parallel spot. Leaving
/// a narrow one takes changes of gear that no other estimate foresees; this one rewards
/// what they gain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guides {
    config: MultiHeuristicConfig,
    vehicle: Vehicle,
    /// y from which on the middle of nose or tail is out of the spot, planning frame, metres.
    border: f64,
}

impl Guides {
    /// How many estimates there are.
    pub const COUNT: usize = 2;

    pub fn new(config: MultiHeuristicConfig) -> Self {
        Self { config, vehicle: Vehicle::default(), border: f64::NEG_INFINITY }
    }

    /// w2.
    pub fn slack(&self) -> f32 {
        self.config.slack as f32
    }

    /// Takes over car and spot of `problem`. Only parallel spots are deep: a car leaves a
    /// bay straight, which needs no reward.
    pub fn reset(&mut self, problem: &Problem) {
        let v = problem.vehicle;
        // In the spot frame the lane lies at +y: out is what stands a car's width beside the
        // parked car.
        self.border = match problem.kind {
            Some(ParkingType::Parallel) => problem.goal.y + v.width,
            _ => f64::NEG_INFINITY,
        };
        self.vehicle = v;
    }

    /// The estimates for a pose.
    pub fn estimates(&self, anchor: Estimate, pose: Pose) -> [f32; Self::COUNT] {
        let deep = (self.config.depth * self.depth(pose)) as f32;
        let greedy = self.config.inflation as f32 * anchor.cost();
        [anchor.grid + anchor.curve + deep, greedy + deep]
    }

    /// How deep nose and tail stand in the spot, together, metres.
    fn depth(&self, pose: Pose) -> f64 {
        let ends = [self.vehicle.front_extent(), -self.vehicle.rear_overhang];
        ends.iter().map(|&x| (self.border - pose.shifted(x).y).max(0.0)).sum()
    }
}

/// Hybrid A* with Reeds-Shepp expansion and several queues.
#[derive(Debug)]
pub struct MultiHeuristicHybridAStar {
    search: HybridAStar,
}

impl MultiHeuristicHybridAStar {
    /// Buffers grow at first use.
    pub fn new(config: HybridAStarConfig) -> Self {
        Self { search: HybridAStar::guided(config) }
    }
}

impl Planner for MultiHeuristicHybridAStar {
    fn name(&self) -> &str {
        "mhha"
    }

    fn config(&self) -> HybridAStarConfig {
        *self.search.config()
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        self.search.plan(problem, budget)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::cell::{Cell, Grid};

    #[test]
    fn a_parked_car_is_deep_in_parallel_spots_only() {
        let vehicle = Vehicle::default();
        for kind in ParkingType::ALL {
            let stance = Grid::default().stances(kind)[0];
            let cell = Cell { stance, lane_width: 6.0, spot_width: 7.0, dead_end: 12.0 };
            let start = Pose::new(Grid::default().lane(&cell).min.x + 4.0, 4.5, 0.0);
            let problem = Problem::in_cell(&Grid::default(), &cell, vehicle, start).unwrap();
            let mut guides = Guides::new(MultiHeuristicConfig::default());
            guides.reset(&problem);
            let parked = guides.depth(problem.goal);
            let deep = if kind.is_bay() { 0.0 } else { 2.0 * vehicle.width };
            assert!((parked - deep).abs() < 1e-9, "{kind}: {parked}");
            assert_eq!(guides.depth(start), 0.0, "{kind}");
            let estimate = Estimate { grid: 10.0, curve: 12.0 };
            assert_eq!(guides.estimates(estimate, start), [22.0, 18.0]);
        }
    }
}
