//! N3P with the models in the repository.

#![cfg(feature = "lab")]

use n3p::curves::Segment;
use n3p::curves::reeds_shepp::{Word, words};
use n3p::geometry::Pose;
use n3p::lab::evaluation::{oracle, suite};
use n3p::n3p::guided::RankedConfig;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::output::PathFile;
use n3p::planners::{Budget, Effort, HybridAStarConfig, Problem, Route};
use n3p::selectors::Features;
use n3p::selectors::model::Model;
use n3p::vehicle::{Gear, Vehicle};
use n3p::world::abstraction::abstractions;
use n3p::world::cell::{Cell, Grid};
use n3p::world::collision::CollisionWorld;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use std::path::Path;

/// Whether a Reeds-Shepp curve, with a straight into the spot, leads from `pose` to the
/// goal of `cell` without contact: written here from the definition.
fn has_free_connection(grid: &Grid, cell: &Cell, vehicle: &Vehicle, pose: Pose) -> bool {
    let goal = grid.goal(cell.stance, vehicle);
    let world = CollisionWorld::new(&grid.walls(cell).unwrap(), None, vehicle, 0.0);
    if !world.pose_is_free(pose) {
        return false;
    }
    let gears: &[Gear] = match cell.kind() {
        ParkingType::Forward => &[Gear::Forward],
        ParkingType::Reverse => &[Gear::Backward],
        ParkingType::Parallel => &[Gear::Forward, Gear::Backward],
        ParkingType::Angled if goal.heading < 0.0 => &[Gear::Forward],
        ParkingType::Angled => &[Gear::Backward],
    };
    let straights = gears.iter().flat_map(|g| (0..=100).map(|i| g.sign() * 0.05 * f64::from(i)));
    let mut out: Vec<Word> = Vec::new();
    straights.into_iter().any(|length| {
        let entry = Segment::straight(length);
        let from = entry.reversed().end(goal);
        out.clear();
        words(pose, from, vehicle.turning_radius(), &mut out);
        let entry_free = world.segment_is_free(goal, entry.reversed());
        entry_free && out.iter().any(|w| world.segments_are_free(pose, w.segments()))
    })
}

#[test]
fn every_pose_the_knn_selects_has_a_free_curve_in_the_scenes_own_cell() {
    let (square, angled) = (&ParkingType::SQUARE[..], &[ParkingType::Angled][..]);
    for (file, kinds, least, percent) in
        [("models/knn.bin", square, 900, 90), ("models/knn-angled.bin", angled, 400, 80)]
    {
        let (asked, answered) = answers_of(file, kinds);
        let enough = answered > least && answered * 100 > asked * percent;
        assert!(enough, "{file}: {answered} of {asked}");
    }
}

/// How often a model is asked for a pose in generated scenes, and how often it answers.
fn answers_of(file: &str, kinds: &[ParkingType]) -> (u32, u32) {
    let model = Model::load(Path::new(file)).unwrap();
    let vehicle = *model.vehicle().unwrap();
    let selector = model.into_selector();
    let grid = *selector.grid(kinds[0]);
    let (mut asked, mut answered) = (0, 0);
    let mut poses = Vec::new();
    for &kind in kinds {
        for level in Level::ALL {
            for i in 0..100 {
                let scene = generate(&GeneratorConfig::default(), &vehicle, kind, level, 4242, i);
                let problem = Problem::new(&scene).unwrap();
                for found in abstractions(&problem.obstacles, problem.stance().unwrap(), &grid) {
                    asked += 1;
                    let start = found.in_cell(problem.start);
                    poses.clear();
                    selector.select(&Features::new(start, found.cell), &vehicle, 1, &mut poses);
                    for &pose in &poses {
                        answered += 1;
                        assert!(
                            has_free_connection(&grid, &found.cell, &vehicle, pose),
                            "{} {pose:?} {found:?}",
                            scene.name
                        );
                    }
                }
            }
        }
    }
    (asked, answered)
}

/// Known manoeuvres lead into nearly all angled bays, whether a scene says that it is one or not.
#[test]
fn angled_bays_are_planned_without_a_search() {
    let models = Models::load(&["models/knn.bin", "models/knn-angled.bin"]).unwrap();
    let vehicle = models.vehicle().unwrap();
    let kinds = [ParkingType::Angled];
    let cases = suite::at_home(&vehicle, &kinds, &Level::ALL, 40, 515).unwrap();
    let mut planner = Method::N3P.build(&models, &MethodSettings::default()).unwrap();
    for hinted in [true, false] {
        let mut without = 0;
        for case in &cases {
            let parking_type = case.scene.parking_type.filter(|_| hinted);
            let scene = Scene { parking_type, ..case.scene.clone() };
            let problem = Problem::new(&scene).unwrap();
            let budget = Budget { max_expansions: 200_000, effort: Effort::First };
            let result = planner.plan(&problem, budget);
            let path = result.outcome.unwrap_or_else(|e| panic!("{}: {e}", scene.name));
            let file = PathFile::new(&scene, &problem.frame, &path, "n3p");
            oracle::check(&scene, &file).unwrap_or_else(|e| panic!("{}: {e}", scene.name));
            without += usize::from(result.expansions == 0);
        }
        assert!(without * 10 > cases.len() * 9, "{without} of {}", cases.len());
    }
}

/// Every method that has a model or needs none, on 100 scenes of each type and level: a
/// path each time, and none that the oracle rejects.
#[test]
fn no_method_fails_on_900_scenes() {
    let models = Models::load(&["models/knn.bin"]).unwrap();
    let scenes = suite::at_home(
        &models.vehicle().expect("the model knows its vehicle"),
        &ParkingType::SQUARE,
        &Level::ALL,
        100,
        900_900,
    )
    .unwrap();
    let methods = [Method::HA_RS, Method::KNN_N3P, Method::N3P];
    let mut planners = methods.map(|m| m.build(&models, &MethodSettings::default()).unwrap());
    for case in &scenes {
        let problem = Problem::new(&case.scene).unwrap();
        for planner in &mut planners {
            let name = format!("{} by {}", case.scene.name, planner.name());
            let result = planner.plan(&problem, Budget::new(200_000));
            let path = result.outcome.unwrap_or_else(|reason| panic!("{name}: {reason}"));
            let file = PathFile::new(&case.scene, &problem.frame, &path, planner.name());
            if let Err(violation) = oracle::check(&case.scene, &file) {
                panic!("{name}: {violation}");
            }
        }
    }
}

/// Each setting of `n3p` takes something away that spares searches.
#[test]
fn settings_decide_what_is_tried_before_a_search() {
    let models = Models::load(&["models/knn.bin"]).unwrap();
    let vehicle = models.vehicle().unwrap();
    let kind = [ParkingType::Parallel];
    let scenes = suite::at_home(&vehicle, &kind, &[Level::Extreme], 40, 4242).unwrap();
    let plans = |n3p: RankedConfig| {
        let settings = MethodSettings { n3p, ..MethodSettings::default() };
        let mut planner = Method::N3P.build(&models, &settings).unwrap();
        let (mut library, mut searched) = (0, 0);
        for case in &scenes {
            let problem = Problem::new(&case.scene).unwrap();
            let result = planner.plan(&problem, Budget::new(200_000));
            assert!(result.outcome.is_ok(), "{}", case.scene.name);
            library += usize::from(result.guidance.unwrap().route == Route::Library);
            searched += usize::from(result.expansions > 0);
        }
        (library, searched)
    };
    let all = RankedConfig::default();
    let without = RankedConfig { library: false, ..all };
    let one = RankedConfig { library: false, foresight: false, candidates: 1, abstractions: 1 };
    let (all_of_it, some, one) = (plans(all), plans(without), plans(one));
    assert_eq!((some.0, one.0), (0, 0), "nothing is looked up");
    assert!(all_of_it.0 > 0 && all_of_it.1 < some.1, "{all_of_it:?} {some:?}");
    assert!(some.1 <= one.1, "{} and {} searches", some.1, one.1);
    assert!(
        RankedConfig { candidates: 0, ..all }.validate().unwrap_err().contains("candidates is 0")
    );
}

/// In none of the scenes the plan costs much more than that of `ha-rs`. Gives back how many
/// plans are the curve straight to the goal.
fn check_costs(scenes: &[Scene]) -> usize {
    let models = Models::usual(&[Method::N3P], None).unwrap();
    let [mut n3p, mut hars] =
        [Method::N3P, Method::HA_RS].map(|m| m.build(&models, &MethodSettings::default()).unwrap());
    let mut direct = 0;
    for scene in scenes {
        let problem = Problem::new(scene).unwrap();
        let budget = Budget::new(200_000);
        let ours = n3p.plan(&problem, budget);
        let path = ours.outcome.unwrap_or_else(|e| panic!("{}: {e}", scene.name));
        let guidance = ours.guidance.unwrap();
        let theirs = hars.plan(&problem, budget).outcome.unwrap();
        direct += usize::from(guidance.route == Route::Direct && guidance.preparatory.is_none());
        let model = HybridAStarConfig::default().for_vehicle(&problem.vehicle).cost;
        let [ours, theirs] = [&path, &theirs].map(|p| model.path(&problem.vehicle, &p.segments));
        assert!(ours <= 1.5 * theirs, "{}: {ours} where {theirs} suffices", scene.name);
    }
    direct
}

#[test]
fn the_curve_straight_to_the_goal_is_taken_where_it_is_cheaper() {
    let vehicle = Vehicle::default();
    let cases = suite::at_home(&vehicle, &ParkingType::ALL, &Level::ALL, 20, 4242).unwrap();
    let scenes: Vec<_> = cases.into_iter().map(|case| case.scene).collect();
    let direct = check_costs(&scenes);
    assert!(0 < direct && direct < scenes.len() / 2, "{direct} of {}", scenes.len());
}

#[test]
fn lots_are_planned_in_at_little_more_than_the_cost_of_a_search() {
    check_costs(&Scene::read_dir("tests/fixtures/lots".as_ref()).unwrap());
}

#[test]
#[ignore = "needs ../shared/scenes"]
fn real_lots_are_planned_in_at_little_more_than_the_cost_of_a_search() {
    check_costs(&Scene::read_dir("../shared/scenes/dlp".as_ref()).unwrap());
}
