//! Plans on which the steering angle is continuous.
//!
//! A planner's path is arcs and straights. Here it gets clothoids wherever its curvature jumps
//! ([`smoothing`]), the gentlest first, and is checked anew, whole, with its clothoids. Where that
//! does not fit, a search (`steered`) looks for other paths: first one that is free once it is smooth, then one whose
//! steering angle does not jump anywhere.

use super::problem::Terms;
use super::shape::{ended_straight, lengthened};
use super::steered::{self, Joined};
use super::transitions::Turning;
use super::{Budget, Guidance, NoPath, PlanResult, Planner, Problem, Route, keeps_limits};
use crate::curves::smoothing::{Smoothing, StandstillSteering, smooth};
use crate::curves::{Path, SmoothPath};
use crate::geometry::Pose;
use crate::vehicle::Vehicle;

/// From straight wheels to full lock the gentlest clothoid takes so much of the turning radius, each of the
/// next half as much, and the last at least so much. At 1 m/s, 0.5 m/s … the wheels of a usual car turn that fast.
const GENTLEST: f64 = 0.25;
const SHARPEST: f64 = 0.0075;
/// Fits for a path that ends straight.
const WISHES: usize = 2;
/// Expansions of the search for a path that is free once it is smooth, and of that for one that is continuous; and
/// paths of each that are looked at.
const EXPANSIONS: usize = 20_000;
const STEERED_EXPANSIONS: usize = 100_000;
const PATHS: usize = 100;

/// The sharpness of the clothoids that a run of a path can have, the gentlest first, 1/m².
fn sharpnesses(vehicle: &Vehicle) -> Vec<f64> {
    let curvature = vehicle.max_curvature();
    let lengths = std::iter::successors(Some(GENTLEST), |share| Some(share / 2.0));
    let lengths = lengths.take_while(|&share| share >= SHARPEST);
    lengths.map(move |share| curvature * curvature / share).collect()
}

/// How a path is to be driven.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    standstill: StandstillSteering,
    /// The least length of the straight at its end, metres, if one is asked for.
    last_straight: Option<f64>,
    /// Where it is to end, if not where it does.
    goal: Option<Pose>,
}

/// A smooth path, and the arcs by which it was checked.
struct Driven {
    smooth: SmoothPath,
    arcs: Path,
}

impl Driven {
    /// The result with this path.
    fn in_place_of(self, result: PlanResult) -> PlanResult {
        PlanResult { outcome: Ok(self.arcs), smooth: Some(self.smooth), ..result }
    }
}

/// `path` with clothoids, if it can be driven so, with straight wheels at the start if possible.
fn smoothed(problem: &Problem, path: &Path, wanted: Wanted) -> Option<Driven> {
    let starts: &[bool] = match wanted.standstill {
        StandstillSteering::Never => &[false],
        // Straight wheels at the start are worth more than a straight end.
        StandstillSteering::AtChanges if wanted.last_straight.is_some() => &[false],
        StandstillSteering::AtChanges => &[false, true],
        // Wheels that turn anywhere need no clothoids.
        StandstillSteering::Anywhere => &[true],
    };
    starts.iter().find_map(|&at_start| smoothed_from(problem, path, at_start, wanted))
}

/// [`smoothed`] with every clothoid as gentle as may be: the runs on which the car would touch something
/// become sharper one step at a time, and all of them where that does not help.
fn smoothed_from(
    problem: &Problem,
    path: &Path,
    turned_at_start: bool,
    wanted: Wanted,
) -> Option<Driven> {
    let Wanted { standstill, last_straight, goal } = wanted;
    let choice = match standstill {
        StandstillSteering::Anywhere => vec![f64::INFINITY],
        _ => sharpnesses(&problem.vehicle),
    };
    let turned_at_changes = standstill != StandstillSteering::Never;
    let goal = goal.unwrap_or_else(|| path.end());
    let mut steps = vec![0; path.direction_changes() + 1];
    let mut sharpness = Vec::with_capacity(steps.len());
    // Each run could be tried with each; what is only a wish is given up sooner.
    let tries = if last_straight.is_some() { WISHES } else { usize::MAX };
    for _ in 0..tries {
        sharpness.clear();
        sharpness.extend(steps.iter().map(|&step: &usize| choice[step]));
        let sharpness = &sharpness;
        let begin = problem.start_curvature;
        let smoothing =
            Smoothing { begin, turned_at_start, turned_at_changes, sharpness, last_straight };
        let smooth = smooth(path, goal, &smoothing);
        let touching = match smooth.map(|smooth| checked(problem, smooth, standstill)) {
            Some(Ok(driven)) => return Some(driven),
            Some(Err(touching)) => touching,
            None => None,
        };
        let sharpest = choice.len() - 1;
        match touching.filter(|&run| steps[run] < sharpest) {
            Some(run) => steps[run] += 1,
            None if steps.iter().all(|&step| step == sharpest) => return None,
            None => steps.iter_mut().for_each(|step| *step = (*step + 1).min(sharpest)),
        }
    }
    None
}

/// How far the car may come from where the exact check sees it, metres: half of the margin, if there is one,
/// and else what no contact is noticed by.
fn deviation(problem: &Problem) -> f64 {
    const LEAST: f64 = 1e-4;
    let scale = problem.vehicle.scale();
    (problem.margin / 2.0)
        .clamp(LEAST * scale.min(1.0), Problem::usual_margin(&problem.vehicle) / 2.0)
}

/// The certificate of a smooth path: it begins at the start, keeps the steering limit and the bounds, and
/// touches nothing: arcs that it is nowhere farther from than [`deviation`] keep the margin. Where it touches
/// something, the last run on which it does is known.
fn checked(
    problem: &Problem,
    path: SmoothPath,
    standstill: StandstillSteering,
) -> Result<Driven, Option<usize>> {
    let arcs = path.arcs(deviation(problem), &problem.vehicle);
    // The last first: near the goal space is tightest.
    let legs: Vec<_> = arcs.legs().collect();
    let mut run = arcs.direction_changes();
    for (i, &(from, segment)) in legs.iter().enumerate().rev() {
        if legs.get(i + 1).is_some_and(|(_, next)| next.gear() != segment.gear()) {
            run -= 1;
        }
        if !problem.collision.segment_is_free(from, segment) {
            return Err(Some(run));
        }
    }
    let may_jump = standstill == StandstillSteering::Anywhere;
    let is_kept = (may_jump || path.jumps() == 0)
        && problem.collision.pose_is_free(path.start)
        && keeps_limits(problem, &arcs)
        && problem.collision.stays_within_bounds(&path);
    if is_kept { Ok(Driven { smooth: path, arcs }) } else { Err(None) }
}

/// A continuous way with the curve that joins it made smooth, if it can be driven so, with straight wheels at the
/// start if possible.
fn continued(
    problem: &Problem,
    joined: &Joined,
    turning: Turning,
    standstill: StandstillSteering,
) -> Option<Driven> {
    [false, true].into_iter().filter(|&at_start| turning.at_changes || !at_start).find_map(
        |at_start| {
            let smoothing = Smoothing {
                begin: problem.start_curvature,
                turned_at_start: at_start,
                turned_at_changes: turning.at_changes,
                sharpness: &[turning.sharpness],
                last_straight: joined.ends_straight.then_some(0.0),
            };
            let mut path = smooth(&joined.curve, joined.curve.end(), &smoothing)?;
            path.motions.extend(&joined.way);
            checked(problem, path, standstill).ok()
        },
    )
}

/// A planner's result with its moves as long, its end as straight and its path as smooth as `terms` ask for, if
/// it can be driven so; what is asked of its shape only where there is room for it.
fn shaped(problem: &Problem, result: &PlanResult, terms: &Terms) -> Option<PlanResult> {
    let path = result.outcome.as_ref().ok()?;
    let [least_move, last_straight] = terms.lengths(&problem.vehicle);
    let standstill = terms.standstill;
    let any_end = Wanted { standstill, last_straight: None, goal: None };
    // Who stops anywhere near the goal has no end to be straight, and who is there already stays.
    let is_free_to_shape = result.covered.is_none() && path.length() > last_straight;
    let longer = lengthened(problem, path, if is_free_to_shape { least_move } else { 0.0 });
    let mut ways = vec![(&longer, any_end)];
    if is_free_to_shape && last_straight > ended_straight(path) {
        ways.insert(0, (&longer, Wanted { last_straight: Some(last_straight), ..any_end }));
    }
    if longer != *path {
        ways.push((path, any_end));
    }
    let driven = ways.into_iter().find_map(|(path, wanted)| smoothed(problem, path, wanted))?;
    let result = driven.in_place_of(result.clone());
    let smooth = result.smooth.filter(|_| standstill != StandstillSteering::Anywhere);
    Some(PlanResult { smooth, ..result })
}

/// `path` fitted to the goal of `problem` and made as smooth as `terms` ask, if it is free then.
pub(super) fn fitted(problem: &Problem, path: &Path, terms: &Terms) -> Option<PlanResult> {
    let goals = match problem.tolerance {
        Some((goal, tolerance)) => tolerance.poses(goal),
        None => vec![problem.goal],
    };
    let ended = |goal: Option<Pose>| {
        let standstill = terms.standstill;
        smoothed(problem, path, Wanted { standstill, last_straight: None, goal })
    };
    // As it is, where it ends within the tolerance.
    let as_it_is = || problem.is_arrival(path.end()).then(|| ended(None)).flatten();
    let driven = goals.into_iter().find_map(|goal| ended(Some(goal))).or_else(as_it_is)?;
    // Fitting ends exactly there, and the arcs of clothoids nearly: who checked them has certified it.
    let result = driven.in_place_of(PlanResult::none(NoPath::NotSmooth, 0));
    let smooth = result.smooth.filter(|_| terms.standstill != StandstillSteering::Anywhere);
    Some(PlanResult { smooth, ..result })
}

/// A planner's result as `terms` ask for it; where its path cannot be driven so, another that can.
pub(super) fn driven(
    planner: &dyn Planner,
    problem: &Problem,
    result: PlanResult,
    terms: &Terms,
    budget: Budget,
) -> PlanResult {
    if result.outcome.is_err() || terms.are_usual() {
        return result;
    }
    if let Some(shaped) = shaped(problem, &result, terms) {
        return shaped;
    }
    let standstill = terms.standstill;
    if standstill == StandstillSteering::Anywhere {
        return result;
    }
    let mut left = budget.max_expansions.saturating_sub(result.expansions);
    let mut found = None;
    if result.covered.is_none() {
        let turning = Turning {
            sharpness: sharpnesses(&problem.vehicle).last().copied().unwrap_or(f64::INFINITY),
            at_changes: standstill == StandstillSteering::AtChanges,
            deviation: deviation(problem),
        };
        let wanted = Wanted { standstill, last_straight: None, goal: Some(problem.goal) };
        for (turning, most) in [(None, EXPANSIONS), (Some(turning), STEERED_EXPANSIONS)] {
            let share = left.min(most);
            let (mut spend, mut looks) = (share, PATHS);
            steered::first_accepted(planner.config(), problem, turning, &mut spend, |joined| {
                looks -= 1;
                let continued = |turning| continued(problem, joined, turning, standstill);
                // Gentler than it was found, if it can be.
                found = smoothed(problem, &joined.arcs(), wanted)
                    .or_else(|| turning.and_then(continued));
                found.is_some() || looks == 0
            });
            left -= share - spend;
            if found.is_some() {
                break;
            }
        }
    }
    let expansions = budget.max_expansions.max(result.expansions) - left;
    let Some(driven) = found else { return PlanResult::none(NoPath::NotSmooth, expansions) };
    let searched = Guidance { preparatory: None, route: Route::Searched };
    let guidance = result.guidance.map(|_| searched);
    driven.in_place_of(PlanResult { expansions, guidance, ..result })
}
