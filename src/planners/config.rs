//! Settings of the Hybrid A* methods, and what they share.

use serde::{Deserialize, Serialize};

use crate::geometry::{Aabb, Pose, signed_angle};
use crate::vehicle::Vehicle;

use super::analytic::GoalSet;
use super::cost::CostModel;
use super::multi_heuristic::MultiHeuristicConfig;
use super::{NoPath, Problem};

/// Goals farther than this from the start are not searched for, metres for the default vehicle: 200,000
/// motions lead hardly farther, and lattices are tables of where they may go.
const FARTHEST_GOAL: f64 = 20_000.0;
/// Nobody goes round an obstacle by more than this, metres for the default vehicle.
const FARTHEST_ROUND: f64 = 5_000.0;

/// Settings of the search; lengths are those for the default vehicle (see [`Vehicle::scale`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HybridAStarConfig {
    /// The cost of driving.
    pub cost: CostModel,
    /// The lattices, coarse to fine: each is tried when the one before is exhausted or has
    /// spent half of what was left of the budget.
    pub resolutions: [Resolution; 3],
    /// Side of a cell of the A* cost-to-go, metres.
    pub cost_to_go_cell: f64,
    /// A search stays within the box of start and goal grown by this, metres, as long as there
    /// may be a way.
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
    /// What counts as arrived for the method `ha`, which has no curves to arrive exactly.
    pub goal_region: GoalRegion,
    /// The queues of the method `mhha`.
    pub multi_heuristic: MultiHeuristicConfig,
}

/// How near a search without curves must come before its path may be bent to fit (see
/// `joint.rs`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GoalRegion {
    /// Largest distance, metres.
    pub position: f64,
    /// Largest difference of headings, radians.
    pub heading: f64,
}

impl Default for GoalRegion {
    fn default() -> Self {
        Self { position: 0.25, heading: 5_f64.to_radians() }
    }
}

impl GoalRegion {
    /// Whether `pose` lies in the region around `target`.
    pub fn contains(&self, target: Pose, pose: Pose) -> bool {
        pose.distance(target) <= self.position
            && signed_angle(target.heading, pose.heading).abs() <= self.heading
    }
}

/// How finely a search looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resolution {
    /// Side of a lattice cell, metres.
    pub cell: f64,
    /// Heading bins of the lattice.
    pub headings: usize,
    /// Arc length of a motion primitive, metres.
    pub step: f64,
    /// Steering angles of the primitives, evenly spaced from full left to full right.
    pub steers: usize,
}

impl Resolution {
    fn validate(&self) -> Result<(), String> {
        let number = |field: &str, v: f64, low: f64, high: f64| {
            if (low..=high).contains(&v) {
                return Ok(());
            }
            Err(format!("resolutions.{field} is {v}; expected a number from {low} to {high}"))
        };
        number("cell", self.cell, 0.02, 5.0)?;
        number("headings", self.headings as f64, 8.0, 1440.0)?;
        number("step", self.step, 0.02, 10.0)?;
        number("steers", self.steers as f64, 3.0, 63.0)?;
        if self.steers.is_multiple_of(2) {
            let steers = self.steers;
            return Err(format!("resolutions.steers is {steers}; expected an odd number"));
        }
        Ok(())
    }
}

impl Resolution {
    /// Strides twice as long: a long way round takes a quarter of the states.
    fn doubled(&self) -> Self {
        Self { cell: 2.0 * self.cell, step: 2.0 * self.step, ..*self }
    }
}

impl Default for HybridAStarConfig {
    fn default() -> Self {
        Self {
            cost: CostModel::default(),
            resolutions: [
                Resolution { cell: 0.25, headings: 120, step: 0.4, steers: 5 },
                Resolution { cell: 0.05, headings: 360, step: 0.2, steers: 3 },
                Resolution { cell: 0.02, headings: 720, step: 0.05, steers: 3 },
            ],
            cost_to_go_cell: 0.5,
            domain_margin: 12.0,
            entry_straight: true,
            entry_step: 1.0,
            entry_max: 5.0,
            heuristic_weight: 1.0,
            goal_region: GoalRegion::default(),
            multi_heuristic: MultiHeuristicConfig::default(),
        }
    }
}

impl HybridAStarConfig {
    /// Checks every field; the error says field (below the table of these settings), value and
    /// what would be right.
    pub fn validate(&self) -> Result<(), String> {
        self.cost.validate()?;
        for (field, v, low, high) in [
            ("cost_to_go_cell", self.cost_to_go_cell, 0.05, 5.0),
            ("domain_margin", self.domain_margin, 1.0, 1000.0),
            ("entry_step", self.entry_step, 0.05, 10.0),
            ("entry_max", self.entry_max, 0.0, 50.0),
            ("heuristic_weight", self.heuristic_weight, 0.0, 100.0),
            ("goal_region.position", self.goal_region.position, 0.01, 5.0),
            ("goal_region.heading", self.goal_region.heading, 0.001, 1.6),
            ("multi_heuristic.slack", self.multi_heuristic.slack, 1.0, 100.0),
            ("multi_heuristic.inflation", self.multi_heuristic.inflation, 0.0, 100.0),
            ("multi_heuristic.depth", self.multi_heuristic.depth, 0.0, 100.0),
        ] {
            if !(v.is_finite() && (low..=high).contains(&v)) {
                return Err(format!("{field} is {v}; expected a number from {low} to {high}"));
            }
        }
        self.resolutions.iter().try_for_each(Resolution::validate)
    }

    /// These settings with the lengths for `vehicle`.
    pub fn for_vehicle(&self, vehicle: &Vehicle) -> Self {
        let scale = vehicle.scale();
        let resolution =
            |r: Resolution| Resolution { cell: r.cell * scale, step: r.step * scale, ..r };
        let position = self.goal_region.position * scale;
        Self {
            cost: self.cost.scaled(scale),
            resolutions: self.resolutions.map(resolution),
            cost_to_go_cell: self.cost_to_go_cell * scale,
            domain_margin: self.domain_margin * scale,
            entry_step: self.entry_step * scale,
            entry_max: self.entry_max * scale,
            goal_region: GoalRegion { position, ..self.goal_region },
            ..*self
        }
    }

    /// [`HybridAStarConfig::for_vehicle`]; fails where settings are out of their ranges or the goal is too far
    /// for any search, before anything is sized by them.
    pub(super) fn for_search(&self, problem: &Problem) -> Result<Self, NoPath> {
        let Problem { vehicle, start, goal, .. } = problem;
        if self.validate().is_err() {
            return Err(NoPath::Failed("settings out of range"));
        }
        if start.distance(*goal) > FARTHEST_GOAL * vehicle.scale() {
            return Err(NoPath::Failed("the goal is too far for a search"));
        }
        Ok(self.for_vehicle(vehicle))
    }

    /// The goal of `problem` with the entry straights that are free; where the lane begins farther
    /// out than beside a usual spot also those that begin as much farther out.
    pub(super) fn goal_set(&self, problem: &Problem) -> GoalSet {
        let mut goal = GoalSet::single(problem.goal);
        self.add_straights(problem, 0.0, &mut goal);
        if problem.mouth > 0.0 {
            self.add_straights(problem, problem.mouth, &mut goal);
        }
        goal
    }

    /// Adds the free entry straights of `offset` plus a multiple of the step, metres.
    pub(super) fn add_straights(&self, problem: &Problem, offset: f64, goal: &mut GoalSet) {
        if self.entry_straight {
            let (step, longest) = (self.entry_step, self.entry_max);
            goal.add_straights(problem, &self.cost, offset, step, longest);
        }
    }

    /// Where a search may go, one box after another: around start and goal; farther around them;
    /// around all obstacles, beyond which nothing is in the way, but no more than [`FARTHEST_ROUND`] around
    /// start and goal. All within the bounds.
    pub(super) fn domains(&self, problem: &Problem, start: Pose, goal: Pose) -> Vec<Aabb> {
        let ends = Aabb::around([start.position(), goal.position()]);
        let near = ends.inflated(self.domain_margin);
        let farther = ends.inflated(4.0 * self.domain_margin);
        let farthest = ends.inflated(FARTHEST_ROUND * problem.vehicle.scale());
        let obstacles = problem.collision.obstacles_aabb().inflated(self.domain_margin);
        let whole = Aabb { min: near.min.inf(&obstacles.min), max: near.max.sup(&obstacles.max) };
        let within = |mut domain: Aabb| {
            if let Some(bounds) = problem.collision.bounds_aabb() {
                domain.min = domain.min.sup(&bounds.min);
                domain.max = domain.max.inf(&bounds.max);
            }
            domain
        };
        let common = |a: Aabb, b: Aabb| Aabb { min: a.min.sup(&b.min), max: a.max.inf(&b.max) };
        let mut domains = vec![within(near)];
        for larger in [within(common(farther, whole)), within(common(farthest, whole))] {
            if domains.last() != Some(&larger) {
                domains.push(larger);
            }
        }
        domains
    }

    /// Runs `search` on each lattice, coarse to fine, until it finds something or the goal
    /// turns out to be enclosed. `expansions` is reduced by what was spent: finer lattices
    /// are left their share even when a coarse one goes on and on.
    ///
    /// On each lattice the domain grows while there is no way within it; and a search that does
    /// not come to an end soon begins anew, careful of where the car fits (`fitting_cost_to_go`) and, on the
    /// coarsest lattice, in strides twice as long. Where even that does not come to an end, the finest lattice
    /// would not either: if `either_way` will do, such strides are tried from the start to the goal first, since
    /// it may be the start that is hard to come by.
    pub(super) fn coarse_to_fine<T>(
        &self,
        domains: &[Aabb],
        either_way: bool,
        expansions: &mut usize,
        mut search: impl FnMut(Attempt, &mut usize) -> Result<T, NoPath>,
    ) -> Result<T, NoPath> {
        /// The least that a first look takes.
        const LEAST: usize = 300;
        /// Who may spend less has no use for a wave that takes as long as some thousand expansions.
        const CAREFUL: usize = 10_000;
        // Of what a lattice may spend, the part for the first look. Who closes the way by no curve takes longer.
        let first_look = if either_way { 16 } else { 8 };
        let mut result = Err(NoPath::BudgetSpent);
        let mut domain = 0;
        for (i, resolution) in self.resolutions.iter().enumerate() {
            let last = i + 1 == self.resolutions.len();
            let reserve = if last { 0 } else { *expansions / 2 };
            *expansions -= reserve;
            if last && either_way && matches!(result, Err(NoPath::BudgetSpent)) {
                let (resolution, domain) = (&self.resolutions[0].doubled(), domains[domain]);
                let (config, careful) = (self, *expansions >= CAREFUL);
                let from_start = Attempt { config, resolution, domain, careful, from_start: true };
                result = search(from_start, expansions);
                if result.is_ok() {
                    break;
                }
            }
            loop {
                let later = *expansions - (*expansions / first_look).max(LEAST).min(*expansions);
                *expansions -= later;
                let (config, within) = (self, domains[domain]);
                let first = Attempt {
                    config,
                    resolution,
                    domain: within,
                    careful: false,
                    from_start: false,
                };
                result = search(first, expansions);
                *expansions += later;
                let grows = domain + 1 < domains.len();
                match result {
                    Err(NoPath::Enclosed | NoPath::Exhausted) if grows => domain += 1,
                    Err(NoPath::BudgetSpent) => {
                        domain += usize::from(grows);
                        let strides = resolution.doubled();
                        let again = Attempt {
                            resolution: if i == 0 { &strides } else { resolution },
                            domain: domains[domain],
                            careful: *expansions >= CAREFUL,
                            ..first
                        };
                        result = search(again, expansions);
                        if !matches!(result, Err(NoPath::Enclosed | NoPath::Exhausted))
                            || domain + 1 == domains.len()
                        {
                            break;
                        }
                        domain += 1;
                    }
                    _ => break,
                }
            }
            *expansions += reserve;
            if !matches!(result, Err(NoPath::BudgetSpent | NoPath::Exhausted)) {
                break;
            }
        }
        result
    }
}

/// One search of several for the same path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attempt<'a> {
    /// The settings for the vehicle.
    pub config: &'a HybridAStarConfig,
    /// How finely it looks.
    pub resolution: &'a Resolution,
    /// Where it may go.
    pub domain: Aabb,
    /// Whether its cost-to-go is that of a car that fits where it goes.
    pub careful: bool,
    /// Whether it runs from the start to the goal, instead of from the goal to the start.
    pub from_start: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn the_goal_region_has_the_tolerances_it_says() {
        let region = GoalRegion { position: 0.2, heading: 0.1 };
        let target = Pose::new(1.0, 2.0, PI - 0.02);
        let within = |dx, dy, turn| {
            region.contains(target, Pose::new(1.0 + dx, 2.0 + dy, target.heading + turn))
        };
        assert!(within(0.0, 0.0, 0.0) && within(0.19, 0.0, -0.09) && within(0.1, -0.1, 0.09));
        assert!(!within(0.15, 0.15, 0.0) && !within(0.0, 0.0, 0.11) && !within(0.0, 0.0, PI));
        // Beyond π the heading begins again at −π.
        assert!(region.contains(target, Pose { heading: 0.05 - PI, ..target }));
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let mut config = HybridAStarConfig::default();
        assert_eq!(config.validate(), Ok(()));
        config.goal_region.position = f64::NAN;
        assert!(config.validate().unwrap_err().starts_with("goal_region.position is NaN"));
        config = HybridAStarConfig::default();
        config.multi_heuristic.slack = 0.5;
        assert!(config.validate().unwrap_err().starts_with("multi_heuristic.slack is 0.5"));
    }
}
