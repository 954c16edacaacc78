//! N3P: planning guided by a preparatory pose.
//!
//! [`GuidedPlanner::paper`] is the paper's Algorithm 1: abstraction → cell → one pose →
//! HARS to the pose → HARS from the pose to the goal. [`GuidedPlanner::ranked`] is ours: the
//! manoeuvres the selector knows are ranked, and the first that is free and that a free curve
//! joins is the plan, without any search. Where the first few cannot be joined, the curve straight
//! to the goal is one more way. Where there is none, several poses of the selector are tried, then
//! one search goes to the goal or any of these poses. Who starts within a manoeuvre may drive its rest.
//! Into a parallel spot for which nothing known serves, such as a tighter one, a manoeuvre is made to measure (`exits`).
//! What costs more than usual for its spot and its changes of gear is looked at further, and its corners
//! are cut, as are those of what passes something near. What then is still far from what was foreseen is
//! searched for once more; without foresight, what costs more than twice the estimate, by an unusual spot or
//! with more changes than usual. Where cars come from afar to a goal that nothing bounds, nothing was learnt of
//! what plans cost: there they are bettered by a search, as searched ones are.
//! Either way the path leaves certified by the exact swept check.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::curves::{Path, Segment};
use crate::geometry::{Pose, Vec2};
use crate::planners::exit_manoeuvre::Exit;
use crate::planners::hybrid_astar::{Entry, GoalSet, Leg};
use crate::planners::library::{LibrarySearch, Tried};
use crate::planners::{
    Budget, Effort, Guidance, HybridAStar, HybridAStarConfig, NoPath, PlanResult, Planner, Problem,
    Route,
};
use crate::world::Stance;
use crate::world::abstraction::{Abstraction, abstractions};

use crate::selectors::foresight::Foresight;
use crate::selectors::{Features, PoseSelector};

mod exits;
mod foreseen;
pub(crate) mod known;
mod refined;

use foreseen::Ranking;
use known::{Checked, Known, Prepared, directly};

/// Expansions that the paper's two legs may spend, so that a pose just beside the feasible
/// ones does not use up what the full search needs.
const LEG_EXPANSIONS: usize = 5_000;
/// What `n3p` tries before it searches. The paper's rows have no such settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RankedConfig {
    /// Whether the selector's known manoeuvres come first.
    pub library: bool,
    /// Whether a network says which of them to try first, and when a plan will do.
    pub foresight: bool,
    /// Ranked poses asked for in each abstraction, 1 to 1000.
    pub candidates: usize,
    /// Abstractions tried, 1 to 1000.
    pub abstractions: usize,
}

impl Default for RankedConfig {
    fn default() -> Self {
        Self { library: true, foresight: true, candidates: 12, abstractions: 3 }
    }
}

impl RankedConfig {
    /// Checks every field; the message names it.
    pub fn validate(&self) -> Result<(), String> {
        for (field, value) in [("candidates", self.candidates), ("abstractions", self.abstractions)]
        {
            if !(1..=1000).contains(&value) {
                return Err(format!("{field} is {value}; expected 1 to 1000"));
            }
        }
        Ok(())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Strategy {
    Paper,
    Ranked(RankedConfig),
}

/// N3P over a selector.
pub struct GuidedPlanner {
    name: String,
    strategy: Strategy,
    selector: Arc<dyn PoseSelector>,
    hars: HybridAStar,
    poses: Vec<Pose>,
    /// The selector's manoeuvres, prepared for the parking types and footprints met last, the
    /// latest first.
    libraries: Vec<Prepared>,
    library_search: LibrarySearch,
    checked: Checked,
    foresight: Option<Arc<Foresight>>,
    ranking: Ranking,
    /// How the car may leave the spot, once it was asked for.
    exits: Option<Vec<Exit>>,
}

impl GuidedPlanner {
    /// The paper's Algorithm 1 (`knn-n3p`, `mlp-n3p`): one preparatory pose, two searches.
    pub fn paper(name: &str, selector: Arc<dyn PoseSelector>, config: HybridAStarConfig) -> Self {
        Self::new(name, Strategy::Paper, selector, config)
    }

    /// Ours (`n3p`): known manoeuvres and ranked poses before any search.
    pub fn ranked(
        name: &str,
        selector: Arc<dyn PoseSelector>,
        config: HybridAStarConfig,
        ranked: RankedConfig,
    ) -> Self {
        Self::new(name, Strategy::Ranked(ranked), selector, config)
    }

    fn new(
        name: &str,
        strategy: Strategy,
        selector: Arc<dyn PoseSelector>,
        config: HybridAStarConfig,
    ) -> Self {
        Self {
            name: name.to_owned(),
            strategy,
            selector,
            hars: HybridAStar::new(config),
            poses: Vec::new(),
            libraries: Vec::new(),
            library_search: LibrarySearch::default(),
            checked: Checked::default(),
            foresight: None,
            ranking: Ranking::default(),
            exits: None,
        }
    }

    /// The same with a network that foresees what known manoeuvres are worth.
    pub fn with_foresight(self, foresight: Option<Arc<Foresight>>) -> Self {
        Self { foresight, ..self }
    }

    /// Asks for up to `k` poses for an abstraction of `problem`, in the planning frame.
    fn select(&mut self, problem: &Problem, found: &Abstraction, k: usize) {
        let start = found.in_cell(problem.start);
        self.poses.clear();
        let features = Features::new(start, found.cell);
        self.selector.select(&features, &problem.vehicle, k, &mut self.poses);
        for pose in &mut self.poses {
            *pose = found.from_cell(*pose);
        }
    }

    /// The cells found around the spot, the largest first.
    fn cells(&self, problem: &Problem) -> Vec<Abstraction> {
        let beside = |stance: Stance| {
            abstractions(problem.around_spot(), stance, self.selector.grid(stance.kind()))
        };
        problem.stance().map_or_else(Vec::new, beside)
    }

    fn plan_paper(&mut self, problem: &Problem, left: &mut usize) -> Attempt {
        let found = *self.cells(problem).first()?;
        self.select(problem, &found, 1);
        let pose = *self.poses.first()?;
        if !problem.collision.pose_is_free(pose) {
            return None;
        }
        let share = (*left).min(LEG_EXPANSIONS);
        let mut spend = share;
        let path = self.two_legs(problem, pose, found.shift, &mut spend);
        *left -= share - spend;
        let route = if spend == share { Route::Direct } else { Route::Searched };
        let path = path?;
        Some((path, Guidance { preparatory: Some(pose), route }))
    }

    /// The plan, or the curve straight to the goal where that costs less: a car that is nearly
    /// parked is not sent back to a preparatory pose, and estimates are coarse so near the goal.
    fn or_direct(&mut self, problem: &Problem, known: Known) -> Known {
        let goal = self.hars.goal_set(problem);
        match self.hars.direct_below(problem, problem.start, &goal, known.cost) {
            Some(leg) => Known { foreseen: known.foreseen, ..directly(leg, known.least) },
            None => known,
        }
    }

    /// From the start to `pose` and from there to the goal of the cell.
    fn two_legs(
        &mut self,
        problem: &Problem,
        pose: Pose,
        shift: f64,
        left: &mut usize,
    ) -> Option<Path> {
        let single = GoalSet::single(pose);
        let Leg { mut path, .. } = self.hars.leg(problem, problem.start, &single, left).ok()?;
        let goal = self.hars.goal_set_of_cell(problem, shift);
        path.extend(self.hars.leg(problem, pose, &goal, left).ok()?.path.segments);
        Some(path)
    }

    fn plan_ranked(
        &mut self,
        problem: &Problem,
        config: RankedConfig,
        effort: Effort,
        left: &mut usize,
    ) -> Result<(Path, Guidance), NoPath> {
        let has_library = config.library && self.prepare_library(problem);
        if has_library && let Some(known) = self.look_up(problem) {
            return Ok(self.settle(problem, known, effort, left));
        }
        let goal = self.hars.goal_set(problem);
        let mut goal = self.with_exits(problem, goal);
        for found in self.cells(problem).iter().take(config.abstractions) {
            self.select(problem, found, config.candidates);
            let of_cell = self.hars.goal_set_of_cell(problem, found.shift);
            for i in 0..self.poses.len() {
                let pose = self.poses[i];
                if let Some((pose, rest)) = self.feasible(problem, pose, &of_cell) {
                    let cost = self.hars.cost(&problem.vehicle);
                    goal.add_preparatory(pose, rest, &problem.vehicle, &cost);
                }
            }
        }
        let guidance = |entry: Option<&Entry>, route| Guidance {
            preparatory: entry.filter(|e| e.preparatory).map(|e| e.pose),
            route,
        };
        // Who looked plans up has tried the curve straight to the goal.
        let preparatory = if has_library { goal.only_preparatory() } else { None };
        let untried = if has_library { preparatory.as_ref() } else { Some(&goal) };
        if let Some(untried) = untried
            && let Some(leg) = self.hars.direct(problem, problem.start, untried)
        {
            let guidance = guidance(untried.entries().get(leg.entry), Route::Direct);
            let known = Known::unjudged(leg.path, leg.cost, guidance);
            return Ok(self.settle(problem, known, effort, left));
        }
        // One search: it begins at the goal and at every preparatory pose.
        let before = *left;
        let leg = self.hars.search(problem, problem.start, &goal, None, left)?;
        let entry = goal.entries().get(leg.entry);
        let by_way = entry.is_some_and(|e| e.preparatory);
        let route = if by_way { Route::Searched } else { Route::Fallback };
        let guidance = guidance(entry, route);
        let plain = self.hars.goal_set(problem);
        let spent = before - *left;
        Ok((self.refine(problem, &plain, leg.path, effort, spent, left), guidance))
    }

    /// `pose`, or one beside it, from which a curve leads to the goal, and that curve.
    ///
    /// A pose of the KNN has one unless the scene is tighter than its cell; a pose of the
    /// MLP may miss the feasible set by a little, so it is nudged along and across.
    fn feasible(
        &mut self,
        problem: &Problem,
        pose: Pose,
        goal: &GoalSet,
    ) -> Option<(Pose, Vec<Segment>)> {
        const NUDGES: [(f64, f64, f64); 9] = [
            (0.0, 0.0, 0.0),
            (0.15, 0.0, 0.0),
            (-0.15, 0.0, 0.0),
            (0.0, 0.15, 0.0),
            (0.0, -0.15, 0.0),
            (0.0, 0.0, 0.05),
            (0.0, 0.0, -0.05),
            (0.4, 0.0, 0.0),
            (-0.4, 0.0, 0.0),
        ];
        NUDGES.iter().find_map(|&(along, across, turn)| {
            let scale = problem.vehicle.scale();
            let p = pose.point_to_parent(Vec2::new(along, across) * scale);
            let nudged = Pose::new(p.x, p.y, pose.heading + turn);
            if !problem.collision.pose_is_free(nudged) {
                return None;
            }
            let connection = self.hars.connect(problem, nudged, goal)?;
            Some((nudged, connection.segments().collect()))
        })
    }

    fn fall_back(
        &mut self,
        problem: &Problem,
        left: &mut usize,
    ) -> Result<(Path, Guidance), NoPath> {
        let goal = self.hars.goal_set(problem);
        let leg = self.hars.leg(problem, problem.start, &goal, left)?;
        let guidance = Guidance { preparatory: None, route: Route::Fallback };
        Ok((leg.path, guidance))
    }
}

/// A path and how it came about, or none.
type Attempt = Option<(Path, Guidance)>;

impl Planner for GuidedPlanner {
    fn name(&self) -> &str {
        &self.name
    }

    fn config(&self) -> HybridAStarConfig {
        *self.hars.config()
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let mut left = budget.max_expansions;
        self.exits = None;
        let planned = match self.strategy {
            Strategy::Paper => match self.plan_paper(problem, &mut left) {
                Some((path, guidance)) => {
                    let cost = self.path_cost(problem, &path);
                    let known = Known::unjudged(path, cost, guidance);
                    let Known { path, guidance, .. } = self.or_direct(problem, known);
                    Ok((path, guidance))
                }
                None => self.fall_back(problem, &mut left),
            },
            Strategy::Ranked(config) => {
                let at_first = budget.effort.min(Effort::Usual);
                let planned = self.plan_ranked(problem, config, at_first, &mut left);
                match budget.effort {
                    Effort::First | Effort::Usual => planned,
                    Effort::Most => planned.map(|p| self.look_again(problem, p, &mut left)),
                }
            }
        };
        match planned {
            Ok((path, guidance)) => {
                let result = self.certify(problem, path, guidance, budget, left);
                // A refused candidate is not the end: a search may still find a way.
                if result.outcome == Err(NoPath::Uncertified)
                    && let Ok((path, guidance)) = self.fall_back(problem, &mut left)
                {
                    return self.certify(problem, path, guidance, budget, left);
                }
                result
            }
            Err(reason) => PlanResult::none(reason, budget.max_expansions - left),
        }
    }
}

impl GuidedPlanner {
    /// What [`Planner::plan`] says, and the known manoeuvres that it tried, in that order: for those who
    /// explain a plan.
    pub fn plan_and_tell(&mut self, problem: &Problem, budget: Budget) -> (PlanResult, Vec<Tried>) {
        self.library_search.keep_trail();
        let result = self.plan(problem, budget);
        (result, self.library_search.take_trail())
    }

    /// The result with `path`, which is checked.
    fn certify(
        &self,
        problem: &Problem,
        path: Path,
        mut guidance: Guidance,
        budget: Budget,
        left: usize,
    ) -> PlanResult {
        if guidance.route == Route::Fallback {
            guidance.route = match problem.kind {
                None => Route::NoSpot,
                Some(_) if self.cells(problem).is_empty() => Route::NoLane,
                Some(_) => Route::Fallback,
            };
        }
        let result = PlanResult::certified(problem, path, budget.max_expansions - left);
        PlanResult { guidance: Some(guidance), ..result }
    }
}
