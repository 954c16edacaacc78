//! The planner to embed: made once for a vehicle, asked as often as one likes.

use std::borrow::{Borrow, Cow};
use std::num::NonZero;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::curves::smoothing::StandstillSteering;
use crate::curves::trajectory::LimitError;
use crate::curves::{Path, SmoothPath, TrajectoryLimits};
use crate::geometry::{Frame, Pose};
use crate::n3p::{Method, MethodError, MethodSettings, Models, ModelsError};
use crate::output::{Driven, PathFile};
use crate::planners::cost::CostModel;
use crate::planners::goals::{self, Terms};
use crate::planners::{Budget, HybridAStarConfig, NoPath, Planner, ProblemError, Route, Shape};
use crate::vehicle::{Margins, Vehicle, VehicleError};
use crate::world::maps::cells::{Block, blocks};
use crate::world::{DrivableArea, GoalTolerance, LowObstacles, ParkingType, PreviousPath, Scene};

/// Plans for one vehicle. Shared between threads by reference: each call borrows a planner of its
/// own, and what one call leaves behind never changes the result of another.
///
/// ```
/// use n3p::{Lot, Parker, Vehicle};
/// use n3p::curves::TrajectoryLimits;
/// use n3p::geometry::Pose;
///
/// let parker = Parker::new(Vehicle::default())?;
/// // Two parked cars, a bay between them, and the kerb across the lane. Metres and radians; a pose
/// // is that of the rear-axle centre.
/// let mut lot = Lot::new();
/// lot.polygon([[-4.1, -2.6], [-1.6, -2.6], [-1.6, 2.4], [-4.1, 2.4]]);
/// lot.polygon([[1.6, -2.6], [4.1, -2.6], [4.1, 2.4], [1.6, 2.4]]);
/// lot.polyline([[-15.0, 9.5], [15.0, 9.5]]);
/// let start = Pose::new(-9.0, 6.0, 0.0);
/// let goal = Pose::new(0.0, -1.4, std::f64::consts::FRAC_PI_2);
/// let plan = parker.plan(start, goal, &lot)?;
/// assert!(plan.length() < 30.0);
/// let driven = plan.trajectory(&TrajectoryLimits::default())?;
/// assert!(driven.moments.last().unwrap().speed == 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Parker {
    vehicle: Vehicle,
    method: Method,
    models: Models,
    settings: MethodSettings,
    terms: Terms,
    budget: Budget,
    /// Planners that nobody uses just now.
    idle: Mutex<Vec<Box<dyn Planner + Send>>>,
}

/// A parker that cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum ParkerError {
    /// The vehicle is none.
    #[error("vehicle: {0}")]
    Vehicle(#[from] VehicleError),
    /// A model cannot be used, or none serves the vehicle.
    #[error(transparent)]
    Models(#[from] ModelsError),
    /// The method cannot be built.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// A margin, a contact or a length beyond what can be asked for.
    #[error("{0}")]
    Terms(ProblemError),
    /// A weight of the costs that is none.
    #[error("{0}")]
    Cost(String),
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// What was asked is no problem: a number that is none, a start or a goal that is not free.
    #[error("{0}")]
    Problem(ProblemError),
    /// A request has no goal.
    #[error("the request has no goal; give at least one pose")]
    NoGoal,
    /// A scene has another vehicle than the parker.
    #[error("the scene's vehicle is not the one that this parker was made for; make one for it")]
    OtherVehicle,
    /// There is no path, or none was found within the budget.
    #[error("no path: {0}")]
    NoPath(NoPath),
}

impl Parker {
    /// Plans for `vehicle` by `n3p` with the models compiled in (feature `models`), and by the search
    /// of `ha-rs` where there are none.
    pub fn new(vehicle: Vehicle) -> Result<Self, ParkerError> {
        Self::with_models(vehicle, Models::compiled_in(&vehicle)?)
    }

    /// The same with models of your own, such as [`Models::load`] reads from files.
    pub fn with_models(vehicle: Vehicle, models: Models) -> Result<Self, ParkerError> {
        let serves = models.selector(Method::N3P, &vehicle).is_some();
        Self::by(if serves { Method::N3P } else { Method::HA_RS }, vehicle, models)
    }

    /// The same by any method.
    pub fn by(method: Method, vehicle: Vehicle, models: Models) -> Result<Self, ParkerError> {
        vehicle.validate()?;
        models.check_vehicle(method, "of the parker", &vehicle)?;
        let settings = MethodSettings::default();
        let planner = method.build(&models, &settings)?;
        let (terms, budget, idle) =
            (Terms::default(), Budget::default(), Mutex::new(vec![planner]));
        Ok(Self { vehicle, method, models, settings, terms, budget, idle })
    }

    /// The same keeping `metres` from obstacles where start and goal allow it, 0 to
    /// [`Problem::MAX_MARGIN`](crate::planners::Problem::MAX_MARGIN).
    pub fn margin(self, metres: f64) -> Result<Self, ParkerError> {
        Self { terms: Terms { margin: metres, ..self.terms }, ..self }.checked()
    }

    /// The same also from starts and to goals that reach up to `metres` into an obstacle.
    pub fn allow_contact(self, metres: f64) -> Result<Self, ParkerError> {
        Self { terms: Terms { contact: metres, ..self.terms }, ..self }.checked()
    }

    /// The same with steering that is continuous while the car drives: the wheels turn at standstill only
    /// where `standstill` lets them. A path that cannot be driven so is none:
    /// [`NoPath::NotSmooth`](crate::planners::NoPath::NotSmooth).
    pub fn standstill_steering(self, standstill: StandstillSteering) -> Self {
        Self { terms: Terms { standstill, ..self.terms }, ..self }
    }

    /// Planners kept for later calls, at most: after a crowd of callers the rest would only hold
    /// memory, about 100 kB each.
    const KEPT: usize = 64;

    fn checked(self) -> Result<Self, ParkerError> {
        self.terms.check().map_err(ParkerError::Terms)?;
        Ok(self)
    }

    /// The same with other lengths asked of moves and of the straight at the end; see [`Shape`] for what is usual.
    pub fn shape(self, shape: Shape) -> Result<Self, ParkerError> {
        Self { terms: Terms { shape, ..self.terms }, ..self }.checked()
    }

    /// The same by other costs: what a plan prefers, such as fewer changes of gear to a short way.
    pub fn cost(self, cost: CostModel) -> Result<Self, ParkerError> {
        cost.validate().map_err(ParkerError::Cost)?;
        let planner = HybridAStarConfig { cost, ..self.settings.planner };
        let settings = MethodSettings { planner, ..self.settings };
        // Planners of before would plan by the costs of before.
        let idle = Mutex::new(vec![self.method.build(&self.models, &settings)?]);
        Ok(Self { settings, idle, ..self })
    }

    /// The same with another budget of work.
    pub fn budget(self, budget: Budget) -> Self {
        Self { budget, ..self }
    }

    /// The vehicle planned for.
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// The method planned by.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The path from `start` to `goal` among what stands in `lot`.
    pub fn plan(&self, start: Pose, goal: Pose, lot: &Lot) -> Result<Plan, PlanError> {
        self.plan_request(&Request::new(start, goal), lot)
    }

    /// The path for a request, which may have several goals, a tolerance and a hint.
    pub fn plan_request(&self, request: &Request, lot: &Lot) -> Result<Plan, PlanError> {
        if request.goals.is_empty() {
            return Err(PlanError::NoGoal);
        }
        self.plan_scene(&lot.scene(self.vehicle, request))
    }

    /// The path for a scene, whose vehicle must be the one planned for.
    pub fn plan_scene(&self, scene: &Scene) -> Result<Plan, PlanError> {
        if scene.vehicle != self.vehicle {
            return Err(PlanError::OtherVehicle);
        }
        let mut planner = self.borrow();
        let planned = self.plan_by(planner.as_mut(), scene);
        let mut idle = self.idle.lock().unwrap_or_else(|e| e.into_inner());
        if idle.len() < Self::KEPT {
            idle.push(planner);
        }
        planned
    }

    /// A plan for each request, by all cores; the same as one by one.
    pub fn plan_batch(&self, requests: &[(Request, &Lot)]) -> Vec<Result<Plan, PlanError>> {
        self.batch(requests.len(), |i| self.plan_request(&requests[i].0, requests[i].1))
    }

    /// A plan for each scene, by all cores; the same as one by one.
    pub fn plan_scenes<S: Borrow<Scene> + Sync>(
        &self,
        scenes: &[S],
    ) -> Vec<Result<Plan, PlanError>> {
        self.batch(scenes.len(), |i| self.plan_scene(scenes[i].borrow()))
    }

    fn batch(
        &self,
        count: usize,
        plan: impl Fn(usize) -> Result<Plan, PlanError> + Sync,
    ) -> Vec<Result<Plan, PlanError>> {
        let cores = thread::available_parallelism().map_or(1, NonZero::get);
        let next = AtomicUsize::new(0);
        let work = || {
            let mut done = Vec::new();
            loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                if i >= count {
                    return done;
                }
                done.push((i, plan(i)));
            }
        };
        let mut plans = thread::scope(|scope| {
            let threads: Vec<_> = (1..cores.min(count)).map(|_| scope.spawn(work)).collect();
            let mut plans = work();
            for thread in threads {
                plans.extend(thread.join().expect("planning does not panic"));
            }
            plans
        });
        plans.sort_unstable_by_key(|(i, _)| *i);
        plans.into_iter().map(|(_, plan)| plan).collect()
    }

    /// A planner for one call. Making one costs little beside preparing it, which its first plan does.
    fn borrow(&self) -> Box<dyn Planner + Send> {
        let idle = self.idle.lock().unwrap_or_else(|e| e.into_inner()).pop();
        idle.unwrap_or_else(|| {
            self.method.build(&self.models, &self.settings).expect("it was built before")
        })
    }

    fn plan_by(&self, planner: &mut dyn Planner, scene: &Scene) -> Result<Plan, PlanError> {
        let planned =
            goals::plan(planner, scene, self.terms, self.budget).map_err(PlanError::Problem)?;
        let result = planned.result;
        let path = result.outcome.map_err(PlanError::NoPath)?;
        Ok(Plan {
            vehicle: self.vehicle,
            start: scene.start,
            goal: scene.all_goals()[planned.goal_index],
            goal_index: planned.goal_index,
            frame: planned.problem.frame,
            margin: planned.problem.margin,
            kind: planned.problem.kind,
            method: self.method,
            expansions: result.expansions,
            route: result.guidance.map(|g| g.route),
            path,
            smooth: result.smooth,
        })
    }
}

/// What is asked of a plan besides avoiding obstacles.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Rear-axle pose to start from.
    pub start: Pose,
    /// Rear-axle poses to park at; the cheapest is taken.
    pub goals: Vec<Pose>,
    /// How far from a goal the car may stop.
    pub tolerance: Option<GoalTolerance>,
    /// How the goal lies in its spot, where that is known; it is found otherwise.
    pub parking_type: Option<ParkingType>,
    /// The car's outline where that is not its whole rectangle: see [`Scene::contour`]; empty where it is.
    pub contour: Vec<[f64; 2]>,
    /// Clearance to keep on each side of the car, beyond the parker's.
    pub margins: Option<Margins>,
    /// Angle of the front wheels at the start, radians.
    pub start_steer: f64,
    /// The path that the car follows already, such as [`Plan::previous`] of the last cycle: it is kept while it is free
    /// and near the best.
    pub previous: Option<PreviousPath>,
}

impl Request {
    /// From `start` exactly to `goal`.
    pub fn new(start: Pose, goal: Pose) -> Self {
        Self {
            start,
            goals: vec![goal],
            tolerance: None,
            parking_type: None,
            contour: Vec::new(),
            margins: None,
            start_steer: 0.0,
            previous: None,
        }
    }
}

/// What stands in a lot, in any frame that start and goal share; metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lot {
    obstacles: Vec<Vec<[f64; 2]>>,
    polylines: Vec<Vec<[f64; 2]>>,
    points: Vec<[f64; 2]>,
    low: LowObstacles,
    drivable_area: Option<DrivableArea>,
    bounds: Option<[f64; 4]>,
}

impl Lot {
    /// Nothing at all.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a solid simple polygon, closed implicitly; two vertices are a wall.
    pub fn polygon(&mut self, vertices: impl Into<Vec<[f64; 2]>>) -> &mut Self {
        self.obstacles.push(vertices.into());
        self
    }

    /// Adds a line without thickness, such as a fence: two or more vertices.
    pub fn polyline(&mut self, vertices: impl AsRef<[[f64; 2]]>) -> &mut Self {
        self.polylines.push(vertices.as_ref().to_vec());
        self
    }

    /// Adds points, as a range sensor sees them.
    pub fn points(&mut self, points: impl IntoIterator<Item = [f64; 2]>) -> &mut Self {
        self.points.extend(points);
        self
    }

    /// Adds a solid that only wheels must keep off, such as a traffic island.
    pub fn low_polygon(&mut self, vertices: impl Into<Vec<[f64; 2]>>) -> &mut Self {
        self.low.obstacles.push(vertices.into());
        self
    }

    /// Adds a line that only wheels must keep off, such as a kerb.
    pub fn low_polyline(&mut self, vertices: impl Into<Vec<[f64; 2]>>) -> &mut Self {
        self.low.polylines.push(vertices.into());
        self
    }

    /// Adds points that only wheels must keep off.
    pub fn low_points(&mut self, points: impl IntoIterator<Item = [f64; 2]>) -> &mut Self {
        self.low.points.extend(points);
        self
    }

    /// Keeps the body within a polygon and out of its holes.
    pub fn drivable_area(&mut self, area: DrivableArea) -> &mut Self {
        self.drivable_area = Some(area);
        self
    }

    /// Keeps the rear axle within `[xmin, ymin, xmax, ymax]`.
    pub fn bounds(&mut self, bounds: [f64; 4]) -> &mut Self {
        self.bounds = Some(bounds);
        self
    }

    /// Adds the occupied cells of a grid, as the squares that they are.
    ///
    /// `occupied` is row by row, the first row at the lowest y; `origin` is the corner of the first
    /// cell, and `resolution` the side of a cell. Cells beyond the last whole row are left out.
    pub fn grid(
        &mut self,
        origin: [f64; 2],
        resolution: f64,
        columns: usize,
        occupied: &[bool],
    ) -> &mut Self {
        let cells: Vec<u8> = occupied.iter().map(|&cell| u8::from(cell)).collect();
        let is_occupied = std::array::from_fn(|value| value != 0);
        let at = |x: usize, y: usize| {
            [origin[0] + x as f64 * resolution, origin[1] + y as f64 * resolution]
        };
        if columns > 0 {
            for Block { x0, x1, y0, y1 } in blocks(cells.chunks_exact(columns), &is_occupied) {
                self.polygon([at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)]);
            }
        }
        self
    }

    /// The scene of a request in this lot: what [`Parker::plan_request`] plans.
    pub fn scene(&self, vehicle: Vehicle, request: &Request) -> Scene {
        let first = request.goals.first().copied();
        Scene {
            vehicle,
            start: request.start,
            goal: first.unwrap_or(Pose::new(f64::NAN, f64::NAN, f64::NAN)),
            goals: if request.goals.len() > 1 { request.goals.clone() } else { Vec::new() },
            goal_tolerance: request.tolerance,
            parking_type: request.parking_type,
            obstacles: self.obstacles.clone(),
            polylines: self.polylines.clone(),
            points: self.points.clone(),
            low: self.low.clone(),
            drivable_area: self.drivable_area.clone(),
            contour: request.contour.clone(),
            margins: request.margins,
            start_steer: request.start_steer,
            previous: request.previous.clone(),
            bounds: self.bounds,
            ..Scene::default()
        }
    }
}

/// A path that the exact swept check has passed, and how it came about.
#[derive(Clone, Debug)]
pub struct Plan {
    vehicle: Vehicle,
    start: Pose,
    goal: Pose,
    goal_index: usize,
    frame: Frame,
    margin: f64,
    kind: Option<ParkingType>,
    method: Method,
    expansions: usize,
    route: Option<Route>,
    path: Path,
    smooth: Option<SmoothPath>,
}

impl Plan {
    /// The vehicle it was planned for.
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// Driven length, metres.
    pub fn length(&self) -> f64 {
        self.path.length()
    }

    /// Changes of gear on the way.
    pub fn direction_changes(&self) -> usize {
        self.path.direction_changes()
    }

    /// The path as motions of constant curvature, in the frame of the request. Where continuous steering was
    /// asked for these are arcs from which the path is nowhere farther than half of the margin.
    pub fn path(&self) -> Path {
        self.path.to_world(&self.frame)
    }

    /// The path as motions of steadily changing curvature, in the frame of the request; arcs and straights
    /// alone, where nothing else was asked for.
    pub fn smooth_path(&self) -> SmoothPath {
        self.driven().to_world(&self.frame)
    }

    fn driven(&self) -> Cow<'_, SmoothPath> {
        self.smooth.as_ref().map_or_else(|| Cow::Owned(SmoothPath::of(&self.path)), Cow::Borrowed)
    }

    /// Poses at most 5 cm apart, each with the gear and the steering angle that follow it: the same
    /// numbers as in path files.
    pub fn poses(&self) -> PathFile {
        let ends = [self.start, self.goal];
        PathFile::between(ends, &self.vehicle, &self.frame, &self.driven(), self.method.name())
    }

    /// The same as a request takes it for the previous path.
    pub fn previous(&self) -> PreviousPath {
        let PathFile { poses, gears, steer, steer_from, steer_to, method } = self.poses();
        PreviousPath { poses, gears, steer, steer_from, steer_to, method }
    }

    /// The path in time.
    pub fn trajectory(&self, limits: &TrajectoryLimits) -> Result<Driven, LimitError> {
        Driven::new([self.start, self.goal], &self.vehicle, &self.frame, &self.driven(), limits)
    }

    /// Which goal of the request it leads to.
    pub fn goal_index(&self) -> usize {
        self.goal_index
    }

    /// Clearance kept from what is next to start or goal, metres; from everything else at least
    /// what was asked for.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// How the goal lies in its spot, given or found.
    pub fn parking_type(&self) -> Option<ParkingType> {
        self.kind
    }

    /// The method that planned it.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Node expansions that it took.
    pub fn expansions(&self) -> usize {
        self.expansions
    }

    /// How guided planning came to it; `None` for plain searches.
    pub fn route(&self) -> Option<Route> {
        self.route
    }
}
