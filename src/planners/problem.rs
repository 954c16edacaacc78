//! A problem: a scene in planning coordinates, indexed and checked.

use crate::geometry::{Frame, Pose, Vec2};
use crate::vehicle::{Gear, Vehicle};
use crate::world::cell::{Cell, Grid};
use crate::world::collision::CollisionWorld;
use crate::world::scene::InvalidField;
use crate::world::spot::{self, Precision, SpotGuess};
use crate::world::{ObstacleError, Obstacles, ParkingType, Scene};

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
    /// How much farther out the lane begins than beside a usual spot, metres: the depth that a bay
    /// has on top of a usual one's, or what stands out into the lane.
    pub mouth: f64,
    /// Rear-axle start, planning frame.
    pub start: Pose,
    /// Rear-axle goal, planning frame.
    pub goal: Pose,
    /// The obstacles, planning frame.
    pub obstacles: Obstacles,
    /// The same obstacles, indexed for swept checks of this vehicle grown by the margin.
    pub collision: CollisionWorld,
    /// Clearance that plans keep from obstacles, metres: see [`Problem::with_margin`].
    pub margin: f64,
}

/// A problem that has no solution by its own data.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// A value that no scene can have.
    #[error(transparent)]
    Invalid(#[from] InvalidField),
    /// An obstacle that is none.
    #[error(transparent)]
    Obstacle(#[from] ObstacleError),
    /// A margin that no plan can keep.
    #[error("margin is {0} m; expected a number from 0 to {max}", max = Problem::MAX_MARGIN)]
    Margin(f64),
    /// The start footprint touches an obstacle or its axle is out of bounds.
    #[error("start: the footprint at {0:?} {1}")]
    StartInCollision([f64; 3], Conflict),
    /// The goal footprint touches an obstacle or its axle is out of bounds.
    #[error("goal: the footprint at {0:?} {1}")]
    GoalInCollision([f64; 3], Conflict),
}

/// What keeps a car from standing where it is to start or to park.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Conflict {
    /// It reaches into an obstacle.
    #[error("touches an obstacle: it reaches {depth:.3} m into {obstacle}")]
    Obstacle {
        /// The scene's field, such as `obstacles[3]`.
        obstacle: String,
        /// The least margin by which a smaller car would clear it, metres.
        depth: f64,
    },
    /// Its rear axle is out of the bounds.
    #[error("has its axle outside the bounds")]
    Bounds,
    /// One of both.
    #[error("touches an obstacle or leaves the bounds")]
    Unknown,
}

impl Conflict {
    /// What the car meets at `pose` of the scene, in its own frame.
    fn of(scene: &Scene, pose: Pose) -> Conflict {
        let vehicle = &scene.vehicle;
        let empty = Scene { obstacles: vec![], points: vec![], ..scene.clone() };
        let single = |obstacles: &[Vec<[f64; 2]>], points: &[[f64; 2]]| {
            let (obstacles, points) = (obstacles.to_vec(), points.to_vec());
            Scene { obstacles, points, ..empty.clone() }.geometry().ok()
        };
        let lists = scene.obstacles.chunks(1).map(|o| single(o, &[])).enumerate();
        let lists = lists.map(|(i, o)| (format!("obstacles[{i}]"), o));
        let points = scene.points.chunks(1).map(|p| single(&[], p)).enumerate();
        let points = points.map(|(i, o)| (format!("points[{i}]"), o));
        let mut deepest: Option<(String, f64)> = None;
        for (obstacle, one) in lists.chain(points) {
            let Some(one) = one else { continue };
            // The margin at which it is free: negative where the car reaches in.
            let is_free =
                |depth: f64| CollisionWorld::new(&one, None, vehicle, -depth).pose_is_free(pose);
            if is_free(0.0) {
                continue;
            }
            let (mut touching, mut free) = (0.0, vehicle.width.min(vehicle.length) / 2.0);
            while free - touching > 1e-4 {
                let middle = f64::midpoint(touching, free);
                *(if is_free(middle) { &mut free } else { &mut touching }) = middle;
            }
            if deepest.as_ref().is_none_or(|(_, depth)| free > *depth) {
                deepest = Some((obstacle, free));
            }
        }
        let out = |b: [f64; 4]| pose.x < b[0] || pose.y < b[1] || pose.x > b[2] || pose.y > b[3];
        match deepest {
            Some((obstacle, depth)) => Conflict::Obstacle { obstacle, depth },
            None if scene.bounds.is_some_and(out) => Conflict::Bounds,
            None => Conflict::Unknown,
        }
    }
}

impl Problem {
    /// Clearance that plans keep from obstacles where start and goal allow it, metres, for the
    /// default vehicle; for others in proportion to their length. Room for consumers that
    /// interpolate sampled poses linearly.
    pub const MARGIN: f64 = 0.005;

    /// The largest margin that can be asked for, metres.
    pub const MAX_MARGIN: f64 = 1.0;

    /// The problem of a scene, with the usual [`Problem::MARGIN`].
    pub fn new(scene: &Scene) -> Result<Problem, ProblemError> {
        Self::with_margin(scene, Self::MARGIN)
    }

    /// [`Problem::new`] without rounding anything ([`Precision`]): what policies are trained in,
    /// where nothing is to be the same anywhere on a map.
    pub fn as_given(scene: &Scene) -> Result<Problem, ProblemError> {
        Self::seen(scene, Self::MARGIN, Precision::Given)
    }

    /// The problem of a scene whose plans keep `margin` metres from obstacles, and
    /// never less than [`Problem::MARGIN`], where start and goal allow it.
    ///
    /// A plan contains its start and its goal. From the obstacles that one of them is nearer to, less
    /// is kept along the whole plan: the most whole centimetres that both allow, the usual margin
    /// where that is less than one, and 0 where they do not allow that either. The field `margin`
    /// says what it came to. From all others the plan keeps what was asked for.
    pub fn with_margin(scene: &Scene, margin: f64) -> Result<Problem, ProblemError> {
        if !(0.0..=Self::MAX_MARGIN).contains(&margin) {
            return Err(ProblemError::Margin(margin));
        }
        Self::seen(scene, margin, Precision::Rounded)
    }

    fn seen(scene: &Scene, margin: f64, precision: Precision) -> Result<Problem, ProblemError> {
        scene.check_numbers()?;
        let SpotGuess { frame, kind, obstacles, mouth } = spot::guess(scene, precision)?;
        let bounds = scene.bounds.map(|b| spot::bounds_in_frame(b, &frame, precision));
        let start = precision.pose(frame.local_from_world(scene.start));
        let goal = match precision {
            Precision::Given => frame.local_from_world(scene.goal),
            // By the frame's definition, without its rounding.
            Precision::Rounded => kind.map_or(Pose::default(), |kind| {
                scene.vehicle.rear_axle(Pose::new(0.0, 0.0, kind.goal_heading()))
            }),
        };
        let problem =
            Self::checked(scene.vehicle, frame, kind, [start, goal], obstacles, bounds, margin);
        problem.map(|problem| Problem { mouth, ..problem }).map_err(|e| match e {
            ProblemError::StartInCollision(..) => {
                ProblemError::StartInCollision(scene.start.into(), Conflict::of(scene, scene.start))
            }
            ProblemError::GoalInCollision(..) => {
                ProblemError::GoalInCollision(scene.goal.into(), Conflict::of(scene, scene.goal))
            }
            other => other,
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
        let (walls, ends) = (grid.walls(cell)?, [start, goal]);
        Self::checked(vehicle, Frame::WORLD, Some(cell.kind), ends, walls, None, Self::MARGIN)
    }

    fn checked(
        vehicle: Vehicle,
        frame: Frame,
        kind: Option<ParkingType>,
        [start, goal]: [Pose; 2],
        obstacles: Obstacles,
        bounds: Option<[Vec2; 4]>,
        margin: f64,
    ) -> Result<Problem, ProblemError> {
        let least = Self::MARGIN * vehicle.scale();
        let mut margin = if margin > Self::MARGIN { margin.max(least) } else { least };
        let mut collision = CollisionWorld::new(&obstacles, bounds, &vehicle, margin);
        let ends_are_free =
            |world: &CollisionWorld| world.pose_is_free(start) && world.pose_is_free(goal);
        if !ends_are_free(&collision) {
            // What is next to start or goal keeps the whole plan from the margin, but only from
            // its own: everything else is kept as far away as was asked for.
            let alone = |one: &Obstacles, margin| CollisionWorld::new(one, None, &vehicle, margin);
            let (kept, close) = obstacles.partition(|one| ends_are_free(&alone(one, margin)));
            let far = CollisionWorld::new(&kept, bounds, &vehicle, margin);
            for smaller in Self::margins_below(margin, least) {
                margin = smaller;
                if ends_are_free(&alone(&close, margin)) {
                    break;
                }
            }
            collision = far.tolerating(&close, &vehicle, margin);
        }
        if !collision.pose_is_free(start) {
            return Err(ProblemError::StartInCollision(start.into(), Conflict::Unknown));
        }
        if !collision.pose_is_free(goal) {
            return Err(ProblemError::GoalInCollision(goal.into(), Conflict::Unknown));
        }
        let mouth = 0.0;
        Ok(Problem { vehicle, frame, kind, mouth, start, goal, obstacles, collision, margin })
    }

    /// What is tried in turn where start or goal does not allow `margin`, metres.
    fn margins_below(margin: f64, least: f64) -> impl Iterator<Item = f64> {
        let centimetres = (1..100).rev().map(|cm| f64::from(cm) / 100.0);
        centimetres.chain([least]).filter(move |&m| m < margin).chain([0.0])
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
