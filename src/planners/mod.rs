//! Planners: from a [`Problem`] to a path or a reason why there is none.
//!
//! Every method of a table, learnt or not, meets the evaluation as a [`Planner`].
//! The search core is in [`hybrid_astar`]; its parts are `search` (nodes and expansion),
//! `open` (queues), `lattice` (visited states), `cost_to_go` and `nonholonomic` (the two
//! heuristics), `fitting_cost_to_go` (what a search follows that has lost its way; both spread over `wave`), [`analytic`] (Reeds-Shepp expansion) and [`cost`]. Its variants are
//! [`PlainHybridAStar`] (no curves), [`MultiHeuristicHybridAStar`] and
//! [`ScenarioHybridAStar`] (parallel spots). [`goals`] plans a scene with any of them: to the
//! cheapest of its goals, out of a contact (`contact`), and out of a spot as into one (`leaving`); `continuous` makes its path one that a car can
//! follow, of the `shape` asked for, or looks for another by a search with clothoids between its motions (`steered`, `transitions`). [`library`] does without any search; `approach`
//! estimates the ways to its manoeuvres.

pub mod analytic;
mod approach;
mod budget;
mod config;
mod conflict;
mod contact;
mod continuous;
pub mod cost;
mod cost_to_go;
pub(crate) mod exit_manoeuvre;
mod fitting_cost_to_go;
pub mod goals;
pub mod hybrid_astar;
mod joint;
mod lattice;
mod leaving;
pub mod library;
mod multi_heuristic;
mod nearness;
mod nonholonomic;
mod open;
mod plain;
mod previous;
mod problem;
mod scenario;
mod search;
mod shape;
mod shortcut;
mod steered;
pub(crate) mod to_and_fro;
mod transitions;
mod wave;

pub use analytic::AnalyticTail;
pub use budget::{Budget, Effort};
pub use config::{GoalRegion, HybridAStarConfig, Resolution};
pub use conflict::Conflict;
pub use contact::Contact;
pub use hybrid_astar::HybridAStar;
pub use multi_heuristic::{MultiHeuristicConfig, MultiHeuristicHybridAStar};
pub use plain::PlainHybridAStar;
pub use problem::{Problem, ProblemError};
pub use scenario::ScenarioHybridAStar;
pub use shape::Shape;

use crate::curves::{Path, SmoothPath};
use crate::geometry::Pose;

/// Anything that plans a path. Implementations keep buffers between calls; results
/// never depend on earlier calls.
pub trait Planner {
    /// The method name of tables and files, such as `ha-rs`.
    fn name(&self) -> &str;

    /// The settings of its searches: by their costs its paths are compared with others.
    fn config(&self) -> HybridAStarConfig {
        HybridAStarConfig::default()
    }

    /// Plans one problem. "No path" is a result, not an error.
    fn plan(&mut self, problem: &Problem, budget: Budget) -> PlanResult;
}

/// What a planner found, and what it took.
#[derive(Clone, Debug)]
pub struct PlanResult {
    /// The path in the problem's frame, from the start to the goal.
    pub outcome: Result<Path, NoPath>,
    /// The same path with clothoids, where steering that is continuous was asked for: `outcome` then holds
    /// arcs that it is nowhere farther from than half of the margin.
    pub smooth: Option<SmoothPath>,
    /// Share of the parked footprint that the car covers at the path's end, where the path does
    /// not lead exactly to the goal; `None` where it does.
    pub covered: Option<f64>,
    /// Node expansions spent.
    pub expansions: usize,
    /// What N3P took for the spot and did with it; `None` for plain planners.
    pub guidance: Option<Guidance>,
}

impl PlanResult {
    /// A result with `path`, which must pass the exact check from the start to the goal (or where
    /// its tolerance lets it end) and keep the steering limit: the certificate every planner's path leaves with.
    pub fn certified(problem: &Problem, path: Path, expansions: usize) -> Self {
        if problem.is_arrival(path.end()) && is_drivable(problem, &path) {
            Self::with(Ok(path), expansions)
        } else {
            Self::none(NoPath::Uncertified, expansions)
        }
    }

    /// [`PlanResult::certified`] for a path that ends where the car covers at least
    /// [`PARKED_COVER`] of its parked footprint, which is parked for methods that drive step by step.
    pub fn certified_cover(problem: &Problem, path: Path, expansions: usize) -> Self {
        let covered = problem.vehicle.overlap(path.end(), problem.goal);
        if covered >= PARKED_COVER && is_drivable(problem, &path) {
            Self { covered: Some(covered), ..Self::with(Ok(path), expansions) }
        } else {
            Self::none(NoPath::Uncertified, expansions)
        }
    }

    /// A result without path.
    pub fn none(reason: NoPath, expansions: usize) -> Self {
        Self::with(Err(reason), expansions)
    }

    /// The path as it is driven: smooth, where that was asked for.
    pub fn driven(&self) -> Option<SmoothPath> {
        let arcs = self.outcome.as_ref().ok().map(SmoothPath::of);
        self.smooth.clone().or(arcs)
    }

    fn with(outcome: Result<Path, NoPath>, expansions: usize) -> Self {
        Self { outcome, smooth: None, covered: None, expansions, guidance: None }
    }
}

/// Share of the parked footprint that must be covered by a car that stops elsewhere than exactly
/// at the goal (the paper's 90 %).
pub const PARKED_COVER: f64 = 0.9;

/// Whether a path begins at the start, keeps the steering limit and touches nothing but what the
/// start or the goal may touch, which it only leaves or only enters.
fn is_drivable(problem: &Problem, path: &Path) -> bool {
    problem.collision.path_is_free(path) && keeps_limits(problem, path)
}

/// [`is_drivable`] of a path that is known to touch nothing that neither start nor goal touches.
fn keeps_limits(problem: &Problem, path: &Path) -> bool {
    /// Stored curvatures are rounded to single precision.
    const ROUNDING: f64 = 1.0 + 1e-6;
    path.max_abs_curvature() <= problem.vehicle.max_curvature() * ROUNDING
        && path.start.distance(problem.start) < Problem::ROUNDING
        && problem.contact.as_ref().is_none_or(|c| c.is_only_left(&problem.vehicle, path))
}

/// Why there is no path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoPath {
    /// The expansion budget ended the search.
    #[error("budget spent")]
    BudgetSpent,
    /// Every reachable state was expanded.
    #[error("no path at this resolution")]
    Exhausted,
    /// The goal is enclosed: the cost-to-go never reaches the start.
    #[error("goal not reachable from the start")]
    Enclosed,
    /// The steps of a policy ran out.
    #[error("not parked within the steps allowed")]
    OutOfSteps,
    /// The method itself failed, for a reason of its own.
    #[error("{0}")]
    Failed(&'static str),
    /// The method does not apply to this problem.
    #[error("not applicable")]
    NotApplicable,
    /// There is a path, but none was found on which the steering angle is continuous.
    #[error("no path without steering at standstill was found; there is one with it")]
    NotSmooth,
    /// The path found did not pass the final swept check (our bug; reported, not hidden).
    #[error("path rejected by the final check")]
    Uncertified,
}

/// What guided planning did: for rows, pictures and explanations.
#[derive(Clone, Debug)]
pub struct Guidance {
    /// The preparatory pose driven to, in the problem's frame.
    pub preparatory: Option<Pose>,
    /// How the path came about.
    pub route: Route,
}

/// How guided planning reached its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// A curve and a known manoeuvre: no search at all.
    Library,
    /// Reeds-Shepp curves alone: no search either.
    Direct,
    /// What is left of the previous path.
    Kept,
    /// A search reached the preparatory pose (or left it for the goal).
    Searched,
    /// The full search from start to goal, as the last resort.
    Fallback,
    /// The full search: the lane beside the spot is smaller than the model's smallest.
    NoLane,
    /// The full search: nothing around the goal looks like a spot beside a lane.
    NoSpot,
}

impl Route {
    /// The name used in rows.
    pub fn name(self) -> &'static str {
        match self {
            Route::Library => "library",
            Route::Direct => "direct",
            Route::Kept => "kept",
            Route::Searched => "searched",
            Route::Fallback => "fallback",
            Route::NoLane => "no-lane",
            Route::NoSpot => "no-spot",
        }
    }

    /// Whether the full search planned the path.
    pub fn is_fallback(self) -> bool {
        matches!(self, Route::Fallback | Route::NoLane | Route::NoSpot)
    }

    /// What it means, in words.
    pub fn explanation(self) -> &'static str {
        match self {
            Route::Library => "a known manoeuvre, joined by one curve; no search",
            Route::Direct => "Reeds-Shepp curves alone; no search",
            Route::Kept => "what is left of the previous path: nothing is clearly better",
            Route::Searched => "a search by way of a preparatory pose",
            Route::Fallback => "a full search: no known manoeuvre or pose fits here",
            Route::NoLane => "a full search: no free lane of the model's smallest size by the spot",
            Route::NoSpot => "a full search: nothing around the goal looks like a spot by a lane",
        }
    }
}
