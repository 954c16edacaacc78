//! Plans on which the steering angle is continuous.
//!
//! A planner's path is arcs and straights. Here it gets clothoids wherever its curvature jumps
//! ([`smoothing`]), the gentlest first, and is checked anew, whole, with its clothoids. Where that
//! does not fit, a search looks for other paths that do: a path counts there only if it is free once it is smooth.

use super::hybrid_astar::HybridAStar;
use super::{Budget, HybridAStarConfig, NoPath, PlanResult, Problem, Route, keeps_limits};
use crate::curves::smoothing::{Smoothing, StandstillSteering, smooth};
use crate::curves::{Path, SmoothPath};
use crate::vehicle::Vehicle;

/// From straight wheels to full lock the gentlest clothoid takes so much of the turning radius, each of the
/// next half as much, and the last at least so much. At 1 m/s, 0.5 m/s … the wheels of a usual car turn that fast.
const GENTLEST: f64 = 0.25;
const SHARPEST: f64 = 0.0075;
/// Expansions for a path that is free once it is smooth, and paths that are looked at.
const EXPANSIONS: usize = 20_000;
const PATHS: usize = 400;

/// The sharpness of the clothoids that a run of a path can have, the gentlest first, 1/m².
fn sharpnesses(vehicle: &Vehicle) -> Vec<f64> {
    let curvature = vehicle.max_curvature();
    let lengths = std::iter::successors(Some(GENTLEST), |share| Some(share / 2.0));
    let lengths = lengths.take_while(|&share| share >= SHARPEST);
    lengths.map(move |share| curvature * curvature / share).collect()
}

/// `path` with clothoids, if it can be driven so, with straight wheels at the start if possible.
pub(super) fn smoothed(
    problem: &Problem,
    path: &Path,
    standstill: StandstillSteering,
) -> Option<SmoothPath> {
    let turned_at_changes = standstill == StandstillSteering::AtChanges;
    let starts: &[bool] = if turned_at_changes { &[false, true] } else { &[false] };
    starts.iter().find_map(|&at_start| smoothed_from(problem, path, at_start, turned_at_changes))
}

/// [`smoothed`] with every clothoid as gentle as may be: the runs on which the car would touch something
/// become sharper one step at a time, and all of them where that does not help.
fn smoothed_from(
    problem: &Problem,
    path: &Path,
    turned_at_start: bool,
    turned_at_changes: bool,
) -> Option<SmoothPath> {
    let (goal, choice) = (path.end(), sharpnesses(&problem.vehicle));
    let mut steps = vec![0; path.direction_changes() + 1];
    let mut sharpness = Vec::with_capacity(steps.len());
    loop {
        sharpness.clear();
        sharpness.extend(steps.iter().map(|&step: &usize| choice[step]));
        let smoothing = Smoothing { turned_at_start, turned_at_changes, sharpness: &sharpness };
        let smooth = smooth(path, goal, &smoothing);
        let touching = match smooth.map(|smooth| checked(problem, smooth)) {
            Some(Ok(smooth)) => return Some(smooth),
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
}

/// How far the car may come from where the exact check sees it, metres: half of the margin, if there is one,
/// and else what no contact is noticed by.
pub(super) fn deviation(problem: &Problem) -> f64 {
    const LEAST: f64 = 1e-4;
    let scale = problem.vehicle.scale();
    (problem.margin / 2.0)
        .clamp(LEAST * scale.min(1.0), Problem::usual_margin(&problem.vehicle) / 2.0)
}

/// The certificate of a smooth path: it begins at the start, keeps the steering limit and the bounds, and
/// touches nothing: arcs that it is nowhere farther from than [`deviation`] keep the margin. Where it touches
/// something, the first run on which it does is known.
fn checked(problem: &Problem, path: SmoothPath) -> Result<SmoothPath, Option<usize>> {
    let arcs = path.arcs(deviation(problem), &problem.vehicle);
    let mut run = 0;
    let mut gear = arcs.segments.first().map(|s| s.gear());
    for (from, segment) in arcs.legs() {
        if gear != Some(segment.gear()) {
            (run, gear) = (run + 1, Some(segment.gear()));
        }
        if !problem.collision.segment_is_free(from, segment) {
            return Err(Some(run));
        }
    }
    let is_kept = path.jumps() == 0
        && problem.collision.pose_is_free(path.start)
        && keeps_limits(problem, &arcs)
        && problem.collision.stays_within_bounds(&path);
    if is_kept { Ok(path) } else { Err(None) }
}

/// A planner's result with its path made smooth, as `standstill` asks for.
pub(super) fn driven(
    problem: &Problem,
    result: PlanResult,
    standstill: StandstillSteering,
    budget: Budget,
) -> PlanResult {
    let Ok(path) = &result.outcome else { return result };
    if standstill == StandstillSteering::Anywhere {
        return result;
    }
    if let Some(smooth) = smoothed(problem, path, standstill) {
        return with_smooth(problem, result, smooth);
    }
    // Another path may be one that is free when it is smooth.
    let share = budget.max_expansions.saturating_sub(result.expansions).min(EXPANSIONS);
    let (mut spend, mut looks, mut found) = (share, PATHS, None);
    if result.covered.is_none() {
        let mut search = HybridAStar::new(HybridAStarConfig::default());
        search.first_accepted(problem, &mut spend, |path| {
            looks -= 1;
            found = smoothed(problem, path, standstill);
            found.is_some() || looks == 0
        });
    }
    let expansions = result.expansions + share - spend;
    let Some(smooth) = found else { return PlanResult::none(NoPath::NotSmooth, expansions) };
    let guidance = result.guidance.map(|g| super::Guidance {
        preparatory: None,
        route: if spend < share { Route::Searched } else { g.route },
    });
    with_smooth(problem, PlanResult { expansions, guidance, ..result }, smooth)
}

fn with_smooth(problem: &Problem, result: PlanResult, smooth: SmoothPath) -> PlanResult {
    let arcs = smooth.arcs(deviation(problem), &problem.vehicle);
    PlanResult { outcome: Ok(arcs), smooth: Some(smooth), ..result }
}
