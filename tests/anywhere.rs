//! A scene may lie anywhere: shifted, turned or mirrored it is planned the same way.

#![cfg(feature = "lab")]

#[path = "fixtures/lots.rs"]
mod lots;

use std::path::Path;

use n3p::curves::{SmoothPath, TrajectoryLimits};
use n3p::geometry::{Frame, Pose, Vec2, signed_angle};
use n3p::lab::evaluation::oracle;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::output::{PathFile, TrajectoryFile};
use n3p::planners::{Budget, Problem};
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use rand::RngExt;

const BUDGET: Budget = Budget::new(200_000);

/// The scene as it lies in `frame`, seen from the world.
fn moved(scene: &Scene, frame: &Frame) -> Scene {
    let point =
        |&[x, y]: &[f64; 2]| <[f64; 2]>::from(frame.world_from_local_point(Vec2::new(x, y)));
    let mut moved = Scene {
        start: frame.world_from_local(scene.start),
        goal: frame.world_from_local(scene.goal),
        obstacles: scene.obstacles.iter().map(|o| o.iter().map(point).collect()).collect(),
        points: scene.points.iter().map(point).collect(),
        // A box that stands aslant is none.
        bounds: None,
        ..scene.clone()
    };
    if frame.mirrored {
        moved.obstacles.iter_mut().for_each(|o| o.reverse());
    }
    moved
}

fn frames(seed: u64) -> Vec<Frame> {
    let mut rng = rng(seed, Stream::Scene, 0);
    let mut r = |a: f64| rng.random_range(-a..a);
    let mut frames = vec![Frame { origin_in_world: Pose::new(5e5, -5e5, 0.0), mirrored: false }];
    for i in 0..5 {
        let origin_in_world = Pose::new(r(5e5), r(5e5), r(3.1));
        frames.push(Frame { origin_in_world, mirrored: i % 2 == 0 });
    }
    frames
}

fn check(scenes: &[Scene], methods: &[Method], models: &Models) {
    for &method in methods {
        let mut planner = method.build(models, &MethodSettings::default()).unwrap();
        for (i, scene) in scenes.iter().enumerate() {
            let scene = Scene { bounds: None, ..scene.clone() };
            let here = Problem::new(&scene).unwrap();
            let expected = planner.plan(&here, BUDGET);
            let path = expected.outcome.as_ref().map(|p| p.to_world(&here.frame));
            for frame in frames(i as u64) {
                let there = moved(&scene, &frame);
                let problem = Problem::new(&there).unwrap();
                let what = format!("{method}, {}, {frame:?}", scene.name);
                assert_eq!(problem.kind, here.kind, "{what}");
                let found = planner.plan(&problem, BUDGET);
                assert_eq!(found.expansions, expected.expansions, "{what}");
                let (Ok(path), Ok(found)) = (&path, &found.outcome) else {
                    assert_eq!(found.outcome, expected.outcome, "{what}");
                    continue;
                };
                let found = found.to_world(&problem.frame);
                assert_eq!(found.segments.len(), path.segments.len(), "{what}");
                for ((a, s), (b, t)) in path.legs().zip(found.legs()) {
                    let b = frame.local_from_world(b);
                    let apart = a.distance(b) + signed_angle(a.heading, b.heading).abs();
                    assert!(apart < 1e-6, "{what}: {apart}");
                    assert!((s.length - t.length).abs() < 1e-6, "{what}");
                }
                let file = PathFile::new(&there, &Frame::WORLD, &found, method.name());
                assert!(oracle::check(&there, &file).is_ok(), "{what}");
            }
        }
    }
}

fn generated(count: u64, hinted: bool) -> Vec<Scene> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let mut scenes = Vec::new();
    for kind in ParkingType::SQUARE {
        for level in Level::ALL {
            for i in 0..count {
                let scene = generate(&config, &vehicle, kind, level, 808, i);
                let parking_type = scene.parking_type.filter(|_| hinted);
                scenes.push(Scene { parking_type, ..scene });
            }
        }
    }
    scenes
}

#[test]
fn generated_scenes_are_planned_the_same_anywhere() {
    let models = Models::load(&["models/knn.bin"]).unwrap();
    check(&generated(6, true), &[Method::N3P, Method::HA_RS], &models);
}

#[test]
fn scenes_without_a_parking_type_are_understood_the_same_anywhere() {
    let models = Models::load(&["models/knn.bin"]).unwrap();
    check(&generated(3, false), &[Method::N3P], &models);
}

/// Scenes of a published benchmark lie a million kilometres from the origin. There neighbouring
/// numbers lie 0.1 µm apart, and 60 µm at the farthest place allowed.
#[test]
fn far_away_paths_are_as_long_and_pass_the_independent_check() {
    let models = Models::load(&["models/knn.bin"]).unwrap();
    for method in [Method::N3P, Method::HA_RS, Method::HA] {
        let mut planner = method.build(&models, &MethodSettings::default()).unwrap();
        for (i, scene) in generated(1, true).into_iter().enumerate() {
            let mut here = None;
            for offset in [0.0, 1e6, 1e9, 1e11, Scene::MAX_COORDINATE - 1e3] {
                let (x, y) = (offset, if i % 2 == 0 { offset } else { -offset / 3.0 });
                let frame = Frame { origin_in_world: Pose::new(x, y, 0.0), mirrored: false };
                let there = moved(&scene, &frame);
                let what = format!("{method}, {} at {offset:e}", scene.name);
                there.validate(Path::new("far")).unwrap();
                let problem = Problem::new(&there).expect(&what);
                let path = planner.plan(&problem, BUDGET).outcome.expect(&what);
                let file = PathFile::new(&there, &problem.frame, &path, method.name());
                oracle::check(&there, &file).expect(&what);
                let ends = [file.poses[0], *file.poses.last().unwrap()];
                assert_eq!(ends, [there.start, there.goal].map(<[f64; 3]>::from), "{what}");
                let limits = TrajectoryLimits::default();
                let file = TrajectoryFile::new(
                    &there,
                    &problem.frame,
                    &SmoothPath::of(&path),
                    "far",
                    limits,
                );
                let moments = file.expect(&what).moments;
                let ends = [moments[0].pose, moments.last().unwrap().pose];
                assert_eq!(ends, [there.start, there.goal], "{what}");
                // At the last place obstacles are rounded so much that a search may go another way.
                let length = *here.get_or_insert(path.length());
                let apart = (path.length() - length).abs();
                assert!(apart < 1e-3 || offset > 1e11, "{what}: {apart} m longer or shorter");
            }
        }
    }
}

fn check_lots(scenes: &[Scene]) {
    let models = Models::usual(&[Method::N3P], None).unwrap();
    check(scenes, &[Method::N3P], &models);
}

#[test]
fn hand_made_lots_are_planned_the_same_anywhere() {
    check_lots(&Scene::read_dir(Path::new("tests/fixtures/lots")).unwrap());
}

#[test]
#[ignore = "needs ../shared/scenes"]
fn real_lots_are_planned_the_same_anywhere() {
    check_lots(&lots::real("tpcap")[..10]);
    check_lots(&lots::real("dlp")[..15]);
}
