//! Hybrid A* with Reeds-Shepp expansion (HARS), the method `ha-rs`.
//!
//! D. Dolgov, S. Thrun, M. Montemerlo, J. Diebel, "Practical Search Techniques in Path
//! Planning for Autonomous Driving", 2008: a best-first search over a lattice whose cells
//! keep continuous poses, guided by the larger of two cost-to-go heuristics, and ended by
//! the first Reeds-Shepp curve that reaches the goal without contact.

use serde::{Deserialize, Serialize};

use crate::curves::Path;
use crate::geometry::{Aabb, Pose};
use crate::vehicle::Vehicle;

use super::analytic::AnalyticExpansion;
pub(crate) use super::analytic::{Connection, GoalSet};
use super::cost::{CostModel, DriveState};
use super::search::{Search, Stop};
use super::{Budget, NoPath, PlanResult, Planner, Problem};

/// Settings of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HybridAStarConfig {
    /// The cost of driving.
    pub cost: CostModel,
    /// Side of a lattice cell, metres.
    pub cell: f64,
    /// Heading bins of the lattice.
    pub headings: usize,
    /// Arc length of a motion primitive, metres.
    pub step: f64,
    /// Steering angles of the primitives, evenly spaced from full left to full right.
    pub steers: usize,
    /// Side of a cell of the A* cost-to-go, metres.
    pub cost_to_go_cell: f64,
    /// The search stays within the box of start and goal grown by this, metres.
    pub domain_margin: f64,
    /// Whether a straight may lead into a bay (the goal set). `false` asks for curves that
    /// end at the parked pose itself: an ablation.
    pub entry_straight: bool,
    /// Distance between entry poses, metres.
    pub entry_step: f64,
    /// Longest entry straight, metres.
    pub entry_max: f64,
    /// Weight of the heuristic; 1 is A*.
    pub heuristic_weight: f64,
}

impl Default for HybridAStarConfig {
    fn default() -> Self {
        Self {
            cost: CostModel::default(),
            cell: 0.4,
            headings: 72,
            step: 0.6,
            steers: 5,
            cost_to_go_cell: 0.5,
            domain_margin: 12.0,
            entry_straight: true,
            entry_step: 1.0,
            entry_max: 5.0,
            heuristic_weight: 1.0,
        }
    }
}

impl HybridAStarConfig {
    /// Checks every field; the error says field, value and what would be right.
    pub fn validate(&self) -> Result<(), String> {
        self.cost.validate()?;
        for (field, v, low, high) in [
            ("cell", self.cell, 0.05, 5.0),
            ("step", self.step, 0.05, 10.0),
            ("cost_to_go_cell", self.cost_to_go_cell, 0.05, 5.0),
            ("domain_margin", self.domain_margin, 1.0, 1000.0),
            ("entry_step", self.entry_step, 0.05, 10.0),
            ("entry_max", self.entry_max, 0.0, 50.0),
            ("heuristic_weight", self.heuristic_weight, 0.0, 100.0),
        ] {
            if !(v.is_finite() && (low..=high).contains(&v)) {
                return Err(format!("planner.{field} is {v}; expected a number from {low} to {high}"));
            }
        }
        for (field, v, low, high) in
            [("headings", self.headings, 8, 720), ("steers", self.steers, 3, 63)]
        {
            if !(low..=high).contains(&v) {
                return Err(format!("planner.{field} is {v}; expected {low} to {high}"));
            }
        }
        if self.steers.is_multiple_of(2) {
            return Err(format!("planner.steers is {}; expected an odd number", self.steers));
        }
        Ok(())
    }
}

/// Hybrid A* with Reeds-Shepp expansion: the method `ha-rs`.
#[derive(Debug)]
pub struct HybridAStar {
    config: HybridAStarConfig,
    search: Search,
    analytic: AnalyticExpansion,
}

/// What one search found.
#[derive(Clone, Debug)]
pub(crate) struct Leg<'a> {
    /// The path from the leg's start to its goal.
    pub path: Path,
    /// The curve that ended it.
    pub end: Connection<'a>,
}

impl HybridAStar {
    /// A planner with `config`; buffers grow at first use.
    pub fn new(config: HybridAStarConfig) -> Self {
        Self { config, search: Search::default(), analytic: AnalyticExpansion::default() }
    }

    /// The settings.
    pub fn config(&self) -> &HybridAStarConfig {
        &self.config
    }

    /// The goal of `problem` with the entry straights that are free.
    pub(crate) fn goal_set(&self, problem: &Problem) -> GoalSet {
        let mut goal = GoalSet::single(problem.goal);
        if self.config.entry_straight {
            let c = &self.config;
            goal.add_straights(problem, &c.cost, c.entry_step, c.entry_max);
        }
        goal
    }

    /// The cheapest free way from `from` into `goal`, without any search.
    pub(crate) fn connect<'a>(
        &mut self,
        problem: &Problem,
        from: Pose,
        goal: &'a GoalSet,
    ) -> Option<Connection<'a>> {
        self.analytic.connect(from, DriveState::PARKED, goal, problem, &self.config.cost)
    }

    /// Searches from `start` to `goal` within `expansions`, which is reduced by what was
    /// spent. The cost-to-go is computed only when the first curve fails.
    pub(crate) fn leg<'a>(
        &mut self,
        problem: &Problem,
        start: Pose,
        goal: &'a GoalSet,
        expansions: &mut usize,
    ) -> Result<Leg<'a>, NoPath> {
        if let Some(end) = self.connect(problem, start, goal) {
            return Ok(Leg { path: Path::new(start, end.segments()), end });
        }
        let domain = self.domain(problem, start, goal.pose);
        self.search.begin(&self.config, problem, domain, start, goal.pose);
        while let Some(node) = self.search.pop() {
            if *expansions == 0 {
                return Err(NoPath::BudgetSpent);
            }
            *expansions -= 1;
            if self.search.wants_curve(node) {
                let (pose, state) = self.search.arrival(node);
                let end = self.analytic.connect(pose, state, goal, problem, &self.config.cost);
                if let Some(end) = end {
                    let mut path = self.search.path_to(node);
                    path.extend(end.segments());
                    return Ok(Leg { path, end });
                }
            }
            self.search.expand(node, &self.config, problem);
        }
        Err(match self.search.stop() {
            Stop::Enclosed => NoPath::Enclosed,
            Stop::Exhausted => NoPath::Exhausted,
        })
    }

    /// Where the search may go: around start and goal, within the bounds.
    fn domain(&self, problem: &Problem, start: Pose, goal: Pose) -> Aabb {
        let around = Aabb::around([start.position(), goal.position()]);
        let mut domain = around.inflated(self.config.domain_margin);
        if let Some(bounds) = problem.collision.bounds_aabb() {
            domain.min = domain.min.sup(&bounds.min);
            domain.max = domain.max.inf(&bounds.max);
        }
        domain
    }
}

impl Planner for HybridAStar {
    fn name(&self) -> &str {
        "ha-rs"
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let goal = self.goal_set(problem);
        let mut left = budget.max_expansions;
        let leg = self.leg(problem, problem.start, &goal, &mut left);
        let expansions = budget.max_expansions - left;
        match leg {
            Ok(Leg { path, end }) => {
                PlanResult::certified(problem, path, Some(end.tail()), expansions)
            }
            Err(reason) => PlanResult::none(reason, expansions),
        }
    }
}

/// The largest disc around the rear axle inside every footprint, metres.
pub(super) fn inscribed_radius(vehicle: &Vehicle) -> f64 {
    (vehicle.width / 2.0).min(vehicle.rear_overhang).min(vehicle.front_extent())
}
