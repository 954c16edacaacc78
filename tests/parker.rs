//! The door for other programs: the same plans as by every other way, from any thread.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use n3p::curves::TrajectoryLimits;
use n3p::geometry::Pose;
use n3p::output::PathFile;
use n3p::planners::{Budget, Effort, NoPath, ProblemError};
use n3p::world::{ParkingType, Scene};
use n3p::{Lot, Method, Models, Parker, ParkerError, PlanError, Request, Vehicle};

/// A bay between two parked cars, and the kerb across the lane.
fn bay() -> Lot {
    let mut lot = Lot::new();
    lot.polygon([[-4.1, -2.6], [-1.6, -2.6], [-1.6, 2.4], [-4.1, 2.4]]);
    lot.polygon([[1.6, -2.6], [4.1, -2.6], [4.1, 2.4], [1.6, 2.4]]);
    lot.polyline([[-15.0, 9.5], [15.0, 9.5]]);
    lot
}

const START: Pose = Pose::new(-9.0, 6.0, 0.0);
const GOAL: Pose = Pose::new(0.0, -1.4, FRAC_PI_2);

fn scenes() -> Vec<Scene> {
    Scene::read_dir(Path::new("examples/scenes")).unwrap()
}

/// A parker for the vehicle of `scene`.
fn parker(scene: &Scene) -> Parker {
    Parker::new(scene.vehicle).unwrap()
}

#[test]
fn a_plan_begins_and_ends_where_it_is_told_to() {
    let parker = Parker::new(Vehicle::default()).unwrap();
    let plan = parker.plan(START, GOAL, &bay()).unwrap();
    let PathFile { poses, gears, steer, method, .. } = plan.poses();
    assert_eq!((poses[0], poses[poses.len() - 1]), (START.into(), GOAL.into()));
    assert!(gears.len() == poses.len() && steer.len() == poses.len());
    assert_eq!(plan.parking_type(), Some(ParkingType::Reverse));
    assert!(plan.length() < 25.0 && plan.direction_changes() <= 2, "{plan:?}");
    assert_eq!(method, parker.method().name());
    assert!((plan.path().length() - plan.length()).abs() < 1e-9);
    let driven = plan.trajectory(&TrajectoryLimits::default()).unwrap();
    assert_eq!(driven.moments.last().unwrap().pose, GOAL);
    assert!((driven.report.distance_m - plan.length()).abs() < 1e-6);
    let backwards = TrajectoryLimits { steer_rate: -1.0, ..TrajectoryLimits::default() };
    assert!(plan.trajectory(&backwards).unwrap_err().to_string().contains("steer_rate is -1"));
}

/// Planned before or not, alone or beside others, by one thread or many.
#[test]
fn every_way_of_asking_gives_the_same_plan() {
    for scene in scenes() {
        let parker = parker(&scene);
        let alone = parker.plan_scene(&scene).unwrap().poses();
        assert_eq!(parker.plan_scene(&scene).unwrap().poses(), alone, "{}", scene.name);
        let batch = parker.plan_scenes(&vec![scene.clone(); 20]);
        assert!(batch.iter().all(|plan| plan.as_ref().unwrap().poses() == alone));
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| assert_eq!(parker.plan_scene(&scene).unwrap().poses(), alone));
            }
        });
        let mut lot = Lot::new();
        scene.obstacles.iter().for_each(|outline| _ = lot.polygon(outline.clone()));
        lot.points(scene.points.clone());
        scene.bounds.iter().for_each(|&bounds| _ = lot.bounds(bounds));
        let request =
            Request { parking_type: scene.parking_type, ..Request::new(scene.start, scene.goal) };
        let by_lot = parker.plan_batch(&[(request, &lot)]).remove(0).unwrap();
        assert_eq!(by_lot.poses(), alone, "{}", scene.name);
    }
}

#[cfg(feature = "lab")]
#[test]
fn plans_are_those_of_the_evaluation() {
    use n3p::episode::{self, Case, EpisodeConfig};
    use n3p::lab::evaluation::oracle;
    use n3p::n3p::MethodSettings;
    for scene in scenes() {
        let plan = parker(&scene).plan_scene(&scene).unwrap();
        let models = Models::compiled_in(&scene.vehicle).unwrap();
        let mut planner = Method::N3P.build(&models, &MethodSettings::default()).unwrap();
        let case = Case { kind: None, level: None, set: String::new(), scene };
        let config = EpisodeConfig { repeats: 0, ..EpisodeConfig::new(Budget::default()) };
        let episode = episode::run(&case, planner.as_mut(), &config, &oracle::JUDGE).unwrap();
        assert!(episode.row.ok, "{:?}", episode.row);
        assert_eq!(episode.path, Some(plan.poses()));
    }
}

#[test]
fn errors_are_told_by_kind() {
    let parker = Parker::new(Vehicle::default()).unwrap();
    let plan = |start, goal, lot: &Lot| parker.plan(start, goal, lot).unwrap_err();
    let nan = Pose::new(f64::NAN, 0.0, 0.0);
    for (start, goal) in [(nan, GOAL), (START, nan), (START, Pose::new(1e300, 0.0, 0.0))] {
        let error = plan(start, goal, &bay());
        assert!(matches!(error, PlanError::Problem(ProblemError::Invalid(_))), "{error}");
    }
    let within = plan(Pose::new(-3.0, -1.0, 0.0), GOAL, &bay());
    assert!(matches!(within, PlanError::Problem(ProblemError::StartInCollision(..))), "{within}");
    let mut bad = bay();
    bad.points([[0.0, f64::INFINITY]]);
    assert!(matches!(plan(START, GOAL, &bad), PlanError::Problem(_)));
    let mut walled = bay();
    walled.polyline([[-4.0, 3.0], [4.0, 3.0]]);
    walled.polyline([[-4.0, -3.0], [4.0, -3.0]]);
    assert!(matches!(plan(START, GOAL, &walled), PlanError::NoPath(_)));
    let none = parker.plan_request(&Request { goals: vec![], ..Request::new(START, GOAL) }, &bay());
    assert_eq!(none.unwrap_err(), PlanError::NoGoal);
    let van = Vehicle { length: 5.6, ..Vehicle::default() };
    let scene = Scene { vehicle: van, ..scenes().remove(0) };
    assert_eq!(parker.plan_scene(&scene).unwrap_err(), PlanError::OtherVehicle);

    let vehicle = |width| Parker::new(Vehicle { width, ..Vehicle::default() });
    assert!(matches!(vehicle(f64::NAN), Err(ParkerError::Vehicle(_))));
    let margin = |metres| Parker::new(Vehicle::default()).unwrap().margin(metres).map(|_| ());
    for metres in [-0.1, f64::NAN, 7.0] {
        assert!(matches!(margin(metres), Err(ParkerError::Terms(_))), "{metres}");
    }
    assert!(margin(0.3).is_ok());
    let learnt = Parker::by(Method::KNN_N3P, Vehicle::default(), Models::default());
    assert!(matches!(learnt, Err(ParkerError::Method(_))));
}

#[test]
fn a_budget_is_kept_and_a_vehicle_without_models_is_served_by_the_search() {
    let parker = Parker::with_models(Vehicle::default(), Models::default()).unwrap();
    assert_eq!(parker.method(), Method::HA_RS);
    assert!(parker.plan(START, GOAL, &bay()).is_ok());
    let mut narrow = bay();
    narrow.polyline([[-15.0, 7.0], [15.0, 7.0]]);
    let spent = parker.budget(Budget { max_expansions: 0, effort: Effort::First });
    match spent.plan(Pose::new(-9.0, 4.8, 0.0), GOAL, &narrow) {
        Ok(plan) => assert_eq!(plan.expansions(), 0, "a curve alone"),
        Err(error) => assert_eq!(error, PlanError::NoPath(NoPath::BudgetSpent)),
    }
}

#[cfg(feature = "models")]
#[test]
fn any_vehicle_is_planned_for_by_what_was_learnt() {
    for length in [0.5, 3.7, 4.97, 8.0] {
        let scale = length / 4.97;
        let of = |metres: f64| metres * scale;
        let v = Vehicle::default();
        let vehicle = Vehicle {
            length,
            width: of(v.width),
            wheelbase: of(v.wheelbase),
            rear_overhang: of(v.rear_overhang),
            ..v
        };
        let parker = Parker::new(vehicle).unwrap();
        assert_eq!(parker.method(), Method::N3P);
        let scaled = |p: Pose| Pose::new(of(p.x), of(p.y), p.heading);
        let mut lot = Lot::new();
        lot.polygon([[-4.1, -2.6], [-1.6, -2.6], [-1.6, 2.4], [-4.1, 2.4]].map(|v| v.map(of)));
        lot.polygon([[1.6, -2.6], [4.1, -2.6], [4.1, 2.4], [1.6, 2.4]].map(|v| v.map(of)));
        let plan = parker.plan(scaled(START), scaled(GOAL), &lot).unwrap();
        assert!(plan.length() < of(25.0), "{length}: {plan:?}");
    }
}

/// A grid stands for the squares of its occupied cells: what is free among those is free in it.
#[test]
fn a_grid_is_the_squares_that_it_is_made_of() {
    let (columns, rows, side) = (60, 50, 0.5);
    let origin = [-15.0, -10.0];
    let occupied: Vec<bool> = (0..columns * rows)
        .map(|i| {
            let (x, y) = (i % columns, i / columns);
            let at = |cell: usize, origin: f64| origin + (cell as f64 + 0.5) * side;
            let (x, y) = (at(x, origin[0]), at(y, origin[1]));
            (y < 2.4 && y > -3.0 && x.abs() > 1.6 && x.abs() < 4.1) || (y > 9.5)
        })
        .collect();
    let mut squares = Lot::new();
    for (i, _) in occupied.iter().enumerate().filter(|(_, is)| **is) {
        let (x, y) = ((i % columns) as f64, (i / columns) as f64);
        let corner = |dx: f64, dy: f64| [origin[0] + (x + dx) * side, origin[1] + (y + dy) * side];
        squares.polygon([corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)]);
    }
    let mut grid = Lot::new();
    grid.grid(origin, side, columns, &occupied);
    assert!(grid != squares, "cells that make a rectangle become one");
    let parker = Parker::by(Method::HA_RS, Vehicle::default(), Models::default()).unwrap();
    let [by_grid, by_squares] =
        [&grid, &squares].map(|lot| parker.plan(START, GOAL, lot).unwrap().length());
    assert!((by_grid - by_squares).abs() < 0.5, "{by_grid} {by_squares}");
    assert_eq!(Lot::new().grid(origin, side, 0, &occupied), &Lot::new());
    let check = |start| parker.plan(start, GOAL, &grid).map(|_| ());
    for (x, y) in [(2.0, 0.0), (-3.9, 2.0), (10.0, 9.8)] {
        let error = check(Pose::new(x, y, 0.0)).unwrap_err();
        assert!(matches!(error, PlanError::Problem(ProblemError::StartInCollision(..))), "{error}");
    }
}
