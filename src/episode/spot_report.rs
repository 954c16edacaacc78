//! What a plan took for spot, lane and dead end, for people and programs.

use std::fmt;

use serde::Serialize;

use super::Episode;
use crate::geometry::{Polygon, Pose};
use crate::n3p::{Method, Models};
use crate::planners::{PlanResult, Problem};
use crate::world::ParkingType;
use crate::world::abstraction::{Abstraction, abstractions};
use crate::world::cell::Grid;

/// How guided planning saw a scene. Lengths in metres; poses and corners in the scene's own frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpotReport {
    /// The parking type, given or found; `None` where nothing looks like a spot beside a lane.
    pub parking_type: Option<ParkingType>,
    /// The spot frame: its origin is the parked body's centre, its heading the direction of travel
    /// along the lane.
    pub frame: Option<Pose>,
    /// Whether the lane lies to the right of that direction of travel (the frame is mirrored).
    pub mirrored: bool,
    /// Free width of the lane beside the spot, at most the model's largest.
    pub lane_width_m: Option<f64>,
    /// Width of the spot.
    pub spot_width_m: Option<f64>,
    /// From the spot's mouth along the lane to its end; the model's largest stands for none.
    pub dead_end_m: Option<f64>,
    /// Corners of the largest lane and of the spot, as the model's grid has them.
    pub lane_and_spot: Option<[Vec<[f64; 2]>; 2]>,
    /// The preparatory pose.
    pub preparatory: Option<Pose>,
    /// How the plan came about.
    pub route: &'static str,
    /// The same in words.
    pub explanation: &'static str,
}

impl SpotReport {
    /// The report of an episode whose method was built from `models`; `None` for methods that are
    /// not guided, or without a plan.
    pub fn new(episode: &Episode, models: &Models) -> Option<Self> {
        let method = episode.row.method.parse().ok()?;
        Self::of(method, &episode.problem, &episode.result, models)
    }

    /// The report of what `method`, built from `models`, made of `problem`; `None` as above.
    pub fn of(
        method: Method,
        problem: &Problem,
        result: &PlanResult,
        models: &Models,
    ) -> Option<Self> {
        let guidance = result.guidance.as_ref()?;
        let seen = largest_cell(method, problem, models);
        let measured = seen.as_ref().map(|(a, _)| a.measured);
        let corners = seen
            .map(|seen| regions_in_world(problem, seen))
            .map(|both| both.map(|r| r.vertices().iter().map(|v| [v.x, v.y]).collect()));
        Some(Self {
            parking_type: problem.kind,
            frame: problem.kind.map(|_| problem.frame.origin_in_world),
            mirrored: problem.kind.is_some() && problem.frame.mirrored,
            lane_width_m: measured.map(|m| m.lane_width),
            spot_width_m: measured.map(|m| m.spot_width),
            dead_end_m: measured.map(|m| m.dead_end),
            lane_and_spot: corners,
            preparatory: guidance.preparatory.map(|p| problem.frame.world_from_local(p)),
            route: guidance.route.name(),
            explanation: guidance.route.explanation(),
        })
    }
}

/// The largest cell that a guided planner's model sees around the spot, and its grid; `None` for
/// other planners, and where the scene has no such structure.
pub fn abstraction(episode: &Episode, models: &Models) -> Option<(Abstraction, Grid)> {
    episode.result.guidance.as_ref()?;
    largest_cell(episode.row.method.parse().ok()?, &episode.problem, models)
}

fn largest_cell(method: Method, problem: &Problem, models: &Models) -> Option<(Abstraction, Grid)> {
    let grid = *models.selector(method, &problem.vehicle)?.grid(problem.kind?);
    let found = abstractions(problem.around_spot(), problem.stance()?, &grid);
    Some((*found.first()?, grid))
}

/// Its lane and its spot, in the scene's frame.
pub fn regions(episode: &Episode, models: &Models) -> Option<[Polygon; 2]> {
    Some(regions_in_world(&episode.problem, abstraction(episode, models)?))
}

fn regions_in_world(problem: &Problem, (found, grid): (Abstraction, Grid)) -> [Polygon; 2] {
    let frame = &problem.frame;
    found.regions(&grid).map(|region| region.map(|v| frame.world_from_local_point(v)))
}

impl fmt::Display for SpotReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(kind) = self.parking_type else {
            return write!(f, "  spot              none found");
        };
        write!(f, "  spot              {kind}")?;
        if let (Some(lane), Some(spot), Some(end)) =
            (self.lane_width_m, self.spot_width_m, self.dead_end_m)
        {
            // Open sides have no width.
            let width =
                if spot.is_finite() { format!("{spot:.2} m wide") } else { "open".to_owned() };
            write!(f, ", {width}; lane {lane:.2} m wide, free for {end:.2} m past it")?;
        }
        Ok(())
    }
}
