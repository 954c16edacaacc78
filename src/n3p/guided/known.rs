//! What `n3p` knows without a search: the manoeuvres of its library, and what they say about a plan.

use std::cell::OnceCell;

use super::GuidedPlanner;
use crate::curves::{Path, Segment};
use crate::planners::cost::CostModel;
use crate::planners::hybrid_astar::{GoalSet, HybridAStar, Leg};
use crate::planners::library::{Library, LibraryPlan, Reach, Verdicts};
use crate::planners::{Effort, Guidance, Problem, Route};
use crate::selectors::PoseSelector;
use crate::selectors::foresight::{self, Codes, Foresight};
use crate::vehicle::{Gear, Vehicle};
use crate::world::abstraction::abstractions;
use crate::world::cell::{Axis, Grid};
use crate::world::{ParkingType, Stance};

/// Libraries kept prepared: those of the parking types of two vehicles, or of one with two margins,
/// and of some slants.
const LIBRARIES: usize = 12;
/// The first so many manoeuvres of a library, those of most use, are looked at for every plan, the others
/// where these do not do as usual.
const COMMON: usize = 400;
/// Known manoeuvres, free in the scene, that `n3p` tries to join before it asks for the curve
/// straight to the goal, and then once more for something cheaper: most plans take the first. And those
/// it tries where there is no such curve: each takes some microseconds, together they take a quarter of
/// what a search usually does.
const FIRST_TRIES: usize = 16;
const TRIES: usize = 64;
/// A plan that costs at most so many times the estimate of the best known one (which knows nothing
/// of joints and obstacles) or the least cost through empty space is taken as it is, unless it
/// passes something near on its way.
pub(super) const USUAL: f64 = 1.3;
/// Further limits of the same kind, for plans with changes of gear: see [`dear`]. The last is also the
/// limit by a spot that no usual cell stands for.
const RATHER_DEAR: f64 = 1.6;
const DEAR: f64 = 3.0;
pub(super) const DEAR_BY_UNUSUAL: f64 = 2.0;
/// What costs about as much as foreseen may cost so many times these limits.
const TRUSTED: f64 = 1.5;
/// Near the goal what costs so many times the estimate is doubted, whatever is foreseen.
const DOUBTED: f64 = 1.5;
/// Changes of gear that a parallel spot takes at most as a rule, and a bay.
const TO_AND_FRO: usize = 4;
const INTO_A_BAY: usize = 2;
/// Where the lane begins farther out than this beyond a usual spot's, metres for the default vehicle,
/// manoeuvres are tried that end farther out, too.
pub(super) const DEEPER: f64 = 0.3;
/// Shorter parallel spots than this are unusual, metres for the default vehicle: manoeuvres were learnt
/// for all others (see [`wide`](crate::world::generate::wide)).
const LEAST_GAP: f64 = 5.8;
/// Those that it tries to join by a long way round, where no other plan was found.
const LONG_WAYS: usize = 8;
/// Where a plan is dearer than usual so many more manoeuvres are tried, and then so many by way of a pose
/// that one motion leads to; what that is to cost, in terms of the plan.
const FURTHER: usize = 40;
const ONE_MOTION: Reach = Reach { motions: 1, manoeuvres: 40, tries: 60 };
const CHEAPER: f64 = 0.97;
/// Where there is no plan.
pub(super) const TWO_MOTIONS: Reach = Reach { motions: 2, manoeuvres: 100, tries: 300 };

/// A library made ready for a way to stand parked and a footprint.
pub(crate) struct Prepared {
    pub(super) stance: Stance,
    pub(crate) library: Library,
    /// From this number on its manoeuvres are none but the straight into the spot, or nothing at
    /// all: what joins them is the curve straight to the goal.
    pub(crate) straights: usize,
    /// Manoeuvres that are rarely of use.
    pub(crate) rare: Library,
    /// What foresight knows of the library's manoeuvres, where there is foresight.
    pub(super) codes: Option<Codes>,
}

impl Prepared {
    /// Makes what `selector` knows ready for problems like this one; `None` where no spot is known.
    pub(crate) fn new(
        selector: &dyn PoseSelector,
        hars: &HybridAStar,
        problem: &Problem,
        foresight: Option<&Foresight>,
    ) -> Option<Self> {
        let stance = problem.stance()?;
        let (vehicle, footprint) = (&problem.vehicle, *problem.collision.footprint());
        let manoeuvres = selector.manoeuvres(stance, vehicle);
        let cost = hars.cost(vehicle);
        let (common, rare) = manoeuvres.split_at(COMMON.min(manoeuvres.len()));
        let prepared = |all| Library::new(all, vehicle, footprint, &cost);
        let (mut library, rare) = (prepared(common), prepared(rare));
        let straights = library.len();
        for entry in hars.entry_straights(problem) {
            library.add(entry, &cost);
        }
        let mut prepared = Self { stance, library, straights, rare, codes: None };
        let values =
            |foresight: &Foresight| foresight.codes(&prepared.values(&prepared.library, vehicle));
        prepared.codes = foresight.map(values);
        Some(prepared)
    }

    /// Whether it was made ready for such problems.
    fn serves(&self, problem: &Problem) -> bool {
        problem.stance() == Some(self.stance) && self.library.fits(problem)
    }

    /// What says what each manoeuvre of one of the libraries is.
    pub(crate) fn values(
        &self,
        library: &Library,
        vehicle: &Vehicle,
    ) -> Vec<[f32; foresight::MANOEUVRE]> {
        let values =
            |(motions, cost)| foresight::manoeuvre_values(self.stance, vehicle, motions, cost);
        library.manoeuvres().map(values).collect()
    }

    /// A plan by one of its manoeuvres in common use.
    pub(super) fn known(&self, plan: LibraryPlan, least: f64) -> Known {
        known_by(plan, self.straights, least)
    }

    /// Its parts, those in common use first: each with what is known of it in the problem at hand, and how
    /// many of its manoeuvres are more than the straight into the spot.
    fn parts<'a>(
        &'a self,
        checked: &'a mut Checked,
    ) -> [(&'a Library, &'a mut Verdicts, usize); 2] {
        let Checked { common, rare } = checked;
        [(&self.library, common, self.straights), (&self.rare, rare, self.rare.len())]
    }
}

/// A plan by a manoeuvre of a library whose first `manoeuvres` are more than the straight into the spot.
pub(super) fn known_by(plan: LibraryPlan, manoeuvres: usize, least: f64) -> Known {
    let LibraryPlan { path, cost, manoeuvre, preparatory } = plan;
    let is_straight = manoeuvre >= manoeuvres;
    let preparatory = (!is_straight).then_some(preparatory);
    let route = if is_straight { Route::Direct } else { Route::Library };
    let guidance = Guidance { preparatory, route };
    Known { least, ..Known::unjudged(path, cost, guidance) }
}

/// Whether cars were seen to come from such starts when what is known was learnt: in sight of a spot that is
/// no deeper than usual.
pub(super) fn is_in_sight(problem: &Problem) -> bool {
    let is_deeper = problem.mouth > DEEPER * problem.vehicle.scale();
    let in_sight = |stance| foresight::is_in_sight(stance, &problem.vehicle, problem.start);
    problem.stance().is_some_and(in_sight) && !is_deeper
}

/// Whether something beside the spot, or in it, leaves less room there than the widest usual spot has: where
/// nothing does, who comes from afar need not change gears to get in.
fn is_bounded(problem: &Problem) -> bool {
    let grid = Grid::default().scaled(problem.vehicle.scale());
    let bounds = |stance: Stance| {
        let widest = grid.spot_width(stance.kind()).max;
        let found = abstractions(problem.around_spot(), stance, &grid);
        found.iter().any(|around| around.cell.spot_width < widest)
    };
    problem.stance().is_some_and(bounds)
}

/// What plans of one problem are held against, found out once, where it is asked for.
pub(super) struct Standard<'a> {
    problem: &'a Problem,
    /// Whether what was learnt has a say about what a plan costs.
    pub(super) is_familiar: bool,
    goal: OnceCell<GoalSet>,
    least: Option<f64>,
    unusual: Option<bool>,
}

impl<'a> Standard<'a> {
    pub(super) fn new(problem: &'a Problem, is_familiar: bool) -> Self {
        Self { problem, is_familiar, goal: OnceCell::new(), least: None, unusual: None }
    }

    /// Where plans may end.
    pub(super) fn goal(&self, hars: &HybridAStar) -> &GoalSet {
        self.goal.get_or_init(|| hars.goal_set(self.problem))
    }

    /// The least cost through empty space.
    pub(super) fn least(&mut self, hars: &mut HybridAStar) -> f64 {
        let goal = self.goal.get_or_init(|| hars.goal_set(self.problem));
        *self.least.get_or_insert_with(|| hars.lower_bound(self.problem, goal))
    }

    /// Cost that any plan may have: little more than the least through empty space.
    pub(super) fn enough(&mut self, hars: &mut HybridAStar) -> f64 {
        Effort::Usual.enough() * self.least(hars)
    }

    /// Whether no usual cell stands for the spot as it is. Of the vehicle's size: one model may serve
    /// vehicles of any.
    pub(super) fn is_unusual(&mut self) -> bool {
        let problem = self.problem;
        let scale = problem.vehicle.scale();
        let has_cell = |stance| {
            let usual = Grid::default();
            let parallel_spot_width = Axis { min: LEAST_GAP, ..usual.parallel_spot_width };
            let grid = Grid { parallel_spot_width, ..usual }.scaled(scale);
            !abstractions(problem.around_spot(), stance, &grid).is_empty()
        };
        let unusual = |stance| problem.mouth > DEEPER * scale || !has_cell(stance);
        *self.unusual.get_or_insert_with(|| problem.stance().is_some_and(unusual))
    }
}

/// Which manoeuvres of a library are free in the problem at hand, as far as it was asked.
#[derive(Default)]
pub(super) struct Checked {
    pub(super) common: Verdicts,
    pub(super) rare: Verdicts,
}

impl Checked {
    /// For another problem.
    fn clear(&mut self) {
        self.common.clear();
        self.rare.clear();
    }
}

/// A plan that took no search.
pub(super) struct Known {
    pub(super) path: Path,
    pub(super) cost: f64,
    pub(super) guidance: Guidance,
    /// An estimate of what the best plan costs.
    pub(super) least: f64,
    /// What the best plan was foreseen to cost.
    pub(super) foreseen: Option<f64>,
    /// Whether it costs no more than what was made for this very spot, and so will do.
    pub(super) is_made_to_measure: bool,
}

impl Known {
    /// A plan of which no estimate says what the best costs.
    pub(super) fn unjudged(path: Path, cost: f64, guidance: Guidance) -> Self {
        Self { path, cost, guidance, least: 0.0, foreseen: None, is_made_to_measure: false }
    }
}

/// The plan that is a curve straight to the goal.
pub(super) fn directly(Leg { path, cost, .. }: Leg, least: f64) -> Known {
    let guidance = Guidance { preparatory: None, route: Route::Direct };
    Known { least, ..Known::unjudged(path, cost, guidance) }
}

/// An estimate of what the best plan costs, by those of the cheapest manoeuvre and of the curve straight
/// to the goal. Into a bay a curve may lead straight; a parallel spot takes some to and fro as a rule.
pub(super) fn least(problem: &Problem, model: &CostModel, estimates: (f64, f64)) -> f64 {
    let to_and_fro = match problem.kind {
        Some(ParkingType::Parallel) => TO_AND_FRO as f64 * model.gear_change,
        _ => 0.0,
    };
    estimates.0.min(estimates.1 + to_and_fro)
}

/// Times the estimate of the best that a plan of so many changes may cost. Nearly all that cost more can
/// be bettered (1,600 scenes of the world "wide", seed 92): into a bay tail in no change or one is the
/// rule, nose in two are, into a parallel spot two or more; where none is needed to get in, what is dear
/// is a detour.
fn dear(problem: &Problem, changes: usize) -> f64 {
    let is_tail_in = problem.entry_gears() == [Gear::Backward];
    match (problem.kind, changes) {
        (_, 0) => USUAL,
        (Some(ParkingType::Parallel), 1) => RATHER_DEAR,
        (Some(ParkingType::Parallel), 2) => DEAR,
        (Some(ParkingType::Parallel), ..=TO_AND_FRO) => DEAR_BY_UNUSUAL,
        (Some(_), 1) if !is_tail_in => RATHER_DEAR,
        (Some(_), ..=INTO_A_BAY) if !is_tail_in => DEAR,
        _ => USUAL,
    }
}

/// Changes of gear that a spot takes at most as a rule.
pub(super) fn most_changes(kind: Option<ParkingType>) -> usize {
    if kind == Some(ParkingType::Parallel) { TO_AND_FRO } else { INTO_A_BAY }
}

impl GuidedPlanner {
    /// Whether what was learnt has a say about what a plan costs in such problems: the car comes from where cars
    /// were seen to come from or to a spot that is one, and manoeuvres are known for it.
    pub(super) fn is_familiar(&self, problem: &Problem) -> bool {
        (is_in_sight(problem) || is_bounded(problem))
            && self.libraries.first().is_none_or(|own| own.straights > 0)
    }

    /// The cheapest of what is known without a search, as foreseen, or else as estimates say, or else by way
    /// of another pose.
    pub(super) fn look_up(&mut self, problem: &Problem) -> Option<Known> {
        let (known, foreseen) = self.look_ahead(problem);
        let known = known.or_else(|| self.by_estimates(problem));
        let known = known.or_else(|| self.by_exit(problem, 0.0));
        // A roundabout way that nobody foresaw may be far longer than what a search would find.
        let will_do = |known: &Known| foreseen.is_some() || known.cost <= USUAL * known.least;
        let known = known.or_else(|| self.by_way(problem).filter(will_do))?;
        Some(Known { foreseen, ..known })
    }

    /// The cheapest of what is known without a search: manoeuvres of the library prepared last, and
    /// the curve straight to the goal where none of the first can be joined.
    fn by_estimates(&mut self, problem: &Problem) -> Option<Known> {
        let Self { libraries, library_search, checked, hars, .. } = self;
        let cost = hars.cost(&problem.vehicle);
        let prepared = &libraries[0];
        let (library, verdicts, any) = (&prepared.library, &mut checked.common, f64::INFINITY);
        let mut look_up = library_search.look_up(library, verdicts, problem, &cost, any);
        let least = least(problem, &cost, look_up.least_estimates(prepared.straights));
        let by_manoeuvre = |plan| prepared.known(plan, least);
        let mut best = look_up.next(any, FIRST_TRIES).map(by_manoeuvre);
        if best.is_none() {
            let direct = hars.direct(problem, problem.start, &hars.goal_set(problem));
            let direct = direct.map(|leg| directly(leg, least));
            let bound = direct.as_ref().map_or(any, |known| known.cost);
            let tries = if direct.is_some() { FIRST_TRIES } else { TRIES };
            best = look_up.next(bound, tries).map(by_manoeuvre).or(direct);
            best = best.or_else(|| look_up.long_way(any, LONG_WAYS).map(by_manoeuvre));
        }
        // What is estimated to cost less than the best so far may do so.
        if let Some(known) = &best
            && let Some(better) = look_up.cheapest(Some(known.cost), any, FIRST_TRIES)
        {
            best = Some(by_manoeuvre(better));
        }
        if best.as_ref().is_none_or(|known| known.cost > USUAL * known.least) {
            best = self.rarely_of_use(problem, &cost, best, least);
        }
        self.out_of_the_mouth(problem, &cost, best)
    }

    /// The best so far, or a plan by a manoeuvre that is rarely of use where that costs less.
    fn rarely_of_use(
        &mut self,
        problem: &Problem,
        model: &CostModel,
        best: Option<Known>,
        least: f64,
    ) -> Option<Known> {
        let Self { libraries, library_search, checked, .. } = self;
        let [_, (rare, verdicts, manoeuvres)] = libraries[0].parts(checked);
        let bound = best.as_ref().map_or(f64::INFINITY, |known| known.cost);
        let mut look_up = library_search.look_up(rare, verdicts, problem, model, bound);
        let known = best.as_ref().map(|known| known.cost);
        let Some(plan) = look_up.cheapest(known, bound, TRIES) else { return best };
        Some(known_by(plan, manoeuvres, least))
    }

    /// What is known, or what more manoeuvres, and where it is far from what is foreseen others by way of
    /// another pose, give for less.
    pub(super) fn look_further(&mut self, problem: &Problem, mut known: Known) -> Known {
        let Self { libraries, library_search, checked, hars, .. } = self;
        let Some(prepared) = libraries.first().filter(|p| p.serves(problem)) else { return known };
        let model = hars.cost(&problem.vehicle);
        for (library, verdicts, manoeuvres) in prepared.parts(checked) {
            if known.is_as_foreseen() == Some(true) {
                break;
            }
            let any = f64::INFINITY;
            let mut look_up = library_search.look_up(library, verdicts, problem, &model, any);
            let better = |plan: LibraryPlan, known: Known| Known {
                foreseen: known.foreseen,
                ..known_by(plan, manoeuvres, known.least)
            };
            if let Some(plan) = look_up.cheapest_of(known.cost, FURTHER) {
                known = better(plan, known);
            }
            if known.is_off_foreseen()
                && let Some(plan) = look_up.by_way(CHEAPER * known.cost, ONE_MOTION)
            {
                known = better(plan, known);
            }
        }
        known
    }

    /// What is known, or, where it costs far more than the estimate, what a manoeuvre in common use that begins
    /// beside the start gives for less, whatever is foreseen: who replans near the goal goes on.
    pub(super) fn or_beside(&mut self, problem: &Problem, known: Known) -> Known {
        let Self { libraries, library_search, checked, hars, .. } = self;
        let prepared = libraries.first().filter(|p| p.serves(problem));
        let Some(prepared) = prepared.filter(|_| known.cost > DOUBTED * known.least) else {
            return known;
        };
        let model = hars.cost(&problem.vehicle);
        let (library, verdicts, any) = (&prepared.library, &mut checked.common, f64::INFINITY);
        let mut look_up = library_search.look_up(library, verdicts, problem, &model, any);
        match look_up.cheapest_beside(known.cost) {
            Some(plan) => {
                let foreseen = known.foreseen;
                Known { foreseen, ..prepared.known(plan, known.least) }
            }
            None => known,
        }
    }

    /// A plan by way of another pose, for where no curve from the start joins a manoeuvre: by one of those in
    /// common use, or else by another.
    fn by_way(&mut self, problem: &Problem) -> Option<Known> {
        let Self { libraries, library_search, checked, hars, .. } = self;
        let prepared = &libraries[0];
        let model = hars.cost(&problem.vehicle);
        let (mut least_of_all, any) = (f64::INFINITY, f64::INFINITY);
        prepared.parts(checked).into_iter().find_map(|(library, verdicts, manoeuvres)| {
            let mut look_up = library_search.look_up(library, verdicts, problem, &model, any);
            let least = least(problem, &model, look_up.least_estimates(manoeuvres));
            least_of_all = least_of_all.min(least);
            let plan = look_up.by_way(any, TWO_MOTIONS)?;
            Some(known_by(plan, manoeuvres, least_of_all))
        })
    }

    /// The best so far, or a plan by a manoeuvre that ends where a usual bay's goal would be, farther
    /// out, and the straight from there where that costs less.
    fn out_of_the_mouth(
        &mut self,
        problem: &Problem,
        model: &CostModel,
        best: Option<Known>,
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
        let Self { libraries, library_search, .. } = self;
        let (library, any) = (&libraries[0].library, f64::INFINITY);
        // Where they end farther out others are free.
        let verdicts = &mut Verdicts::default();
        let in_cost = model.per_metre(*gear) * problem.mouth;
        let mut look_up = library_search.look_up_at(library, verdicts, problem, end, model, any);
        let (least, _) = look_up.least_estimates(library.len());
        let known = best.as_ref().map(|known| known.cost - in_cost);
        let Some(plan) = look_up.cheapest(known, any, FIRST_TRIES) else { return best };
        let LibraryPlan { mut path, preparatory, .. } = plan;
        path.extend([straight]);
        let cost = model.path(&problem.vehicle, &path.segments);
        let guidance = Guidance { preparatory: Some(preparatory), route: Route::Library };
        let least = best.map_or(f64::INFINITY, |known| known.least).min(least + in_cost);
        Some(Known { least, ..Known::unjudged(path, cost, guidance) })
    }

    /// Puts the library for `problem` first, prepared if need be, and says whether there is one.
    pub(super) fn prepare_library(&mut self, problem: &Problem) -> bool {
        if problem.kind.is_none() {
            return false;
        }
        self.checked.clear();
        match self.libraries.iter().position(|p| p.serves(problem)) {
            Some(at) => self.libraries[..=at].rotate_right(1),
            None => {
                let Self { selector, hars, foresight, .. } = self;
                // It has not learnt of slants.
                let foresight =
                    foresight.as_deref().filter(|_| problem.kind != Some(ParkingType::Angled));
                let prepared = Prepared::new(selector.as_ref(), hars, problem, foresight);
                let Some(prepared) = prepared else { return false };
                self.libraries.truncate(LIBRARIES - 1);
                self.libraries.insert(0, prepared);
            }
        }
        self.libraries[0].straights > 0
    }

    /// Whether a plan costs no more than usual: little more than the least through empty space, or about
    /// what was foreseen, if anything was, and then half as much again as [`dear`] allows over the library's
    /// estimate. With the usual changes of gear that is much, since manoeuvres for them were learnt in many worlds; by an
    /// unusual spot it is at most twice the estimate. Where nothing was learnt only empty space counts.
    pub(super) fn is_usual(&mut self, known: &Known, standard: &mut Standard) -> bool {
        if !standard.is_familiar {
            return known.cost <= standard.enough(&mut self.hars);
        }
        // The library's estimate is at hand, the other one takes a tenth of a plan.
        let is_off = known.foreseen.is_some() && known.is_off_foreseen();
        if (known.cost <= USUAL * known.least && !is_off)
            || known.cost <= standard.enough(&mut self.hars)
        {
            return true;
        }
        let times = known.cost / known.least.max(standard.least(&mut self.hars));
        let trust = match known.is_as_foreseen() {
            Some(false) => return false,
            Some(true) => TRUSTED,
            None => 1.0,
        };
        let limit = trust * dear(standard.problem, known.path.direction_changes());
        times <= limit && (times <= DEAR_BY_UNUSUAL || !standard.is_unusual())
    }

    /// What is known, or the rest of the manoeuvre that the car stands in where that costs less: who
    /// replans on the way goes on.
    pub(super) fn or_rest(&mut self, problem: &Problem, known: Known) -> Known {
        let prepared = self.libraries.first().filter(|p| p.serves(problem));
        let Some(Prepared { library, rare, .. }) = prepared else { return known };
        let model = self.hars.cost(&problem.vehicle);
        [library, rare].into_iter().fold(known, |known, library| {
            match library.rest(problem, &model, known.cost) {
                Some((path, cost)) => {
                    let guidance = Guidance { preparatory: None, route: Route::Library };
                    Known { path, cost, guidance, ..known }
                }
                None => known,
            }
        })
    }
}
