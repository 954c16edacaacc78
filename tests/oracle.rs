//! The independent check refuses hand-made bad paths, each for its own reason, and
//! accepts good ones wherever the scene lies.

#![cfg(feature = "lab")]

use n3p::curves::{Path, Segment};
use n3p::geometry::{Frame, Pose};
use n3p::lab::evaluation::oracle::{self, Violation};
use n3p::output::PathFile;
use n3p::vehicle::Vehicle;
use n3p::world::Scene;

/// A box as a polygon.
fn block(x0: f64, y0: f64, x1: f64, y1: f64) -> Vec<[f64; 2]> {
    vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

/// A scene around `path` (given in the world), and the path's export.
fn around(path: &Path, obstacles: Vec<Vec<[f64; 2]>>) -> (Scene, PathFile) {
    let scene = Scene {
        name: "hand-made".into(),
        vehicle: Vehicle::default(),
        start: path.start,
        goal: path.end(),
        obstacles,
        ..Scene::default()
    };
    let file = PathFile::new(&scene, &Frame::WORLD, path, "by-hand");
    (scene, file)
}

fn driven(start: Pose, segments: &[(f64, f64)]) -> Path {
    let segment = |&(curvature, length): &(f64, f64)| Segment { curvature, length };
    Path::new(start, segments.iter().map(segment))
}

/// Straight along +x from the origin.
fn straight(length: f64) -> Path {
    driven(Pose::default(), &[(0.0, length)])
}

#[test]
fn accepts_a_good_path_and_measures_its_clearance() {
    // Full lock, gear changes, and a wall along the way whose distance is the lowest
    // corner's.
    let v = Vehicle::default();
    let k = v.max_curvature();
    for origin in [[0.0, 0.0], [5e5, -4e5]] {
        let [ox, oy] = origin;
        let segments = [(0.0, 3.0), (k, 4.0), (-k, -2.0), (0.0, -0.5)];
        let path = driven(Pose::new(ox, oy, 0.0), &segments);
        let samples = path.sample(0.01);
        let corners =
            samples.iter().flat_map(|s| v.footprint_at(s.pose).vertices().to_vec()).map(|c| c.y);
        let lowest = corners.fold(f64::INFINITY, f64::min);
        let wall = block(ox - 50.0, lowest - 2.0, ox + 50.0, lowest - 0.3);
        let (scene, file) = around(&path, vec![wall]);
        let clearance = oracle::check(&scene, &file).unwrap();
        assert!((clearance - 0.3).abs() < 1e-3, "{clearance}");
    }
    let (scene, file) = around(&straight(5.0), vec![block(-9.0, 1.23, 20.0, 9.0)]);
    assert!((oracle::check(&scene, &file).unwrap() - 0.3).abs() < 1e-9);
    let (scene, file) = around(&straight(5.0), vec![]);
    assert_eq!(oracle::check(&scene, &file), Ok(f64::INFINITY));
}

#[test]
fn a_car_that_does_not_move_is_a_path() {
    let (scene, file) = around(&straight(0.0), vec![]);
    assert_eq!(file.poses.len(), 1);
    assert!(oracle::check(&scene, &file).is_ok());
}

#[test]
fn rejects_curvature_beyond_the_limit() {
    let k = Vehicle::default().max_curvature();
    let (scene, file) = around(&driven(Pose::default(), &[(k * 1.0001, 3.0)]), vec![]);
    assert!(matches!(oracle::check(&scene, &file), Err(Violation::Curvature { pose: 0, .. })));
    // Poses on the tighter arc, with a steering angle that claims the limit.
    let mut lie = around(&driven(Pose::default(), &[(k * 1.1, 3.0)]), vec![]).1;
    lie.steer.fill(Vehicle::default().max_steer);
    assert!(matches!(oracle::check(&scene, &lie), Err(Violation::Goal { .. })));
    let scene = Scene { goal: Pose::from(*lie.poses.last().unwrap()), ..scene };
    assert!(matches!(oracle::check(&scene, &lie), Err(Violation::Motion { .. })));
}

#[test]
fn rejects_a_wall_thinner_than_the_step() {
    let wall = block(7.0, -0.2, 7.0005, 0.2);
    let (scene, file) = around(&straight(5.0), vec![wall]);
    let verdict = oracle::check(&scene, &file);
    assert!(matches!(verdict, Err(Violation::Collision { pose: 62.., .. })), "{verdict:?}");
}

#[test]
fn rejects_driving_inside_a_big_polygon() {
    // No edge is near: only containment tells.
    let (scene, file) = around(&straight(5.0), vec![block(-90.0, -90.0, 90.0, 90.0)]);
    assert!(matches!(oracle::check(&scene, &file), Err(Violation::Collision { pose: 0, .. })));
}

#[test]
fn a_notch_is_free_its_walls_are_not() {
    // A U of solid ground around the car, open at +x: not convex.
    let u = |gap: f64| {
        vec![
            [-5.0, -5.0],
            [20.0, -5.0],
            [20.0, -gap],
            [-2.0, -gap],
            [-2.0, gap],
            [20.0, gap],
            [20.0, 5.0],
            [-5.0, 5.0],
        ]
    };
    let (scene, file) = around(&straight(5.0), vec![u(1.0)]);
    assert!((oracle::check(&scene, &file).unwrap() - 0.07).abs() < 1e-9);
    let (scene, file) = around(&straight(5.0), vec![u(0.9)]);
    let verdict = oracle::check(&scene, &file);
    let Err(Violation::Collision { mm, .. }) = verdict else { panic!("{verdict:?}") };
    assert!((mm - 30.0).abs() < 0.1, "{mm}");
}

#[test]
fn tolerates_contact_but_no_more() {
    let half = Vehicle::default().width / 2.0;
    for (depth, free) in [(0.0, true), (0.00005, true), (0.0002, false), (0.001, false)] {
        let wall = block(-9.0, half - depth, 20.0, 9.0);
        let (scene, file) = around(&straight(5.0), vec![wall]);
        let verdict = oracle::check(&scene, &file);
        assert_eq!(verdict.is_ok(), free, "{depth}: {verdict:?}");
    }
}

#[test]
fn rejects_a_point_under_the_car() {
    let (mut scene, file) = around(&straight(5.0), vec![]);
    scene.points = vec![[50.0, 0.0], [6.0, 0.5]];
    let verdict = oracle::check(&scene, &file);
    let Err(Violation::Collision { obstacle, .. }) = verdict else { panic!("{verdict:?}") };
    assert_eq!(obstacle, "points[1]");
    scene.points = vec![[6.0, 1.03]];
    assert!((oracle::check(&scene, &file).unwrap() - 0.1).abs() < 1e-9);
}

#[test]
fn rejects_jumps_gaps_and_wrong_gears() {
    let (scene, good) = around(&straight(5.0), vec![]);
    let mut sideways = good.clone();
    sideways.poses[40][1] += 0.02;
    assert!(matches!(oracle::check(&scene, &sideways), Err(Violation::Motion { pose: 39, .. })));
    let mut gap = good.clone();
    gap.poses.drain(40..43);
    gap.gears.drain(40..43);
    gap.steer.drain(40..43);
    assert!(matches!(oracle::check(&scene, &gap), Err(Violation::Spacing { pose: 39, .. })));
    let mut backward = good.clone();
    backward.gears[10] = -1;
    assert!(matches!(
        oracle::check(&scene, &backward),
        Err(Violation::Gear { pose: 10, gear: -1 })
    ));
    let mut nan = good.clone();
    nan.poses[7][2] = f64::NAN;
    assert_eq!(oracle::check(&scene, &nan), Err(Violation::NotANumber { pose: 7 }));
    // The least number of eight bits has no absolute value.
    for gear in [0, 2, -2, i8::MIN, i8::MAX] {
        let mut wrong = good.clone();
        wrong.gears[3] = gear;
        assert_eq!(oracle::check(&scene, &wrong), Err(Violation::NotANumber { pose: 3 }), "{gear}");
    }
    let mut short = good;
    short.steer.pop();
    assert!(matches!(oracle::check(&scene, &short), Err(Violation::Shape { .. })));
}

#[test]
fn rejects_wrong_ends_but_not_whole_turns() {
    let (scene, file) = around(&straight(5.0), vec![]);
    let moved = |p: Pose| Pose::new(p.x + 2e-6, p.y, p.heading);
    let wrong = Scene { start: moved(scene.start), ..scene.clone() };
    assert!(matches!(oracle::check(&wrong, &file), Err(Violation::Start { .. })));
    let wrong = Scene { goal: moved(scene.goal), ..scene.clone() };
    assert!(matches!(oracle::check(&wrong, &file), Err(Violation::Goal { .. })));
    let goal = Pose { heading: scene.goal.heading + std::f64::consts::TAU, ..scene.goal };
    assert!(oracle::check(&Scene { goal, ..scene }, &file).is_ok());
}

#[test]
fn rejects_an_axle_out_of_bounds() {
    let (mut scene, file) = around(&straight(5.0), vec![]);
    scene.bounds = Some([-1.0, -1.0, 5.0, 1.0]);
    assert!(oracle::check(&scene, &file).is_ok(), "the nose may leave the bounds");
    scene.bounds = Some([-1.0, -1.0, 4.0, 1.0]);
    assert!(matches!(oracle::check(&scene, &file), Err(Violation::OutOfBounds { pose: 80.., .. })));
}
