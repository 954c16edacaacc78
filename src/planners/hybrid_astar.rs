//! Hybrid A* with Reeds-Shepp expansion (HARS), the method `ha-rs`.
//!
//! D. Dolgov, S. Thrun, M. Montemerlo, J. Diebel, "Practical Search Techniques in Path
//! Planning for Autonomous Driving", 2008: a best-first search over a lattice whose cells
//! keep continuous poses, guided by the larger of two cost-to-go heuristics, and ended by
//! the first Reeds-Shepp curve that closes the way without contact.
//!
//! Ours runs from the goal to the start (see `search.rs`): measured on the cells of
//! tight bays this takes 10 to 100 times fewer expansions than the other way round. When
//! a coarse lattice is exhausted, as in a parallel spot barely longer than the car, a finer
//! one gets its turn.

use crate::curves::reeds_shepp::Word;
use crate::curves::{Path, Segment};
use crate::geometry::{Aabb, Pose};
use crate::vehicle::Vehicle;

use super::analytic::{AnalyticExpansion, AnalyticTail, lower_bound};
pub(crate) use super::analytic::{Connection, Entry, GoalSet};
use super::config::{Attempt, HybridAStarConfig};
use super::cost::CostModel;
use super::multi_heuristic::Guides;
use super::nearness::Nearness;
use super::search::{NodeIndex, Search};
use super::shortcut::Shortcuts;
use super::{Budget, Effort, NoPath, PlanResult, Planner, Problem};

/// Hybrid A* with Reeds-Shepp expansion: the methods `ha-rs` and `ha-hold`.
#[derive(Debug)]
pub struct HybridAStar {
    config: HybridAStarConfig,
    /// Solutions to look at before the cheapest is returned.
    solutions: usize,
    queue: Search,
    analytic: AnalyticExpansion,
    shortcuts: Shortcuts,
    /// Looks for something cheaper than a plan: several queues find other ways soonest.
    improver: Search,
    words: Vec<Word>,
}

/// What one search found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Leg {
    /// The path from the leg's start to its goal.
    pub path: Path,
    /// Its cost.
    pub cost: f64,
    /// The goal-set entry it goes through.
    pub entry: usize,
}

impl HybridAStar {
    /// `ha-rs`: the first solution found. Buffers grow at first use.
    pub fn new(config: HybridAStarConfig) -> Self {
        Self::hold(config, 1)
    }

    /// The cheapest of the first `solutions` found (fewer where nothing cheaper can follow);
    /// with five the paper's HA* Hold, the method `ha-hold`.
    pub fn hold(config: HybridAStarConfig, solutions: usize) -> Self {
        Self {
            config,
            solutions: solutions.max(1),
            queue: Search::default(),
            analytic: AnalyticExpansion::default(),
            shortcuts: Shortcuts::default(),
            improver: Search::guided(Guides::new(config.multi_heuristic)),
            words: Vec::new(),
        }
    }

    /// The first solution found by a search with several queues (see `multi_heuristic.rs`).
    pub(super) fn guided(config: HybridAStarConfig) -> Self {
        let queue = Search::guided(Guides::new(config.multi_heuristic));
        Self { queue, ..Self::new(config) }
    }

    /// The settings.
    pub fn config(&self) -> &HybridAStarConfig {
        &self.config
    }

    /// The goal of `problem` with the entry straights that are free.
    pub(crate) fn goal_set(&self, problem: &Problem) -> GoalSet {
        self.config.for_vehicle(&problem.vehicle).goal_set(problem)
    }

    /// The cost of driving `vehicle`.
    pub(crate) fn cost(&self, vehicle: &Vehicle) -> CostModel {
        self.config.cost.scaled(vehicle.scale())
    }

    /// The ways into the goal of a problem like this that are no manoeuvres: nothing at all, and the
    /// straights, free or not.
    pub(crate) fn entry_straights(&self, problem: &Problem) -> Vec<Vec<Segment>> {
        let config = self.config.for_vehicle(&problem.vehicle);
        let mut entries = vec![Vec::new()];
        if config.entry_straight {
            let steps = (config.entry_max / config.entry_step + 1e-9).clamp(0.0, 1000.0) as u32;
            for gear in problem.entry_gears() {
                let length = |i| gear.sign() * f64::from(i) * config.entry_step;
                entries.extend((1..=steps).map(|i| vec![Segment::straight(length(i))]));
            }
        }
        entries
    }

    /// [`HybridAStar::goal_set`] that also has the entries of a cell whose goal lies `shift`
    /// metres further out.
    pub(crate) fn goal_set_of_cell(&self, problem: &Problem, shift: f64) -> GoalSet {
        let mut goal = self.goal_set(problem);
        if shift > 0.0 {
            self.config.for_vehicle(&problem.vehicle).add_straights(problem, shift, &mut goal);
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
        self.connect_below(problem, from, goal, f64::INFINITY)
    }

    /// [`HybridAStar::connect`] at a cost of less than `bound`.
    pub(crate) fn connect_below<'a>(
        &mut self,
        problem: &Problem,
        from: Pose,
        goal: &'a GoalSet,
        bound: f64,
    ) -> Option<Connection<'a>> {
        let cost = self.cost(&problem.vehicle);
        self.analytic.connect(from, goal, bound, problem, &cost)
    }

    /// Searches from `start` to `goal` within `expansions`, which is reduced by what was
    /// spent. The cost-to-go is computed only when the first curve fails.
    pub(crate) fn leg(
        &mut self,
        problem: &Problem,
        start: Pose,
        goal: &GoalSet,
        expansions: &mut usize,
    ) -> Result<Leg, NoPath> {
        let direct = self.direct(problem, start, goal);
        match direct {
            Some(leg) if self.solutions == 1 => Ok(leg),
            _ => self.search(problem, start, goal, direct, expansions),
        }
    }

    /// A leg that is one curve and the rest of an entry.
    pub(crate) fn direct(&mut self, problem: &Problem, start: Pose, goal: &GoalSet) -> Option<Leg> {
        self.direct_below(problem, start, goal, f64::INFINITY)
    }

    /// [`HybridAStar::direct`] at a cost of less than `bound`.
    pub(crate) fn direct_below(
        &mut self,
        problem: &Problem,
        start: Pose,
        goal: &GoalSet,
        bound: f64,
    ) -> Option<Leg> {
        let c = self.connect_below(problem, start, goal, bound)?;
        Some(Leg { path: Path::new(start, c.segments()), cost: c.cost, entry: c.entry_index })
    }

    /// [`HybridAStar::leg`] beyond the `direct` solution, if there is one.
    pub(crate) fn search(
        &mut self,
        problem: &Problem,
        start: Pose,
        goal: &GoalSet,
        direct: Option<Leg>,
        expansions: &mut usize,
    ) -> Result<Leg, NoPath> {
        let config = self.config.for_search(problem)?;
        let domains = config.domains(problem, start, goal.pose);
        self.search_in(&domains, problem, start, goal, direct, expansions)
    }

    /// [`HybridAStar::search`] on lattices that lie half a cell aside: of two first solutions in a tight
    /// place one may be much the better.
    pub(crate) fn search_aside(
        &mut self,
        problem: &Problem,
        start: Pose,
        goal: &GoalSet,
        expansions: &mut usize,
    ) -> Result<Leg, NoPath> {
        let config = self.config.for_search(problem)?;
        let half = config.resolutions[0].cell / 2.0;
        let mut domains = config.domains(problem, start, goal.pose);
        domains.iter_mut().for_each(|domain| *domain = domain.inflated(half));
        self.search_in(&domains, problem, start, goal, None, expansions)
    }

    fn search_in(
        &mut self,
        domains: &[Aabb],
        problem: &Problem,
        start: Pose,
        goal: &GoalSet,
        direct: Option<Leg>,
        expansions: &mut usize,
    ) -> Result<Leg, NoPath> {
        let mut best = direct;
        let config = self.config.for_search(problem)?;
        let result = config.coarse_to_fine(domains, true, expansions, |attempt, expansions| {
            let result = if attempt.from_start {
                self.search_from_start(attempt, problem, start, goal, &mut best, expansions)
            } else {
                self.search_leg(attempt, problem, start, goal, &mut best, expansions)
            };
            if best.is_some() { Ok(()) } else { result }
        });
        result.map(|()| best.expect("a search that succeeds leaves a leg"))
    }

    /// One search at one resolution, for something cheaper than `best`.
    fn search_leg(
        &mut self,
        attempt: Attempt,
        problem: &Problem,
        start: Pose,
        goal: &GoalSet,
        best: &mut Option<Leg>,
        expansions: &mut usize,
    ) -> Result<(), NoPath> {
        let mut wanted = self.solutions - usize::from(best.is_some());
        let model = &attempt.config.cost;
        self.queue.begin(attempt, problem, start, goal);
        while let Some(node) = self.queue.pop() {
            let bound = best.as_ref().map_or(f64::INFINITY, |leg| leg.cost);
            if self.queue.estimate(node) >= bound {
                return Ok(());
            }
            if *expansions == 0 {
                return Err(NoPath::BudgetSpent);
            }
            *expansions -= 1;
            if self.queue.wants_curve(node)
                && let Some(leg) =
                    close(&self.queue, &mut self.analytic, problem, goal, node, bound, model)
            {
                *best = Some(leg);
                wanted -= 1;
                if wanted == 0 {
                    return Ok(());
                }
            }
            self.queue.expand(node, goal, attempt.config, problem);
        }
        Err(self.queue.stop())
    }

    /// The same from the start to the goal itself: the way back, driven in reverse.
    fn search_from_start(
        &mut self,
        attempt: Attempt,
        problem: &Problem,
        start: Pose,
        goal: &GoalSet,
        best: &mut Option<Leg>,
        expansions: &mut usize,
    ) -> Result<(), NoPath> {
        let entry = &goal.entries()[0];
        let mut back = None;
        let back_to = GoalSet::single(start);
        let result = self.search_leg(attempt, problem, entry.pose, &back_to, &mut back, expansions);
        if let Some(back) = back {
            let mut path = back.path.reversed();
            path.extend(entry.rest.iter().copied());
            let path = Path { start, ..path };
            let cost = attempt.config.cost.path(&problem.vehicle, &path.segments);
            *best = Some(Leg { path, cost, entry: 0 });
        }
        result
    }

    /// One search from the start of `problem` for something cheaper than `best`, until nothing much
    /// cheaper can follow or the expansions are spent.
    fn improve(
        &mut self,
        attempt: Attempt,
        problem: &Problem,
        goal: &GoalSet,
        best: &mut Option<Leg>,
        enough: f64,
        expansions: &mut usize,
    ) {
        let Self { improver, analytic, .. } = self;
        let model = &attempt.config.cost;
        improver.begin(attempt, problem, problem.start, goal);
        while let Some(node) = improver.pop() {
            let bound = best.as_ref().map_or(f64::INFINITY, |leg| leg.cost);
            if *expansions == 0 {
                return;
            }
            *expansions -= 1;
            // Nothing much cheaper leads through this node.
            if improver.estimate(node) * enough >= bound {
                continue;
            }
            if improver.wants_curve(node)
                && let Some(leg) = close(improver, analytic, problem, goal, node, bound, model)
            {
                *best = Some(leg);
            }
            improver.expand(node, goal, attempt.config, problem);
        }
    }

    /// Whether `path` passes something nearer than is comfortable, away from start and goal.
    pub(crate) fn passes_near(&self, problem: &Problem, path: &Path) -> bool {
        Nearness::new(problem, &self.cost(&problem.vehicle)).is_met_on_the_way(path)
    }

    /// What any path into `goal` costs at least, obstacles aside.
    pub(crate) fn lower_bound(&mut self, problem: &Problem, goal: &GoalSet) -> f64 {
        let model = self.cost(&problem.vehicle);
        lower_bound(problem.start, goal, &problem.vehicle, &model, &mut self.words)
    }

    /// `path` with its corners cut where that makes it cheaper, and its cost with nearness.
    pub(crate) fn cut(&mut self, problem: &Problem, path: Path) -> (Path, f64) {
        let model = self.cost(&problem.vehicle);
        let estimates = self.queue.curve_estimates(&problem.vehicle, &model);
        self.shortcuts.cut(problem, &model, estimates, path)
    }

    /// `path`, found with `spent` expansions or known without a search, or a better one: its corners are cut, and where it still
    /// costs much more than it must, a search looks for something cheaper, as long as the `effort`
    /// says.
    pub(crate) fn refine(
        &mut self,
        problem: &Problem,
        goal: &GoalSet,
        path: Path,
        effort: Effort,
        spent: Option<usize>,
        left: &mut usize,
    ) -> Path {
        let path = match effort {
            Effort::First => return path,
            Effort::Usual => path,
            Effort::Most => self.refine(problem, goal, path, Effort::Usual, spent, left),
        };
        let (path, cost) = self.cut(problem, path);
        if cost <= effort.enough() * self.lower_bound(problem, goal) {
            return path;
        }
        let Ok(config) = self.config.for_search(problem) else { return path };
        let mut domain = config.domains(problem, problem.start, goal.pose)[0];
        if spent.is_some_and(|spent| spent > 0) {
            // Half a cell aside of the lattice that the path comes from: what that one misses is found.
            domain = domain.inflated(config.resolutions[0].cell / 2.0);
        }
        let resolution = &config.resolutions[0];
        let attempt =
            Attempt { config: &config, resolution, domain, careful: false, from_start: false };
        let share = effort.patience(spent, *left);
        let mut spend = share;
        let mut best = Some(Leg { path: path.clone(), cost, entry: 0 });
        self.improve(attempt, problem, goal, &mut best, effort.enough(), &mut spend);
        *left -= share - spend;
        let Some(found) = best.filter(|leg| leg.path != path) else { return path };
        let (found, found_cost) = self.cut(problem, found.path);
        if found_cost < cost { found } else { path }
    }

    /// The preparatory pose of a solved `path`, and the curve from there to the goal.
    ///
    /// Like the paper's x_rs it is a pose of the path from which a Reeds-Shepp curve (and an
    /// entry straight) reaches the goal without contact. Among these poses, `snap`ped, one
    /// that a curve from the start reaches as well is preferred, so that two curves are the
    /// whole plan: the one of least cost, and of equals the one where the parking manoeuvre
    /// begins (the first change of gear, or, without any, the last turn).
    ///
    /// The curve to the goal is free in `cell`; its goal is that of `problem`, whose free space may
    /// be larger.
    pub fn preparatory_tail(
        &mut self,
        problem: &Problem,
        cell: &Problem,
        path: &Path,
        snap: impl Fn(Pose) -> Pose,
    ) -> Option<AnalyticTail> {
        const SPACING: f64 = 0.5;
        /// Cheaper by less than this counts as equal.
        const EQUAL: f64 = 0.05;
        let goal = self.goal_set(cell);
        let (approach, manoeuvre) = path.split_at(manoeuvre_begin(path));
        let later = manoeuvre.sample(SPACING).into_iter();
        let earlier = approach.sample(SPACING).into_iter().rev();
        let mut one_curve = None;
        let mut two_curves: Option<(f64, AnalyticTail)> = None;
        for sample in later.chain(earlier) {
            let pose = snap(sample.pose);
            if !cell.collision.pose_is_free(pose) {
                continue;
            }
            let Some(tail) = self.connect(cell, pose, &goal).map(|c| c.tail()) else { continue };
            one_curve = one_curve.or(Some(tail));
            let Some(leg) = self.direct(problem, path.start, &GoalSet::single(pose)) else {
                continue;
            };
            let mut whole = leg.path;
            whole.extend(tail.segments());
            let cost = self.cost(&problem.vehicle).path(&problem.vehicle, &whole.segments);
            if two_curves.is_none_or(|(best, _)| cost < best - EQUAL) {
                two_curves = Some((cost, tail));
            }
        }
        two_curves.map(|(_, tail)| tail).or(one_curve)
    }

    /// The end of a solved `path`: the motions to the goal from the pose, among those where
    /// the path's curvature or gear changes, that one curve from the start joins at the least
    /// cost. What lies before it is replaceable by that curve from starts nearby as well.
    pub fn manoeuvre(&mut self, problem: &Problem, path: &Path) -> Option<Vec<Segment>> {
        let cost = self.cost(&problem.vehicle);
        let mut best: Option<(f64, usize)> = None;
        for (i, (pose, _)) in path.legs().enumerate() {
            let Some(mut leg) = self.direct(problem, path.start, &GoalSet::single(pose)) else {
                continue;
            };
            leg.path.extend(path.segments[i..].iter().copied());
            let total = cost.path(&problem.vehicle, &leg.path.segments);
            if best.is_none_or(|(least, _)| total < least) {
                best = Some((total, i));
            }
        }
        best.map(|(_, i)| path.segments[i..].to_vec())
    }
}

impl Planner for HybridAStar {
    fn name(&self) -> &str {
        if self.solutions == 1 { "ha-rs" } else { "ha-hold" }
    }

    fn config(&self) -> HybridAStarConfig {
        self.config
    }

    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult {
        let goal = self.goal_set(problem);
        let mut left = budget.max_expansions;
        let leg = self.leg(problem, problem.start, &goal, &mut left);
        let spent = budget.max_expansions - left;
        let effort = budget.effort;
        let path =
            leg.map(|leg| self.refine(problem, &goal, leg.path, effort, Some(spent), &mut left));
        let expansions = budget.max_expansions - left;
        match path {
            Ok(path) => PlanResult::certified(problem, path, expansions),
            Err(reason) => PlanResult::none(reason, expansions),
        }
    }
}

/// The path by a curve from the start of a search to `node` and the way on from there, if it is free
/// and costs less than `bound`.
fn close(
    queue: &Search,
    analytic: &mut AnalyticExpansion,
    problem: &Problem,
    goal: &GoalSet,
    node: NodeIndex,
    bound: f64,
    model: &CostModel,
) -> Option<Leg> {
    let (start, to, departure) = (queue.start(), queue.pose(node), queue.departure(node, goal));
    let way_cost = queue.cost(node);
    let (word, cost) = analytic.curve(start, to, departure, bound - way_cost, problem, model)?;
    let (way, entry) = queue.way(node);
    let mut path = Path::new(start, word.segments().iter().copied());
    path.extend(way);
    path.extend(goal.entries()[entry].rest.iter().copied());
    Some(Leg { path, cost: way_cost + cost, entry })
}

/// Index of the segment that the parking manoeuvre begins with.
fn manoeuvre_begin(path: &Path) -> usize {
    let segments = &path.segments;
    let cusp = segments.windows(2).position(|w| w[0].gear() != w[1].gear()).map(|i| i + 1);
    let last_turn = || segments.iter().rposition(|s| s.curvature != 0.0);
    cusp.or_else(last_turn).unwrap_or(0)
}
