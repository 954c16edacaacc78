//! A problem: a scene in planning coordinates, indexed and checked.

use super::Shape;
use super::conflict::Conflict;
use super::contact::Contact;
use crate::curves::smoothing::StandstillSteering;
use crate::geometry::{Aabb, Frame, Pose, Vec2};
use crate::vehicle::{Gear, Margins, Vehicle};
use crate::world::cell::{Cell, Grid};
use crate::world::collision::{CollisionWorld, Contour};
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
    /// The curvature that the wheels stand for at the start, 1/m, planning frame.
    pub start_curvature: f64,
    /// Rear-axle goal, planning frame.
    pub goal: Pose,
    /// The obstacles, planning frame.
    pub obstacles: Obstacles,
    /// Those that the spot and its lane can be made of, where there are many more: see
    /// [`Problem::around_spot`].
    pub(super) around: Option<Obstacles>,
    /// What only wheels keep off, planning frame.
    pub low: Obstacles,
    /// The vehicle's outline within its footprint, where it is not all of it, as seen in the planning frame.
    pub contour: Option<Contour>,
    /// Clearance asked for on each side of the vehicle, as seen in the planning frame.
    pub margins: Margins,
    /// The same obstacles, indexed for swept checks of this vehicle grown by the margin.
    pub collision: CollisionWorld,
    /// Clearance that plans keep from obstacles, metres, on the side where it is least: see
    /// [`Problem::with_margin`].
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

/// What a car plans among, as seen in the planning frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Place {
    pub obstacles: Obstacles,
    pub low: Obstacles,
    pub bounds: Option<[Vec2; 4]>,
    pub contour: Option<Contour>,
    pub margins: Margins,
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

impl Problem {
    /// Clearance that plans keep from obstacles where start and goal allow it, metres, for the
    /// default vehicle; for others in proportion to their length. Room for consumers that
    /// interpolate sampled poses linearly.
    pub const MARGIN: f64 = 0.005;

    /// Ends of a path may differ from start and goal by accumulated rounding only, metres and
    /// radians.
    pub(super) const ROUNDING: f64 = 1e-6;

    /// Most of what is checked lies within so much of start and goal, metres for the default vehicle: where searches go
    /// first, and the car there.
    const ABOUT: f64 = 16.0;

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
        let SpotGuess { frame, stance, obstacles, around, mouth } = spot::guess(scene, precision)?;
        let bounds = scene.bounds.map(|b| spot::bounds_in_frame(b, &frame, precision));
        let start = precision.pose(frame.local_from_world(scene.start));
        let goal = match precision {
            Precision::Given => frame.local_from_world(scene.goal),
            // By the frame's definition, without its rounding.
            Precision::Rounded => stance.map_or(Pose::default(), |stance| {
                scene.vehicle.rear_axle(Pose::new(0.0, 0.0, stance.heading()))
            }),
        };
        let outside = [(scene.start, true), (scene.goal, false)];
        if let Some((pose, is_start)) = outside.into_iter().find(|(p, _)| !scene.is_in_area(*p)) {
            let error = if is_start {
                ProblemError::StartInCollision
            } else {
                ProblemError::GoalInCollision
            };
            return Err(error(pose.into(), Conflict::Area));
        }
        let place = Place {
            obstacles,
            low: spot::low_in_frame(scene, &frame, precision)?,
            bounds,
            contour: scene.contour_in(&frame)?,
            margins: scene.margins_in(&frame),
        };
        let kind = stance.map(Stance::kind);
        let mut problem = Self::checked(scene.vehicle, frame, kind, [start, goal], place, terms)?;
        problem.mouth = mouth;
        let curvature = scene.vehicle.curvature(scene.start_steer);
        problem.start_curvature = frame.flip_curvature(curvature);
        problem.around = around;
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
        let place = Place { obstacles: walls, ..Place::default() };
        Self::checked(vehicle, Frame::WORLD, Some(cell.kind()), ends, place, Terms::default())
    }

    pub(super) fn checked(
        vehicle: Vehicle,
        frame: Frame,
        kind: Option<ParkingType>,
        [start, goal]: [Pose; 2],
        place: Place,
        terms: Terms,
    ) -> Result<Problem, ProblemError> {
        let Place { obstacles, low, bounds, contour, margins } = place;
        let least = Self::usual_margin(&vehicle);
        let asked = terms.margin;
        let sides = margins.at_least(if asked > Self::MARGIN { asked.max(least) } else { least });
        // No more than this is kept on any side.
        let mut margin = sides.most();
        let alone = |one: &Obstacles, margin: f64| {
            CollisionWorld::of(one, None, &vehicle, contour.as_ref(), sides.at_most(margin))
        };
        let mut collision =
            CollisionWorld::of(&obstacles, bounds, &vehicle, contour.as_ref(), sides);
        let mut contact = None;
        let ends_are_free =
            |world: &CollisionWorld| world.pose_is_free(start) && world.pose_is_free(goal);
        if !ends_are_free(&collision) {
            // What is next to start or goal keeps the whole plan from the margin, but only from
            // its own: everything else is kept as far away as was asked for.
            let body = |pose: Pose| vehicle.footprint_at(pose).aabb().inflated(2.0 * margin);
            let [a, b] = [start, goal].map(body);
            let ends = Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) };
            let (beside, away) = obstacles.split_at(&ends);
            let (kept, mut close) = beside.partition(|one| ends_are_free(&alone(one, margin)));
            let kept = kept.and(away);
            let far = CollisionWorld::of(&kept, bounds, &vehicle, contour.as_ref(), sides);
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
            collision = far.tolerating(alone(&close, margin));
            if !touched.is_empty() {
                let found = Contact::new(&touched, &vehicle, [start, goal], bounds, asked);
                let depth = found.start_depth.max(found.goal_depth);
                // Where it is deeper than allowed the shrunken car still touches, and is refused.
                let shrunk = -depth.min(terms.contact);
                collision =
                    collision.tolerating(CollisionWorld::new(&touched, None, &vehicle, shrunk));
                (margin, contact) = (0.0, Some(found));
            }
        }
        if !low.is_empty() {
            let wheels = |margin: f64| {
                let empty = CollisionWorld::new(&Obstacles::default(), None, &vehicle, 0.0);
                empty.keeping_wheels_off(&low, &vehicle, sides.at_most(margin))
            };
            let tried =
                std::iter::once(sides.most()).chain(Self::margins_below(sides.most(), least));
            let kept = tried.into_iter().find(|&m| ends_are_free(&wheels(m))).unwrap_or(0.0);
            collision = collision.keeping_wheels_off(&low, &vehicle, sides.at_most(kept));
            margin = margin.min(kept);
        }
        if !collision.pose_is_free(start) {
            return Err(ProblemError::StartInCollision(start.into(), Conflict::Unknown));
        }
        if !collision.pose_is_free(goal) {
            return Err(ProblemError::GoalInCollision(goal.into(), Conflict::Unknown));
        }
        let margin = sides.at_most(margin).least();
        let about = Aabb::around([start, goal].map(|pose| pose.position()));
        let collision = collision.focused_on(about.inflated(Self::ABOUT * vehicle.scale()));
        Ok(Problem {
            vehicle,
            frame,
            kind,
            mouth: 0.0,
            start,
            start_curvature: 0.0,
            goal,
            obstacles,
            around: None,
            low,
            contour,
            margins,
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

    /// The obstacles that the spot and its lane can be made of, and perhaps others.
    pub fn around_spot(&self) -> &Obstacles {
        self.around.as_ref().unwrap_or(&self.obstacles)
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
