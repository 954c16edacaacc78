//! Pictures: what they show, and that any scene gives well-formed SVG.
//!
//! `N3P_PICTURES=DIR cargo test --release --test draw` keeps the example pictures in DIR.

#![cfg(feature = "lab")]

#[path = "fixtures/lots.rs"]
mod lots;

use std::fs;
use std::path::PathBuf;

use n3p::curves::{Path, Segment};
use n3p::geometry::Pose;
use n3p::output::drawing::{Drawing, scene_svg};
use n3p::vehicle::Vehicle;
use n3p::world::cell::{Cell, Grid};
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene, Stance};

fn scene(kind: ParkingType, level: Level, index: u64) -> Scene {
    generate(&GeneratorConfig::default(), &Vehicle::default(), kind, level, 5, index)
}

/// A scene somewhere in the world.
fn placed() -> Scene {
    let config = GeneratorConfig { world_frame: true, ..GeneratorConfig::default() };
    generate(&config, &Vehicle::default(), ParkingType::Forward, Level::Complex, 5, 3)
}

/// Two arcs and a straight, backward in the middle.
fn some_path(scene: &Scene) -> Path {
    let arc = |curvature, length| Segment { curvature, length };
    Path::new(scene.start, [arc(0.02, 9.0), arc(-0.2, -3.0), arc(0.1, 2.0)])
}

/// Keeps a picture to look at, when asked to.
fn keep(name: &str, svg: &str) {
    if let Some(dir) = std::env::var_os("N3P_PICTURES") {
        fs::write(PathBuf::from(dir).join(format!("{name}.svg")), svg).unwrap();
    }
}

/// Every element is closed, in order.
fn assert_well_formed(svg: &str) {
    let mut open = Vec::new();
    for tag in svg.split('<').skip(1) {
        let (tag, text) = tag.split_once('>').expect("an open tag ends");
        assert!(!text.contains('>'), "stray > after {tag}");
        assert_eq!(tag.matches('"').count() % 2, 0, "quotes in {tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed out of order");
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().unwrap());
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "a number is missing");
}

#[test]
fn a_scene_alone_is_a_picture() {
    for kind in ParkingType::ALL {
        for level in Level::ALL {
            for index in 0..4 {
                let scene = scene(kind, level, index);
                let svg = scene_svg(&scene, &Drawing::default());
                assert_well_formed(&svg);
                assert!(svg.contains(&format!("<title>{}</title>", scene.name)));
                assert!(!svg.contains("direction change") && !svg.contains("preparatory"));
                assert!(svg.len() < 20_000, "{} bytes", svg.len());
                keep(&scene.name, &svg);
            }
        }
    }
}

#[test]
fn everything_at_once() {
    let scene = scene(ParkingType::Reverse, Level::Easy, 1);
    let path = some_path(&scene);
    let grid = Grid::default();
    let stance = Stance::new(ParkingType::Reverse, 0.0);
    let cell = Cell { stance, lane_width: 6.0, spot_width: 3.0, dead_end: 8.0 };
    let regions = grid.regions(&cell);
    let drawing = Drawing {
        other_goals: Vec::new(),
        method: Some("knn-n3p"),
        path: Some(&path),
        regions: Some(regions),
        preparatory: Some(Pose::new(3.0, 6.5, 0.4)),
        note: Some("a <remark> & more"),
        ..Drawing::default()
    };
    let svg = scene_svg(&scene, &drawing);
    assert_well_formed(&svg);
    let title = "knn-n3p · 14.0 m · 2 direction changes · a &lt;remark&gt; &amp; more";
    for part in [title, "preparatory pose", ">lane<", "forward", "backward", "5 m"] {
        assert!(svg.contains(part), "{part} missing");
    }
    keep("everything", &svg);
}

#[test]
fn hostile_names_empty_lots_and_far_places() {
    let mut scene = scene(ParkingType::Parallel, Level::Easy, 0);
    keep("placed", &scene_svg(&placed(), &Drawing::default()));
    scene.name = "</title><script>\"a\" & b\u{7}".to_owned();
    scene.obstacles.clear();
    scene.points = vec![[scene.start.x, scene.start.y + 4.0]];
    assert_well_formed(&scene_svg(&scene, &Drawing::default()));
    assert!(!scene_svg(&scene, &Drawing::default()).contains("<script>"));

    let path = some_path(&scene);
    let near = scene_svg(&scene, &Drawing { path: Some(&path), ..Drawing::default() });
    let moved = |p: Pose| Pose::new(p.x + 4096.0, p.y - 8192.0, p.heading);
    scene.start = moved(scene.start);
    scene.goal = moved(scene.goal);
    scene.points[0] = [scene.points[0][0] + 4096.0, scene.points[0][1] - 8192.0];
    scene.bounds =
        scene.bounds.map(|[a, b, c, d]| [a + 4096.0, b - 8192.0, c + 4096.0, d - 8192.0]);
    let path = Path { start: scene.start, ..path };
    let far = scene_svg(&scene, &Drawing { path: Some(&path), ..Drawing::default() });
    assert_eq!(near.len(), far.len(), "a picture does not depend on the place");

    let still = Path::new(scene.start, []);
    let svg = scene_svg(&scene, &Drawing { path: Some(&still), ..Drawing::default() });
    assert_well_formed(&svg);
}

fn check_pictures(scenes: &[Scene]) {
    for scene in scenes {
        let svg = scene_svg(scene, &Drawing::default());
        assert_well_formed(&svg);
        keep(&scene.name, &svg);
    }
}

#[test]
fn hand_made_scenes_are_pictures() {
    check_pictures(&Scene::read_dir("tests/fixtures/lots".as_ref()).unwrap());
}

#[test]
#[ignore = "needs ../shared/scenes"]
fn real_scenes_are_pictures() {
    check_pictures(&lots::real("tpcap")[..10]);
    check_pictures(&lots::real("dlp")[..10]);
}
