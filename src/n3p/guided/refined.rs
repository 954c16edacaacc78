//! What becomes of a plan, known or searched: it is taken as it is, bettered, or searched for once more.

use super::GuidedPlanner;
use super::foreseen::FAR_FROM_FORESEEN;
use super::known::{DEAR_BY_UNUSUAL, Known, Standard, is_in_sight, most_changes};
use crate::curves::Path;
use crate::planners::hybrid_astar::GoalSet;
use crate::planners::{Effort, Guidance, Problem, Route};

/// Who starts within so many vehicle lengths of the goal may stand within a manoeuvre.
const NEAR_GOAL: f64 = 2.0;
/// A refined plan of more changes than usual that costs so many times the least is searched for once
/// more, within so many expansions.
const DOUBTFUL: f64 = 2.0;
const SECOND_SEARCH: usize = 1500;
/// The same by a spot that no usual cell stands for: the manoeuvres may not be made for it.
const UNUSUAL_SEARCH: usize = 3_000;
/// Who comes from out of foresight's sight to a spot that is bounded: what costs so many times the estimate.
const FROM_AFAR: f64 = 1.5;
/// Where nothing was learnt: what costs so many times the least after all.
const ANYWHERE: f64 = 1.4;
/// What then still is so much dearer than foreseen is searched for as long as it takes as a rule.
const STILL_DEAR: f64 = 1.25;
const LAST_SEARCH: usize = 40_000;

impl GuidedPlanner {
    /// The plan by what is known: as it is where it costs little more than it must, else refined.
    pub(super) fn settle(
        &mut self,
        problem: &Problem,
        mut known: Known,
        effort: Effort,
        left: &mut usize,
    ) -> (Path, Guidance) {
        if effort == Effort::First {
            return (known.path, known.guidance);
        }
        let mut standard = Standard::new(problem, self.is_familiar(problem));
        let apart = problem.start.distance(problem.goal) / problem.vehicle.length;
        if apart < NEAR_GOAL {
            known = self.or_beside(problem, known);
        }
        let mut is_usual = self.is_usual(&known, &mut standard);
        let may_go_on = problem.starts_at_the_spot() || (apart < NEAR_GOAL && !is_usual);
        if !is_usual || (may_go_on && known.cost > standard.enough(&mut self.hars)) {
            known = self.or_direct(problem, known);
            if may_go_on {
                known = self.or_rest(problem, known);
            }
            is_usual = self.is_usual(&known, &mut standard);
        }
        if is_usual && !self.hars.passes_near(problem, &known.path) {
            return (known.path, known.guidance);
        }
        if !is_usual && !known.is_made_to_measure {
            known = self.look_further(problem, known);
            if standard.is_unusual() {
                known = self.or_exit(problem, known);
            }
        }
        let before = *left;
        let refined = if known.is_made_to_measure {
            self.hars.cut(problem, known.path.clone()).0
        } else if standard.is_familiar {
            self.cut_or_searched(problem, &mut standard, &known, left)
        } else {
            self.refine_anywhere(problem, &mut standard, known.path.clone(), 0, left)
        };
        let guidance =
            if refined == known.path { known.guidance } else { Self::anew(before - *left) };
        (refined, guidance)
    }

    /// What is known, with its corners cut, or what a search finds where it is dear even so.
    fn cut_or_searched(
        &mut self,
        problem: &Problem,
        standard: &mut Standard,
        known: &Known,
        left: &mut usize,
    ) -> Path {
        let goal = standard.goal(&self.hars).clone();
        let (cut, _) = self.hars.cut(problem, known.path.clone());
        let cost = self.path_cost(problem, &cut);
        // Far more than was foreseen, or, where nothing is foreseen, than is estimated: from afar, or by an
        // unusual spot.
        let (limit, is_doubted) = match known.foreseen {
            Some(foreseen) => (FAR_FROM_FORESEEN * foreseen, true),
            None if !is_in_sight(problem) => {
                (FROM_AFAR * known.least.max(standard.least(&mut self.hars)), true)
            }
            None => (DEAR_BY_UNUSUAL * known.least, standard.is_unusual()),
        };
        if is_doubted && cost > limit && cost > standard.enough(&mut self.hars) {
            let found = self.or_searched(problem, &goal, cut, UNUSUAL_SEARCH, false, left);
            let is_still_dear = self.path_cost(problem, &found) > STILL_DEAR * limit;
            return if known.foreseen.is_some() && is_still_dear {
                self.or_searched(problem, &goal, found, LAST_SEARCH, false, left)
            } else {
                found
            };
        }
        let has_many_changes = cut.direction_changes() > most_changes(problem.kind);
        if known.foreseen.is_none() && has_many_changes && cost > DOUBTFUL * known.least {
            return self.or_searched(problem, &goal, cut, SECOND_SEARCH, false, left);
        }
        cut
    }

    /// A path of a problem of which nothing was learnt, found with `spent` expansions, or a better one.
    fn refine_anywhere(
        &mut self,
        problem: &Problem,
        standard: &mut Standard,
        path: Path,
        spent: usize,
        left: &mut usize,
    ) -> Path {
        let goal = standard.goal(&self.hars).clone();
        // As long as a known path is bettered, or longer where it was hard to find.
        let patience = |spent| Effort::Usual.patience(spent, *left);
        let spent = Some(spent).filter(|&spent| patience(Some(spent)) > patience(None));
        let refined = self.hars.refine(problem, &goal, path, Effort::Usual, spent, left);
        let is_far = self.path_cost(problem, &refined) > ANYWHERE * standard.least(&mut self.hars);
        if is_far {
            self.or_searched(problem, &goal, refined, LAST_SEARCH, false, left)
        } else {
            refined
        }
    }

    pub(super) fn path_cost(&self, problem: &Problem, path: &Path) -> f64 {
        self.hars.cost(&problem.vehicle).path(&problem.vehicle, &path.segments)
    }

    /// `path`, or what a search of at most so many expansions finds where that costs less; on the usual
    /// lattice or half a cell `aside` of it.
    fn or_searched(
        &mut self,
        problem: &Problem,
        goal: &GoalSet,
        path: Path,
        most: usize,
        aside: bool,
        left: &mut usize,
    ) -> Path {
        let share = most.min(*left);
        let mut spend = share;
        let found = if aside {
            self.hars.search_aside(problem, problem.start, goal, &mut spend)
        } else {
            self.hars.search(problem, problem.start, goal, None, &mut spend)
        };
        *left -= share - spend;
        let Ok(leg) = found else { return path };
        // On the lattice of this search, and not for long: it is the second one.
        let found = self.hars.refine(problem, goal, leg.path, Effort::Usual, Some(0), left);
        if self.path_cost(problem, &found) < self.path_cost(problem, &path) { found } else { path }
    }

    /// A plan, or the best that half of what is left of the budget finds in its place.
    pub(super) fn look_again(
        &mut self,
        problem: &Problem,
        (path, guidance): (Path, Guidance),
        left: &mut usize,
    ) -> (Path, Guidance) {
        let (goal, before) = (self.hars.goal_set(problem), *left);
        let refined = self.hars.refine(problem, &goal, path.clone(), Effort::Most, None, left);
        let guidance = if refined == path { guidance } else { Self::anew(before - *left) };
        (refined, guidance)
    }

    /// What is said of a plan that took the place of another, after `spent` expansions.
    fn anew(spent: usize) -> Guidance {
        let route = if spent == 0 { Route::Direct } else { Route::Searched };
        Guidance { preparatory: None, route }
    }

    /// A searched path or a better one. By an unusual spot a path of many changes is searched for once
    /// more: what a search finds first is mostly good, but not where so little room is left.
    pub(super) fn refine(
        &mut self,
        problem: &Problem,
        goal: &GoalSet,
        path: Path,
        effort: Effort,
        spent: usize,
        left: &mut usize,
    ) -> Path {
        if effort != Effort::First && !self.is_familiar(problem) {
            let mut standard = Standard::new(problem, false);
            return self.refine_anywhere(problem, &mut standard, path, spent, left);
        }
        let refined = self.hars.refine(problem, goal, path, effort, Some(spent), left);
        let is_fine = refined.direction_changes() <= most_changes(problem.kind);
        if effort == Effort::First || is_fine || !Standard::new(problem, false).is_unusual() {
            return refined;
        }
        self.or_searched(problem, goal, refined, UNUSUAL_SEARCH, true, left)
    }
}
