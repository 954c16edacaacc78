//! What `n3p` knows without a search: the manoeuvres of its library, and what they say about a plan.

use super::GuidedPlanner;
use crate::curves::{Path, Segment};
use crate::planners::cost::CostModel;
use crate::planners::hybrid_astar::{GoalSet, Leg};
use crate::planners::library::{Library, LibraryPlan};
use crate::planners::{Guidance, Problem, Route};
use crate::world::abstraction::abstractions;
use crate::world::cell::Grid;
use crate::world::{ParkingType, Stance};

/// Libraries kept prepared: those of the parking types of two vehicles, or of one with two margins,
/// and of some slants.
const LIBRARIES: usize = 12;
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
pub(super) const ENOUGH: f64 = 1.1;
/// Changes of gear that a parallel spot may take more than the curve through empty space.
const TO_AND_FRO: f64 = 4.0;
/// Where the lane begins farther out than this beyond a usual spot's, metres for the default vehicle,
/// manoeuvres are tried that end farther out, too.
const DEEPER: f64 = 0.3;
/// Those it tries where there is no such curve. Each takes some microseconds, together they take a
/// quarter of what a search usually does; generated scenes need 24 of them at most.
const TRIES: usize = 64;
/// Those that it tries to join by a long way round, where no other plan was found.
const LONG_WAYS: usize = 8;

/// A library made ready for a way to stand parked and a footprint.
pub(super) struct Prepared {
    stance: Stance,
    library: Library,
    /// From this number on its manoeuvres are none but the straight into the spot, or nothing at
    /// all: what joins them is the curve straight to the goal.
    straights: usize,
}

/// A plan that took no search.
pub(super) struct Known {
    pub(super) path: Path,
    pub(super) cost: f64,
    pub(super) guidance: Guidance,
    /// An estimate of what the best plan costs.
    pub(super) least: f64,
}

impl GuidedPlanner {
    /// The cheapest of what is known without a search: manoeuvres of the library prepared last, and
    /// the curve straight to the goal where none of the first can be joined.
    pub(super) fn look_up(&mut self, problem: &Problem, goal: &GoalSet) -> Option<Known> {
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
        self.out_of_the_mouth(problem, &cost, best)
    }

    /// The best so far, or a plan by a manoeuvre that ends where a usual bay's goal would be, farther
    /// out, and the straight from there where that costs less.
    fn out_of_the_mouth(
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
    pub(super) fn prepare_library(&mut self, problem: &Problem) -> bool {
        let Some(stance) = problem.stance() else { return false };
        let fits = |p: &Prepared| p.stance == stance && p.library.fits(problem);
        match self.libraries.iter().position(fits) {
            Some(at) => self.libraries[..=at].rotate_right(1),
            None => {
                let (vehicle, footprint) = (&problem.vehicle, *problem.collision.footprint());
                let manoeuvres = self.selector.manoeuvres(stance, vehicle);
                let cost = self.hars.cost(vehicle);
                let mut library = Library::new(&manoeuvres, vehicle, footprint, &cost);
                let straights = library.len();
                for entry in self.hars.entry_straights(problem) {
                    library.add(entry, &cost);
                }
                self.libraries.truncate(LIBRARIES - 1);
                self.libraries.insert(0, Prepared { stance, library, straights });
            }
        }
        self.libraries[0].straights > 0
    }

    /// Whether a plan costs no more than usual: what is known of the spot says what it takes; where
    /// that is little, the curve through empty space does.
    pub(super) fn is_usual(&mut self, problem: &Problem, goal: &GoalSet, known: &Known) -> bool {
        known.cost <= USUAL * known.least
            || known.cost <= ENOUGH * self.hars.lower_bound(problem, goal)
    }

    /// Whether a plan costs more than usual by a spot that no cell of the model stands for.
    pub(super) fn is_unusually_dear(
        &mut self,
        problem: &Problem,
        goal: &GoalSet,
        cost: f64,
        least: f64,
    ) -> bool {
        cost > USUAL * least
            && cost > ENOUGH * self.hars.lower_bound(problem, goal)
            && self.is_unusual(problem)
    }

    /// Whether no usual cell stands for the spot as it is. Of the vehicle's size: one model may serve
    /// vehicles of any.
    pub(super) fn is_unusual(&self, problem: &Problem) -> bool {
        let scale = problem.vehicle.scale();
        problem.stance().is_some_and(|stance| {
            let grid = || Grid::default().scaled(scale);
            problem.mouth > DEEPER * scale
                || abstractions(&problem.obstacles, stance, &grid()).is_empty()
        })
    }

    /// What is known, or the rest of the manoeuvre that the car stands in where that costs less: who
    /// replans on the way goes on.
    pub(super) fn or_rest(&mut self, problem: &Problem, known: Known) -> Known {
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
}
