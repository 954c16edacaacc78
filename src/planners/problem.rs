//! A problem: a scene in planning coordinates, indexed and checked.

use crate::geometry::{Frame, Pose};
use crate::vehicle::{Gear, Vehicle};
use crate::world::cell::{Cell, Grid};
use crate::world::collision::CollisionWorld;
use crate::world::spot::{self, SpotGuess};
use crate::world::{Obstacles, ParkingType, Scene};

/// What planners see: everything in the planning frame (the spot frame where the scene
/// has a spot, else the goal's own frame), so that results do not depend on where in the
/// world a scene lies.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The car.
    pub vehicle: Vehicle,
    /// The planning frame in the world.
    pub frame: Frame,
    /// How the goal lies in its spot; `None` where no spot is known.
    pub kind: Option<ParkingType>,
    /// Rear-axle start, planning frame.
    pub start: Pose,
    /// Rear-axle goal, planning frame.
    pub goal: Pose,
    /// The obstacles, planning frame.
    pub obstacles: Obstacles,
    /// The same obstacles, indexed for swept checks of this vehicle.
    pub collision: CollisionWorld,
}

/// A problem that has no solution by its own data.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// The start footprint touches an obstacle or its axle is out of bounds.
    #[error("start: the footprint at {0:?} touches an obstacle or leaves the bounds")]
    StartInCollision([f64; 3]),
    /// The goal footprint touches an obstacle or its axle is out of bounds.
    #[error("goal: the footprint at {0:?} touches an obstacle or leaves the bounds")]
    GoalInCollision([f64; 3]),
}

impl Problem {
    /// Clearance that plans keep from obstacles where start and goal allow it, metres.
    /// Room for consumers that interpolate sampled poses linearly.
    pub const MARGIN: f64 = 0.005;

    /// The problem of a validated scene.
    pub fn new(scene: &Scene) -> Result<Problem, ProblemError> {
        let SpotGuess { frame, kind, obstacles } = spot::guess(scene);
        let bounds = scene.bounds.map(|b| spot::bounds_in_frame(b, &frame));
        let start = frame.local_from_world(scene.start);
        let goal = frame.local_from_world(scene.goal);
        Self::checked(scene.vehicle, frame, kind, start, goal, obstacles, bounds).map_err(|e| {
            match e {
                ProblemError::StartInCollision(_) => {
                    ProblemError::StartInCollision(scene.start.into())
                }
                ProblemError::GoalInCollision(_) => {
                    ProblemError::GoalInCollision(scene.goal.into())
                }
            }
        })
    }

    /// The problem of parking in an abstracted environment, as the data collection does.
    pub fn in_cell(
        grid: &Grid,
        cell: &Cell,
        vehicle: Vehicle,
        start: Pose,
    ) -> Result<Problem, ProblemError> {
        let goal = grid.goal(cell.kind, &vehicle);
        let walls = grid.walls(cell);
        Self::checked(vehicle, Frame::WORLD, Some(cell.kind), start, goal, walls, None)
    }

    fn checked(
        vehicle: Vehicle,
        frame: Frame,
        kind: Option<ParkingType>,
        start: Pose,
        goal: Pose,
        obstacles: Obstacles,
        bounds: Option<[crate::geometry::Vec2; 4]>,
    ) -> Result<Problem, ProblemError> {
        let mut collision = CollisionWorld::new(&obstacles, bounds, &vehicle, Self::MARGIN);
        if !(collision.pose_is_free(start) && collision.pose_is_free(goal)) {
            collision = collision.with_margin(&vehicle, 0.0);
        }
        if !collision.pose_is_free(start) {
            return Err(ProblemError::StartInCollision(start.into()));
        }
        if !collision.pose_is_free(goal) {
            return Err(ProblemError::GoalInCollision(goal.into()));
        }
        Ok(Problem { vehicle, frame, kind, start, goal, obstacles, collision })
    }

    /// Gears in which a straight may enter the spot: the goal of a bay is the *set* of
    /// poses from which a straight leads to the parked pose. Both gears for parallel spots,
    /// where a car backs in and pulls forward, and where the kind of spot is unknown.
    pub fn entry_gears(&self) -> &'static [Gear] {
        match self.kind {
            Some(ParkingType::Forward) => &[Gear::Forward],
            Some(ParkingType::Reverse) => &[Gear::Backward],
            Some(ParkingType::Parallel) | None => &[Gear::Forward, Gear::Backward],
        }
    }
}
