//! N3P: planning guided by a preparatory pose.
//!
//! [`GuidedPlanner::paper`] is the paper's Algorithm 1: abstraction → cell → one pose →
//! HARS to the pose → HARS from the pose to the goal. [`GuidedPlanner::ranked`] is ours: the
//! manoeuvres the selector knows are ranked, and the first that is free and that a free curve
//! joins is the plan, without any search. Where the first few cannot be joined, the curve straight
//! to the goal is one more way. Where there is none, several poses of the selector are tried, then
//! one search goes to the goal or any of these poses.
//! Either way the path leaves certified by the exact swept check.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::curves::{Path, Segment};
use crate::geometry::{Pose, Vec2};
use crate::planners::cost::CostModel;
use crate::planners::hybrid_astar::{Entry, GoalSet, Leg};
use crate::planners::library::{Library, LibraryPlan, LibrarySearch, Verdicts};
use crate::planners::{
    Budget, Guidance, HybridAStar, HybridAStarConfig, NoPath, PlanResult, Planner, Problem, Route,
};
use crate::world::ParkingType;
use crate::world::abstraction::{Abstraction, abstractions};

use super::{Features, PoseSelector};

/// Expansions that the paper's two legs may spend, so that a pose just beside the feasible
/// ones does not use up what the full search needs.
const LEG_EXPANSIONS: usize = 5_000;
/// Libraries kept prepared: those of the parking types of two vehicles, or of one with two margins.
const LIBRARIES: usize = 6;
/// Known manoeuvres, free in the scene, that `n3p` tries to join before it asks for the curve
/// straight to the goal, and then once more for something cheaper: most plans take the first.
const FIRST_TRIES: usize = 16;
/// Those it tries for something cheaper than the best it found, and by which share at least.
const BETTER: usize = 4;
const GAIN: f64 = 0.1;
/// A plan that costs at most so many times the estimate of the best known one (which knows nothing
/// of joints and obstacles) or the least cost through empty space is taken as it is, unless it
/// passes something near on its way.
const USUAL: f64 = 1.3;
const ENOUGH: f64 = 1.1;
/// Who starts within so many vehicle lengths of the goal may stand within a manoeuvre.
const NEAR_GOAL: f64 = 2.0;
/// Who starts within so many does so as a rule.
const AT_THE_SPOT: f64 = 1.0;
/// Changes of gear that a parallel spot may take more than the curve through empty space.
const TO_AND_FRO: f64 = 4.0;
/// A refined plan that still costs so many times the least is searched for once more, within so
/// many expansions.
const DOUBTFUL: f64 = 2.0;
const SECOND_SEARCH: usize = 1500;
/// The same by a spot that no cell of the model stands for: its manoeuvres may not be made for it.
const UNUSUAL_SEARCH: usize = 20_000;
/// Expansions for something better than a plan that was known.
const PATIENCE: usize = 400;
/// Where the lane begins farther out than this beyond a usual spot's, metres for the default vehicle,
/// manoeuvres are tried that end farther out, too.
const DEEPER: f64 = 0.3;
/// Those it tries where there is no such curve. Each takes some microseconds, together they take a
/// quarter of what a search usually does; generated scenes need 24 of them at most.
const TRIES: usize = 64;
/// Those that it tries to join by a long way round, where no other plan was found.
const LONG_WAYS: usize = 8;

/// What `n3p` tries before it searches. The paper's rows have no such settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RankedConfig {
    /// Whether the selector's known manoeuvres come first.
    pub library: bool,
    /// Ranked poses asked for in each abstraction, 1 to 1000.
    pub candidates: usize,
    /// Abstractions tried, 1 to 1000.
    pub abstractions: usize,
}

impl Default for RankedConfig {
    fn default() -> Self {
        Self { library: true, candidates: 12, abstractions: 3 }
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
    verdicts: Verdicts,
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
            verdicts: Verdicts::default(),
        }
    }

    /// Asks for up to `k` poses for an abstraction of `problem`, in the planning frame.
    fn select(&mut self, problem: &Problem, found: &Abstraction, k: usize) {
        // The cell's frame lies `shift` further out than the problem's.
        let start = Pose { y: problem.start.y - found.shift, ..problem.start };
        self.poses.clear();
        let features = Features::new(start, found.cell);
        self.selector.select(&features, &problem.vehicle, k, &mut self.poses);
        for pose in &mut self.poses {
            pose.y += found.shift;
        }
    }

    /// The cheapest of what is known without a search: manoeuvres of the library prepared last, and
    /// the curve straight to the goal where none of the first can be joined.
    fn look_up(&mut self, problem: &Problem, goal: &GoalSet) -> Option<Known> {
        let Self { libraries, library_search, verdicts, hars, .. } = self;
        let cost = hars.cost(&problem.vehicle);
        let Prepared { library, straights, .. } = &libraries[0];
        verdicts.clear();
        let any = f64::INFINITY;
        let mut look_up = library_search.look_up(library, verdicts, problem, &cost, any);
        let (manoeuvre, curve) = look_up.least_estimates(*straights);
        // Into a bay a curve may lead straight; a parallel spot takes some to and fro as a rule.
        let to_and_fro = match problem.kind {
            Some(ParkingType::Parallel) => TO_AND_FRO * cost.gear_change,
            _ => 0.0,
        };
        let least = manoeuvre.min(curve + to_and_fro);
        let by_manoeuvre = |plan: LibraryPlan| {
            let is_straight = plan.manoeuvre >= *straights;
            let preparatory = (!is_straight).then_some(plan.preparatory);
            let route = if is_straight { Route::Direct } else { Route::Library };
            let guidance = Guidance { preparatory, route };
            Known { path: plan.path, cost: plan.cost, guidance, least }
        };
        let mut best = look_up.next(any, FIRST_TRIES).map(by_manoeuvre);
        if best.is_none() {
            let guidance = Guidance { preparatory: None, route: Route::Direct };
            let direct = hars.direct(problem, problem.start, goal);
            let direct = direct.map(|Leg { path, cost, .. }| Known { path, cost, guidance, least });
            let bound = direct.as_ref().map_or(any, |known| known.cost);
            let tries = if direct.is_some() { FIRST_TRIES } else { TRIES };
            best = look_up.next(bound, tries).map(by_manoeuvre).or(direct);
            best = best.or_else(|| look_up.long_way(any, LONG_WAYS).map(by_manoeuvre));
        }
        // What is estimated to cost less than the best so far may do so.
        while let Some(known) = &best
            && let Some(better) = look_up.next(known.cost * (1.0 - GAIN), BETTER)
        {
            best = Some(by_manoeuvre(better));
        }
        self.from_the_mouth(problem, &cost, best)
    }

    /// The best so far, or a plan by a manoeuvre that ends where a usual bay's goal would be, farther
    /// out, and the straight from there where that costs less.
    fn from_the_mouth(
        &mut self,
        problem: &Problem,
        model: &CostModel,
        mut best: Option<Known>,
    ) -> Option<Known> {
        let [gear] = problem.entry_gears() else { return best };
        if problem.mouth <= DEEPER * problem.vehicle.scale() {
            return best;
        }
        let straight = Segment { length: gear.sign() * problem.mouth, curvature: 0.0 };
        let end = problem.goal.shifted(-straight.length);
        if !problem.collision.segments_are_free(end, &[straight]) {
            return best;
        }
        let Self { libraries, library_search, verdicts, .. } = self;
        let library = &libraries[0].library;
        verdicts.clear();
        let any = f64::INFINITY;
        let in_cost = model.per_metre(*gear) * problem.mouth;
        let mut look_up = library_search.look_up_at(library, verdicts, problem, end, model, any);
        let (least, _) = look_up.least_estimates(library.len());
        let mut tries = FIRST_TRIES;
        loop {
            let bound = best.as_ref().map_or(any, |known| known.cost * (1.0 - GAIN) - in_cost);
            let Some(LibraryPlan { mut path, preparatory, .. }) = look_up.next(bound, tries) else {
                return best;
            };
            path.extend([straight]);
            let cost = model.path(&problem.vehicle, &path.segments);
            let guidance = Guidance { preparatory: Some(preparatory), route: Route::Library };
            let least = best.as_ref().map_or(least + in_cost, |b| b.least.min(least + in_cost));
            best = Some(Known { path, cost, guidance, least });
            tries = BETTER;
        }
    }

    /// Puts the library for `problem` first, prepared if need be, and says whether there is one.
    fn prepare_library(&mut self, problem: &Problem) -> bool {
        let Some(kind) = problem.kind else { return false };
        let fits = |p: &Prepared| p.kind == kind && p.library.fits(problem);
        match self.libraries.iter().position(fits) {
            Some(at) => self.libraries[..=at].rotate_right(1),
            None => {
                let (vehicle, footprint) = (&problem.vehicle, *problem.collision.footprint());
                let manoeuvres = self.selector.manoeuvres(kind, vehicle);
                let cost = self.hars.cost(vehicle);
                let mut library = Library::new(&manoeuvres, vehicle, footprint, &cost);
                let straights = library.len();
                for entry in self.hars.entry_straights(problem) {
                    library.add(entry, &cost);
                }
                self.libraries.truncate(LIBRARIES - 1);
                self.libraries.insert(0, Prepared { kind, library, straights });
            }
        }
        self.libraries[0].straights > 0
    }

    /// The cells found around the spot, the largest first.
    fn cells(&self, problem: &Problem) -> Vec<Abstraction> {
        let of_kind = |kind| abstractions(&problem.obstacles, kind, self.selector.grid());
        problem.kind.map_or_else(Vec::new, of_kind)
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
    /// parked is not sent back to a preparatory pose.
    fn or_direct(&mut self, problem: &Problem, planned: (Path, Guidance)) -> (Path, Guidance) {
        let vehicle = &problem.vehicle;
        let cost = self.hars.cost(vehicle).path(vehicle, &planned.0.segments);
        let goal = self.hars.goal_set(problem);
        match self.hars.direct_below(problem, problem.start, &goal, cost) {
            Some(leg) => (leg.path, Guidance { preparatory: None, route: Route::Direct }),
            None => planned,
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
        left: &mut usize,
    ) -> Result<(Path, Guidance), NoPath> {
        let mut goal = self.hars.goal_set_of_cell(problem, problem.mouth);
        let has_library = config.library && self.prepare_library(problem);
        if has_library && let Some(known) = self.look_up(problem, &goal) {
            return Ok(self.settle(problem, &goal, known, left));
        }
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
            let plain = self.hars.goal_set(problem);
            let known = Known { path: leg.path, cost: leg.cost, guidance, least: 0.0 };
            return Ok(self.settle(problem, &plain, known, left));
        }
        // One search: it begins at the goal and at every preparatory pose.
        let before = *left;
        let leg = self.hars.search(problem, problem.start, &goal, None, left)?;
        let entry = goal.entries().get(leg.entry);
        let by_way = entry.is_some_and(|e| e.preparatory);
        let route = if by_way { Route::Searched } else { Route::Fallback };
        let guidance = guidance(entry, route);
        let plain = self.hars.goal_set(problem);
        let patience = PATIENCE.max(2 * (before - *left));
        Ok((self.hars.refine(problem, &plain, leg.path, patience, left), guidance))
    }

    /// Whether a plan costs no more than usual: what is known of the spot says what it takes; where
    /// that is little, the curve through empty space does.
    fn is_usual(&mut self, problem: &Problem, goal: &GoalSet, known: &Known) -> bool {
        known.cost <= USUAL * known.least
            || known.cost <= ENOUGH * self.hars.lower_bound(problem, goal)
    }

    /// Whether a plan costs more than usual by a spot that no cell of the model stands for.
    fn is_unusually_dear(
        &mut self,
        problem: &Problem,
        goal: &GoalSet,
        cost: f64,
        least: f64,
    ) -> bool {
        cost > USUAL * least
            && cost > ENOUGH * self.hars.lower_bound(problem, goal)
            && (problem.mouth > DEEPER * problem.vehicle.scale() || self.cells(problem).is_empty())
    }

    /// What is known, or the rest of the manoeuvre that the car stands in where that costs less: who
    /// replans on the way goes on.
    fn or_rest(&mut self, problem: &Problem, known: Known) -> Known {
        let library = self.libraries.first().map(|p| &p.library).filter(|l| l.fits(problem));
        let Some(library) = library else { return known };
        let model = self.hars.cost(&problem.vehicle);
        match library.rest(problem, &model) {
            Some((path, cost)) if cost < known.cost => {
                let guidance = Guidance { preparatory: None, route: Route::Library };
                Known { path, cost, guidance, least: known.least }
            }
            _ => known,
        }
    }

    /// The plan by what is known: as it is where it costs little more than it must, else refined.
    fn settle(
        &mut self,
        problem: &Problem,
        goal: &GoalSet,
        mut known: Known,
        left: &mut usize,
    ) -> (Path, Guidance) {
        let is_usual = self.is_usual(problem, goal, &known);
        let apart = problem.start.distance(problem.goal) / problem.vehicle.length;
        let may_go_on = apart < AT_THE_SPOT || (!is_usual && apart < NEAR_GOAL);
        if may_go_on && known.cost > ENOUGH * self.hars.lower_bound(problem, goal) {
            known = self.or_rest(problem, known);
        }
        if is_usual && !self.hars.passes_near(problem, &known.path) {
            return (known.path, known.guidance);
        }
        let Known { path, mut guidance, least, .. } = known;
        let before = *left;
        let mut refined = self.hars.refine(problem, goal, path.clone(), PATIENCE, left);
        let model = self.hars.cost(&problem.vehicle);
        let cost = |path: &Path| model.path(&problem.vehicle, &path.segments);
        let doubtful = refined.direction_changes() > 2 && cost(&refined) > DOUBTFUL * least;
        let is_dear = self.is_unusually_dear(problem, goal, cost(&refined), least);
        if doubtful || is_dear {
            let share = if is_dear { UNUSUAL_SEARCH } else { SECOND_SEARCH }.min(*left);
            let mut spend = share;
            let found = self.hars.search(problem, problem.start, goal, None, &mut spend);
            *left -= share - spend;
            if let Ok(leg) = found {
                let found = self.hars.refine(problem, goal, leg.path, PATIENCE, left);
                if cost(&found) < cost(&refined) {
                    refined = found;
                }
            }
        }
        if refined != path {
            let route = if *left == before { Route::Direct } else { Route::Searched };
            guidance = Guidance { preparatory: None, route };
        }
        (refined, guidance)
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

/// A library made ready for a parking type and a footprint.
struct Prepared {
    kind: ParkingType,
    library: Library,
    /// From this number on its manoeuvres are none but the straight into the spot, or nothing at
    /// all: what joins them is the curve straight to the goal.
    straights: usize,
}

/// A plan that took no search.
struct Known {
    path: Path,
    cost: f64,
    guidance: Guidance,
    /// An estimate of what the best plan costs.
    least: f64,
}

/// A path and how it came about, or none.
type Attempt = Option<(Path, Guidance)>;

impl Planner for GuidedPlanner {
    fn name(&self) -> &str {
        &self.name
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let mut left = budget.max_expansions;
        let planned = match self.strategy {
            Strategy::Paper => match self.plan_paper(problem, &mut left) {
                Some(planned) => Ok(self.or_direct(problem, planned)),
                None => self.fall_back(problem, &mut left),
            },
            Strategy::Ranked(config) => self.plan_ranked(problem, config, &mut left),
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
