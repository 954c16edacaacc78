//! Hybrid A* that goes on until a path is found that can be driven without a jump of the steering angle.
//!
//! It runs from the goal to the start like every search here. With transitions between its motions each way it finds is
//! continuous, but for the curve that joins it from the start: that one is made smooth by whoever takes it. Without them
//! ways are shorter to find, and it is for the taker to make all of it smooth.

use super::analytic::AnalyticExpansion;
use super::config::HybridAStarConfig;
use super::search::Search;
use super::transitions::Turning;
use super::{NoPath, Problem};
use crate::curves::{Clothoid, Path, Segment};

/// A way to the goal, and a curve that leads to it from the start.
pub(super) struct Joined {
    /// Arcs and straights, free as they are.
    pub curve: Path,
    /// What follows, continuous if the search has transitions.
    pub way: Vec<Clothoid>,
    /// Whether the curve must end with straight wheels: the way begins with them, in the same gear.
    pub ends_straight: bool,
}

impl Joined {
    /// The whole as arcs and straights, transitions left out: it ends a little beside the goal.
    pub fn arcs(&self) -> Path {
        let mut path = self.curve.clone();
        let arcs = self.way.iter().filter(|c| c.is_arc());
        path.extend(arcs.map(|c| Segment { curvature: c.from, length: c.length }));
        path
    }
}

/// Searches from the start to the goal of `problem` and shows `accept` what it finds, in the order in which it
/// finds it, until that takes one. `expansions` is reduced by what was spent.
pub(super) fn first_accepted(
    config: HybridAStarConfig,
    problem: &Problem,
    turning: Option<Turning>,
    expansions: &mut usize,
    mut accept: impl FnMut(&Joined) -> bool,
) {
    let Ok(config) = config.for_search(problem) else { return };
    let goal = config.goal_set(problem);
    let domains = config.domains(problem, problem.start, goal.pose);
    let mut queue = turning.map_or_else(Search::default, Search::steered);
    let mut analytic = AnalyticExpansion::default();
    // Where the wheels may stand as they like when the curve ends.
    let at_changes = turning.is_none_or(|turning| turning.at_changes);
    // What became of it is with `accept`.
    let _ = config.coarse_to_fine(&domains, false, expansions, |attempt, expansions| {
        queue.begin(attempt, problem, problem.start, &goal);
        while let Some(node) = queue.pop() {
            if *expansions == 0 {
                return Err(NoPath::BudgetSpent);
            }
            *expansions -= 1;
            let departure = queue.departure(node, &goal);
            let is_straight = departure.gear.is_none() || departure.steer == 0.0;
            if (is_straight || at_changes) && queue.wants_curve(node) {
                let (start, to) = (queue.start(), queue.pose(node));
                let model = &attempt.config.cost;
                let any = f64::INFINITY;
                if let Some((word, _)) = analytic.curve(start, to, departure, any, problem, model) {
                    let changes = word.segments().last().map(|s| s.gear()) != departure.gear;
                    let stands = departure.gear.is_none() || changes && at_changes;
                    let curve = Path::new(start, word.segments().iter().copied());
                    let way = queue.continuous_way(node, &goal);
                    let joined = Joined { curve, way, ends_straight: !stands };
                    if (stands || is_straight || turning.is_none()) && accept(&joined) {
                        return Ok(());
                    }
                }
            }
            queue.expand(node, &goal, attempt.config, problem);
        }
        Err(queue.stop())
    });
}
