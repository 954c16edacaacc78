//! Free spots that nothing marks: those that generators left free are found, and n3p parks in what is found.
//!
//! `COUNT=100 cargo test --release --test free_spots -- --nocapture found` prints the shares of docs/formats.md.
#![cfg(all(feature = "scene", feature = "models"))]

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use n3p::geometry::{Pose, Vec2};
use n3p::vehicle::Vehicle;
use n3p::world::free_spots::{FreeSpot, SpotKind, free_spots};
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::lots::lot;
use n3p::world::{Level, Map, ParkingType, Scene};
use n3p::{Models, Parker};
use serde_json::Value;
use tempfile::TempDir;

const SEED: u64 = 31;

/// Scenes of each type and level.
fn count() -> u64 {
    std::env::var("COUNT").ok().and_then(|count| count.parse().ok()).unwrap_or(6)
}

fn kind_of(kind: ParkingType) -> SpotKind {
    match kind {
        ParkingType::Forward | ParkingType::Reverse => SpotKind::Bay,
        ParkingType::Parallel => SpotKind::Parallel,
        ParkingType::Angled => SpotKind::Angled,
    }
}

/// Whether the middle of a car that stands at `goal` is in the spot, and it lies as the car does.
fn is_there(free: &FreeSpot, goal: Pose, vehicle: &Vehicle) -> bool {
    let seen = free.spot.middle.relative(vehicle.body_center(goal));
    let is_inside = 2.0 * seen.x.abs() < free.spot.length && 2.0 * seen.y.abs() < free.spot.width;
    is_inside && seen.heading.sin().abs() < 12_f64.to_radians().sin()
}

/// Of scenes with a spot that a generator left free: in how many it is found, and as what it is; how many spots are found,
/// and into how many of these n3p plans.
#[derive(Default, Debug)]
struct Score {
    scenes: usize,
    found: usize,
    right_type: usize,
    spots: usize,
    planned: usize,
}

fn share(part: usize, all: usize) -> f64 {
    part as f64 / all.max(1) as f64
}

fn score(name: &str, kind: ParkingType, scenes: impl Iterator<Item = Scene>) -> Score {
    let mut score = Score::default();
    for scene in scenes {
        let vehicle = &scene.vehicle;
        let spots = free_spots(&scene).unwrap();
        assert_eq!(free_spots(&scene).unwrap(), spots, "{}: the same again", scene.name);
        let mut own = spots.iter().filter(|free| is_there(free, scene.goal, vehicle)).peekable();
        score.scenes += 1;
        score.found += usize::from(own.peek().is_some());
        score.right_type += usize::from(own.any(|free| free.kind == kind_of(kind)));
        let parker = Parker::with_models(*vehicle, Models::default()).unwrap();
        for (i, free) in spots.iter().enumerate() {
            let goals = free.spot.goals(vehicle);
            let apart = |other: &FreeSpot| vehicle.overlap(other.spot.goals(vehicle)[0], goals[0]);
            assert_eq!(goals.len(), 2, "{}: {free:?}", scene.name);
            assert!(goals.iter().all(|g| g.heading.abs() <= PI), "{}: {goals:?}", scene.name);
            assert!(spots[..i].iter().all(|other| apart(other) < 0.1), "{}: {free:?}", scene.name);
            let wanted = Scene { goal: goals[0], goals, parking_type: None, ..scene.clone() };
            score.spots += 1;
            score.planned += usize::from(parker.plan_scene(&wanted).is_ok());
        }
    }
    println!(
        "{name} {kind}: {:.2} of {} found, {:.2} as what they are; {:.1} spots a scene, {:.3} of them planned into",
        share(score.found, score.scenes),
        score.scenes,
        share(score.right_type, score.scenes),
        share(score.spots, score.scenes),
        share(score.planned, score.spots),
    );
    score
}

fn assert_score(score: &Score, least: f64) {
    assert!(share(score.found, score.scenes) >= least, "{score:?}");
    assert!(share(score.planned, score.spots) >= 0.9, "{score:?}");
}

#[test]
fn what_lots_leave_free_is_found() {
    let vehicle = Vehicle::default();
    for kind in ParkingType::ALL {
        let least = if kind == ParkingType::Angled { 0.4 } else { 0.6 };
        let scenes = (0..count()).map(|i| lot(&vehicle, kind, SEED, i));
        assert_score(&score("lots", kind, scenes), least);
    }
}

#[test]
fn what_the_paper_style_generator_leaves_free_is_found() {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    for kind in ParkingType::ALL {
        let least = if kind_of(kind) == SpotKind::Bay { 0.8 } else { 0.5 };
        for level in Level::ALL {
            let scenes = (0..count()).map(|i| generate(&config, &vehicle, kind, level, SEED, i));
            assert_score(&score(&format!("home {level}"), kind, scenes), least);
        }
    }
}

/// A bay between two cars, as polygons, as a cloud and as a grid: the same spot.
#[test]
fn polygons_clouds_and_grids_have_the_same_spot() {
    let folder = TempDir::new().unwrap();
    let boxes = [
        [-4.1, -2.5, -1.5, 2.3],
        [1.5, -2.6, 4.1, 2.2],
        [-12.0, -3.4, 12.0, -3.0],
        [-12.0, 9.0, 12.0, 9.4],
    ];
    let polygon = |[x0, y0, x1, y1]: [f64; 4]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let inside = |x: f64, y: f64| {
        boxes.iter().any(|&[x0, y0, x1, y1]| (x0..x1).contains(&x) && (y0..y1).contains(&y))
    };
    let json = serde_json::json!({
        "obstacles": boxes.map(polygon), "start": [-8.0, 5.5, 0.0], "goal": [0.0, -1.385, 1.57],
        "vehicle": Vehicle::default(),
    });
    fs::write(folder.path().join("lot.json"), json.to_string()).unwrap();
    let mut cloud = "x,y\n".to_owned();
    for [x0, y0, x1, y1] in boxes {
        let along = |from: f64, to: f64| {
            let count = ((to - from) / 0.15).ceil();
            (0..count as u32).map(move |i| from + (to - from) * f64::from(i) / count)
        };
        along(x0, x1).for_each(|x| cloud += &format!("{x},{y0}\n{x},{y1}\n"));
        along(y0, y1).for_each(|y| cloud += &format!("{x0},{y}\n{x1},{y}\n"));
    }
    fs::write(folder.path().join("lot.csv"), cloud).unwrap();
    let (columns, rows) = (280, 160);
    let mut pgm = format!("P5\n{columns} {rows}\n255\n").into_bytes();
    for j in (0..rows).rev() {
        let at =
            |i: i32| inside(-14.0 + (f64::from(i) + 0.5) * 0.1, -5.0 + (f64::from(j) + 0.5) * 0.1);
        pgm.extend((0..columns).map(|i| if at(i) { 0 } else { 254 }));
    }
    fs::write(folder.path().join("lot.pgm"), pgm).unwrap();
    let yaml = "image: lot.pgm\nresolution: 0.1\norigin: [-14.0, -5.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n";
    fs::write(folder.path().join("lot.yaml"), yaml).unwrap();
    for name in ["lot.json", "lot.csv", "lot.yaml"] {
        let map = Map::read(&folder.path().join(name)).unwrap();
        let spots = map.free_spots(&Vehicle::default()).unwrap();
        let bay = spots
            .iter()
            .find(|free| (free.spot.middle.position() - Vec2::new(0.0, -0.1)).norm() < 0.5);
        let bay = bay.unwrap_or_else(|| panic!("{name}: {spots:?}"));
        assert_eq!(bay.kind, SpotKind::Bay, "{name}");
        assert!((bay.spot.width - 3.0).abs() < 0.25, "{name}: {bay:?}");
        assert!((bay.spot.middle.heading - std::f64::consts::FRAC_PI_2).abs() < 0.1, "{name}");
    }
}

fn spots(file: &Path, more: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::cargo_bin("n3p-scene").unwrap();
    let output = command.arg("spots").arg(file).args(more).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout) + &text(&output.stderr))
}

#[test]
fn the_program_lists_what_it_finds() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (code, text) = spots(&root.join("examples/scenes/reverse.json"), &["--json"]);
    assert_eq!(code, Some(0), "{text}");
    let found: Value = serde_json::from_str(&text).unwrap();
    let found = found["spots"].as_array().unwrap();
    assert!(found.iter().any(|spot| spot["type"] == "bay"), "{text}");
    let (code, text) = spots(&root.join("examples/scenes/reverse.json"), &[]);
    assert!(code == Some(0) && text.contains("free spots found"), "{text}");
    // Marked ones count before found ones, unless told otherwise.
    let marked = root.join("tests/fixtures/maps/lot.xodr");
    let (_, text) = spots(&marked, &["--vehicle", "accord"]);
    assert!(text.contains("of 3 spots are free"), "{text}");
    let (_, text) = spots(&marked, &["--vehicle", "accord", "--find"]);
    assert!(text.contains("free spots found"), "{text}");
    let (code, text) = spots(&root.join("tests/fixtures/maps/lot.yaml"), &[]);
    assert!(code == Some(2) && text.contains("--vehicle: is missing"), "{text}");
    // Nothing to park between.
    let folder = TempDir::new().unwrap();
    let alone = folder.path().join("one.csv");
    fs::write(&alone, "x,y\n1,2\n").unwrap();
    let (code, text) = spots(&alone, &["--vehicle", "accord"]);
    assert!(code == Some(0) && text.contains(": 0 free spots found"), "{text}");
}
