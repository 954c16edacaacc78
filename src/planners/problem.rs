//! A problem: a scene in planning coordinates, indexed and checked.

use super::Shape;
use super::contact::{Contact, depth_into};
use crate::curves::smoothing::StandstillSteering;
use crate::geometry::{Aabb, Frame, Pose, Vec2};
use crate::vehicle::{Gear, Vehicle};
use crate::world::cell::{Cell, Grid};
use crate::world::collision::CollisionWorld;
use crate::world::scene::InvalidField;
use crate::world::spot::{self, Precision, SpotGuess};
use crate::world::{GoalTolerance, ObstacleError, Obstacles, ParkingType, Scene, Stance};

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
    /// What start or goal touches, where that is allowed: see [`Problem::allowing_contact`].
    pub contact: Option<Contact>,
    /// Where plans may end besides the goal: within this tolerance of this pose, planning frame.
    pub tolerance: Option<(Pose, GoalTolerance)>,
}

/// What plans keep to besides reaching a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Clearance where start and goal allow it, metres: see [`Problem::with_margin`].
    pub margin: f64,
    /// How deep start and goal may reach into obstacles, metres: see [`Problem::allowing_contact`].
    pub contact: f64,
    /// Where the steering wheel may be turned while the car stands.
    pub standstill: StandstillSteering,
    /// The shape of paths.
    pub shape: Shape,
}

impl Terms {
    /// Whether paths are taken as planners make them: arcs and straights of any shape.
    pub(super) fn are_usual(&self) -> bool {
        self.standstill == StandstillSteering::Anywhere && self.shape == Shape::default()
    }

    /// The least length of a move and of the straight at the end that are asked for, metres.
    pub(super) fn lengths(&self, vehicle: &Vehicle) -> [f64; 2] {
        let usual = match self.standstill {
            StandstillSteering::Anywhere => [0.0, 0.0],
            _ => [0.3, 0.5].map(|metres| metres * vehicle.scale()),
        };
        let Shape { least_move, last_straight } = self.shape;
        [least_move.unwrap_or(usual[0]), last_straight.unwrap_or(usual[1])]
    }

    /// Checks every number.
    pub fn check(self) -> Result<(), ProblemError> {
        if !(0.0..=Problem::MAX_MARGIN).contains(&self.margin) {
            return Err(ProblemError::Margin(self.margin));
        }
        if !(0.0..=Problem::MAX_CONTACT).contains(&self.contact) {
            return Err(ProblemError::Contact(self.contact));
        }
        let Shape { least_move, last_straight } = self.shape;
        for (field, value) in [("least_move", least_move), ("last_straight", last_straight)] {
            let value = value.unwrap_or(0.0);
            if !(0.0..=Shape::MOST).contains(&value) {
                return Err(ProblemError::Shape(field, value));
            }
        }
        Ok(())
    }
}

impl Default for Terms {
    /// The usual margin, no contact, and arcs.
    fn default() -> Self {
        let standstill = StandstillSteering::Anywhere;
        Self { margin: Problem::MARGIN, contact: 0.0, standstill, shape: Shape::default() }
    }
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
    /// An allowance for contact that is none.
    #[error(
        "allowed contact is {0} m; expected a number from 0 to {max}",
        max = Problem::MAX_CONTACT
    )]
    Contact(f64),
    /// A length of the shape of paths that is none.
    #[error("{0} is {1} m; expected a number from 0 to {max}", max = Shape::MOST)]
    Shape(&'static str, f64),
    /// The start footprint touches an obstacle or its axle is out of bounds.
    #[error("start: the footprint at {0:?} {1}")]
    StartInCollision([f64; 3], Conflict),
    /// The goal footprint touches an obstacle or its axle is out of bounds.
    #[error("goal: the footprint at {0:?} {1}")]
    GoalInCollision([f64; 3], Conflict),
    /// The same of every one of several goals: their fields and why.
    #[error("no goal is free: {}", listed(.0))]
    NoGoalFree(Vec<(String, ProblemError)>),
}

impl ProblemError {
    /// The same error, saying what it is that start or goal of `scene` touch.
    fn explained(self, scene: &Scene) -> ProblemError {
        match self {
            Self::StartInCollision(..) => {
                Self::StartInCollision(scene.start.into(), Conflict::of(scene, scene.start))
            }
            Self::GoalInCollision(..) => {
                Self::GoalInCollision(scene.goal.into(), Conflict::of(scene, scene.goal))
            }
            other => other,
        }
    }
}

/// What is wrong with each goal, in one line.
fn listed(goals: &[(String, ProblemError)]) -> String {
    let one = |(field, error): &(String, ProblemError)| match error {
        ProblemError::GoalInCollision(pose, conflict) => {
            format!("{field}: the footprint at {pose:?} {conflict}")
        }
        other => format!("{field}: {other}"),
    };
    goals.iter().map(one).collect::<Vec<_>>().join("; ")
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
        let body = vehicle.footprint_at(pose).aabb().inflated(1e-3);
        let is_near = |corners: &[[f64; 2]]| {
            Aabb::around(corners.iter().map(|&[x, y]| Vec2::new(x, y))).intersects(&body)
        };
        let lists = scene.obstacles.chunks(1).enumerate().filter(|(_, o)| is_near(&o[0]));
        let lists = lists.map(|(i, o)| (format!("obstacles[{i}]"), single(o, &[])));
        let points = scene.points.chunks(1).enumerate().filter(|(_, p)| is_near(p));
        let points = points.map(|(i, p)| (format!("points[{i}]"), single(&[], p)));
        let mut deepest: Option<(String, f64)> = None;
        for (obstacle, one) in lists.chain(points) {
            let Some(one) = one else { continue };
            let free = depth_into(&CollisionWorld::new(&one, None, vehicle, 0.0), vehicle, pose);
            if free == 0.0 {
                continue;
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

    /// Ends of a path may differ from start and goal by accumulated rounding only, metres and
    /// radians.
    pub(super) const ROUNDING: f64 = 1e-6;

    /// The largest margin that can be asked for, metres.
    pub const MAX_MARGIN: f64 = 1.0;

    /// The deepest contact that can be allowed, metres: more than localisation errs by, and less
    /// than what a car is made of can be mistaken for.
    pub const MAX_CONTACT: f64 = 0.2;

    /// Whether the start lies about a vehicle's length from the goal or nearer: as a rule within some
    /// manoeuvre.
    pub(crate) fn starts_at_the_spot(&self) -> bool {
        self.start.distance(self.goal) < 1.1 * self.vehicle.length
    }

    /// [`Problem::MARGIN`] for a vehicle of this size, metres.
    pub fn usual_margin(vehicle: &Vehicle) -> f64 {
        Self::MARGIN * vehicle.scale()
    }

    /// The problem of a scene, with the usual [`Problem::MARGIN`].
    pub fn new(scene: &Scene) -> Result<Problem, ProblemError> {
        Self::with_margin(scene, Self::MARGIN)
    }

    /// [`Problem::new`] without rounding anything ([`Precision`]): what policies are trained in,
    /// where nothing is to be the same anywhere on a map.
    pub fn as_given(scene: &Scene) -> Result<Problem, ProblemError> {
        Self::seen(scene, Terms::default(), Precision::Given)
            .map_err(|error| error.explained(scene))
    }

    /// The problem of a scene whose plans keep `margin` metres from obstacles, and
    /// never less than [`Problem::MARGIN`], where start and goal allow it.
    ///
    /// A plan contains its start and its goal. From the obstacles that one of them is nearer to, less
    /// is kept along the whole plan: the most whole centimetres that both allow, the usual margin
    /// where that is less than one, and 0 where they do not allow that either. The field `margin`
    /// says what it came to. From all others the plan keeps what was asked for.
    pub fn with_margin(scene: &Scene, margin: f64) -> Result<Problem, ProblemError> {
        Self::allowing_contact(scene, margin, 0.0)
    }

    /// [`Problem::with_margin`] for a start or a goal that may reach up to `contact` metres into
    /// obstacles, because those who measured it err: see [`Contact`] for what plans keep then. Where
    /// there is contact `margin` is 0. [`goals::plan`](super::goals::plan) plans such
    /// problems best; a planner alone often finds nothing that is certified.
    pub fn allowing_contact(
        scene: &Scene,
        margin: f64,
        contact: f64,
    ) -> Result<Problem, ProblemError> {
        let terms = Terms { margin, contact, ..Terms::default() };
        Self::unexplained(scene, terms).map_err(|error| error.explained(scene))
    }

    /// [`Problem::allowing_contact`] whose errors do not say what start or goal touch: finding that
    /// out takes a while.
    pub(super) fn unexplained(scene: &Scene, terms: Terms) -> Result<Problem, ProblemError> {
        terms.check()?;
        Self::seen(scene, terms, Precision::Rounded)
    }

    fn seen(scene: &Scene, terms: Terms, precision: Precision) -> Result<Problem, ProblemError> {
        scene.check_numbers()?;
        let SpotGuess { frame, stance, obstacles, mouth } = spot::guess(scene, precision)?;
        let bounds = scene.bounds.map(|b| spot::bounds_in_frame(b, &frame, precision));
        let start = precision.pose(frame.local_from_world(scene.start));
        let goal = match precision {
            Precision::Given => frame.local_from_world(scene.goal),
            // By the frame's definition, without its rounding.
            Precision::Rounded => stance.map_or(Pose::default(), |stance| {
                scene.vehicle.rear_axle(Pose::new(0.0, 0.0, stance.heading()))
            }),
        };
        let kind = stance.map(Stance::kind);
        let seen =
            Self::checked(scene.vehicle, frame, kind, [start, goal], obstacles, bounds, terms);
        let mut problem = seen?;
        problem.mouth = mouth;
        problem.tolerance = scene.goal_tolerance.map(|tolerance| (goal, tolerance));
        Ok(problem)
    }

    /// The problem of parking in an abstracted environment, as the data collection does.
    pub fn in_cell(
        grid: &Grid,
        cell: &Cell,
        vehicle: Vehicle,
        start: Pose,
    ) -> Result<Problem, ProblemError> {
        let goal = grid.goal(cell.stance, &vehicle);
        let (walls, ends) = (grid.walls(cell)?, [start, goal]);
        let terms = Terms::default();
        Self::checked(vehicle, Frame::WORLD, Some(cell.kind()), ends, walls, None, terms)
    }

    pub(super) fn checked(
        vehicle: Vehicle,
        frame: Frame,
        kind: Option<ParkingType>,
        [start, goal]: [Pose; 2],
        obstacles: Obstacles,
        bounds: Option<[Vec2; 4]>,
        terms: Terms,
    ) -> Result<Problem, ProblemError> {
        let least = Self::usual_margin(&vehicle);
        let asked = terms.margin;
        let mut margin = if asked > Self::MARGIN { asked.max(least) } else { least };
        let mut collision = CollisionWorld::new(&obstacles, bounds, &vehicle, margin);
        let mut contact = None;
        let ends_are_free =
            |world: &CollisionWorld| world.pose_is_free(start) && world.pose_is_free(goal);
        if !ends_are_free(&collision) {
            // What is next to start or goal keeps the whole plan from the margin, but only from
            // its own: everything else is kept as far away as was asked for.
            let alone = |one: &Obstacles, margin| CollisionWorld::new(one, None, &vehicle, margin);
            let (kept, mut close) = obstacles.partition(|one| ends_are_free(&alone(one, margin)));
            let far = CollisionWorld::new(&kept, bounds, &vehicle, margin);
            let mut touched = Obstacles::default();
            if terms.contact > 0.0 {
                (close, touched) = close.partition(|one| ends_are_free(&alone(one, 0.0)));
            }
            for smaller in Self::margins_below(margin, least) {
                margin = smaller;
                if ends_are_free(&alone(&close, margin)) {
                    break;
                }
            }
            collision = far.tolerating(&close, &vehicle, margin);
            if !touched.is_empty() {
                let found = Contact::new(&touched, &vehicle, [start, goal], bounds, asked);
                let depth = found.start_depth.max(found.goal_depth);
                // Where it is deeper than allowed the shrunken car still touches, and is refused.
                let shrunk = -depth.min(terms.contact);
                collision = collision.tolerating(&touched, &vehicle, shrunk);
                (margin, contact) = (0.0, Some(found));
            }
        }
        if !collision.pose_is_free(start) {
            return Err(ProblemError::StartInCollision(start.into(), Conflict::Unknown));
        }
        if !collision.pose_is_free(goal) {
            return Err(ProblemError::GoalInCollision(goal.into(), Conflict::Unknown));
        }
        Ok(Problem {
            vehicle,
            frame,
            kind,
            mouth: 0.0,
            start,
            goal,
            obstacles,
            collision,
            margin,
            contact,
            tolerance: None,
        })
    }

    /// Whether a path that ends at `pose` has arrived: at the goal, or within the tolerance that the
    /// scene gives.
    pub fn is_arrival(&self, pose: Pose) -> bool {
        let exactly = GoalTolerance::default().holds(self.goal, pose, Self::ROUNDING);
        exactly || self.tolerance.is_some_and(|(goal, t)| t.holds(goal, pose, Self::ROUNDING))
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
        self.stance().map_or(&[Gear::Forward, Gear::Backward], Stance::entry_gears)
    }

    /// How the parked car stands in its spot; `None` where no spot is known.
    pub fn stance(&self) -> Option<Stance> {
        self.kind.map(|kind| Stance::new(kind, self.goal.heading))
    }
}
