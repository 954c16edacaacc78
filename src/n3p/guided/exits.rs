//! Plans into parallel spots where what was learnt does not serve, such as tighter ones: to and fro, as far as
//! there is room ([`to_and_fro`]), and one curve from the start.

use super::GuidedPlanner;
use super::known::{Known, TWO_MOTIONS, known_by};
use crate::planners::exit_manoeuvre::Exit;
use crate::planners::hybrid_astar::GoalSet;
use crate::planners::library::{Library, Verdicts};
use crate::planners::{Problem, to_and_fro};
use crate::world::ParkingType;

/// Exits that a search begins at, at most.
const ROOTS: usize = 10;

impl GuidedPlanner {
    /// How the car may leave a parallel spot; none of any other spot. Found once for each plan.
    pub(super) fn exits(&mut self, problem: &Problem) -> &[Exit] {
        self.exits.get_or_insert_with(|| match problem.kind {
            Some(ParkingType::Parallel) => to_and_fro::exits(problem),
            _ => Vec::new(),
        })
    }

    /// `goal` and some of the exits.
    pub(super) fn with_exits(&mut self, problem: &Problem, mut goal: GoalSet) -> GoalSet {
        let cost = self.hars.cost(&problem.vehicle);
        for Exit { pose, way_in } in self.exits(problem).iter().take(ROOTS) {
            goal.add_preparatory(*pose, way_in.clone(), &problem.vehicle, &cost);
        }
        goal
    }

    /// The cheapest plan by one of the exits and one curve, or else by way of another pose. `least`: an estimate of
    /// what the best plan costs.
    pub(super) fn by_exit(&mut self, problem: &Problem, least: f64) -> Option<Known> {
        let ways_in: Vec<_> = self.exits(problem).iter().map(|exit| exit.way_in.clone()).collect();
        if ways_in.is_empty() {
            return None;
        }
        let (model, any) = (self.hars.cost(&problem.vehicle), f64::INFINITY);
        let footprint = *problem.collision.footprint();
        let library = Library::new(&ways_in, &problem.vehicle, footprint, &model);
        let mut verdicts = Verdicts::default();
        let mut look_up =
            self.library_search.look_up(&library, &mut verdicts, problem, &model, any);
        let plan = look_up.cheapest_of(any, usize::MAX);
        let plan = plan.or_else(|| look_up.by_way(any, TWO_MOTIONS))?;
        let known = known_by(plan, library.len(), least);
        Some(Known { is_made_to_measure: true, ..known })
    }

    /// What is known, or a plan by an exit that costs less. With an exit to hold it against, either will do.
    pub(super) fn or_exit(&mut self, problem: &Problem, known: Known) -> Known {
        match self.by_exit(problem, known.least) {
            Some(exit) if exit.cost < known.cost => Known { foreseen: known.foreseen, ..exit },
            Some(_) => Known { is_made_to_measure: true, ..known },
            None => known,
        }
    }
}
