//! Scene files: what is read, and what a person is told about a file that is not a scene.

#[path = "fixtures/lots.rs"]
mod lots;

use std::fs;
use std::path::{Path, PathBuf};

use n3p::geometry::{Polygon, Vec2};
use n3p::world::Scene;
use proptest::prelude::*;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/scenes").join(name)
}

/// What reading `content` under `name` says, without the folder.
fn complaint(name: &str, content: &str) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, content).unwrap();
    let message = Scene::read(&path).expect_err("a broken scene").to_string();
    assert!(message.contains(path.to_str().unwrap()), "names the file: {message}");
    assert!(message.lines().count() <= 2, "is short: {message}");
    message
}

/// A good scene with one field replaced by raw JSON.
fn json_with(field: &str, value: &str) -> String {
    let fields = [
        (
            "vehicle",
            r#"{"length":4.97,"width":1.86,"wheelbase":2.83,"rear_overhang":1.1,"max_steer":0.6}"#,
        ),
        ("start", "[0,0,0]"),
        ("goal", "[5,-3,1.5]"),
        ("obstacles", "[[[0,5],[1,5],[1,6]]]"),
    ];
    let mut json: Vec<String> = fields
        .iter()
        .filter(|(name, _)| *name != field)
        .map(|(name, value)| format!("{name:?}: {value}"))
        .collect();
    json.push(format!("{field:?}: {value}"));
    format!("{{{}}}", json.join(",\n"))
}

#[test]
fn reads_json_far_from_the_origin() {
    let scene = Scene::read(&fixture("points.json")).unwrap();
    assert_eq!(scene.name, "points", "an empty name becomes the file's");
    assert_eq!(scene.start.x, 501200.25);
    assert_eq!(scene.points, [[501206.0, -201003.0]]);
    assert_eq!(scene.geometry().unwrap().points().len(), 1);
}

#[test]
fn reads_a_raw_tpcap_file() {
    let scene = Scene::read(&fixture("garage.csv")).unwrap();
    assert_eq!(scene.name, "garage");
    assert_eq!(scene.vehicle.length, 4.689);
    assert_eq!(scene.goal.heading, std::f64::consts::FRAC_PI_2);
    // The first was clockwise with a vertex given twice.
    assert_eq!(scene.obstacles[0], [[-3., -7.], [0., -7.], [0., -2.], [-3., -2.]]);
    assert_eq!(scene.obstacles[1], [[3., -7.], [6., -7.], [3., -2.]]);
}

#[test]
fn no_obstacles_is_a_scene() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("empty lot.JSON");
    fs::write(&path, json_with("obstacles", "[]")).unwrap();
    let scene = Scene::read(&path).unwrap();
    assert_eq!(scene.name, "empty lot");
    assert!(scene.geometry().unwrap().is_empty());
}

#[test]
fn complaints_name_the_place_and_the_remedy() {
    let cases: &[(String, &[&str])] = &[
        (String::new(), &["is empty"]),
        (" \n".to_owned(), &["is empty"]),
        (json_with("start", "[0, NaN, 0]"), &["NaN at line 4 column", "not a number"]),
        (json_with("goal", "[0, -Infinity, 0]"), &["-Infinity at line 4", "not a number"]),
        (json_with("start", "[0, null, 0]"), &["start is [0,null,0]", "3 finite numbers"]),
        (json_with("goal", "[0, 1]"), &["goal is [0,1]", "3 finite numbers"]),
        (json_with("obstacles", "[[[0,1],[2,\"x\"],[3,3]]]"), &["obstacles[0][1]", "\"x\""]),
        (json_with("obstacles", "[[[0,1],[2,3,4],[3,3]]]"), &["obstacles[0][1]", "2 finite"]),
        (json_with("obstacles", "[[[0,1],[2,3]]]"), &["obstacles[0] has 2 vertices", "3"]),
        (json_with("obstacles", "[7]"), &["obstacles[0] is 7"]),
        (json_with("start", "[0, 2e7, 0]"), &["start = [0.0, 20000000.0, 0.0]", "1e7"]),
        (json_with("bounds", "[0, 0, 0, 5]"), &["bounds", "below its max"]),
        (json_with("bounds", "[0, 0, 9]"), &["bounds is [0,0,9]", "4 finite numbers"]),
        (json_with("parking_type", "\"diagonal\""), &["`diagonal`", "`forward`", "line"]),
        (json_with("colour", "1"), &["`colour`", "`obstacles`"]),
        (json_with("vehicle", "{\"length\": 4}"), &["missing field `width`"]),
        (
            json_with("start", "[0,0,0]").replace("\"width\":1.86", "\"width\":-1"),
            &["vehicle.width is -1", "between 0.1 and 50 metres"],
        ),
        ("[]".to_owned(), &["is not a scene"]),
        ("{}".to_owned(), &["missing field `vehicle`"]),
        ("hello".to_owned(), &["is not valid JSON", "line 1"]),
    ];
    for (content, parts) in cases {
        let message = complaint("scene.json", content);
        for part in *parts {
            assert!(message.contains(part), "{part:?} missing in: {message}");
        }
    }
}

#[test]
fn every_truncation_of_a_file_is_a_clear_error() {
    for name in ["points.json", "garage.csv"] {
        let whole = fs::read_to_string(fixture(name)).unwrap();
        let whole = whole.trim_end();
        for end in 0..whole.len() {
            // A CSV that ends inside its last number is still a whole file.
            if name.ends_with("csv") && end + 1 == whole.len() {
                continue;
            }
            let message = complaint(name, &whole[..end]);
            let said = ["cut short", "is empty", "ends after", "expected a finite number"];
            assert!(said.iter().any(|s| message.contains(s)), "cut at {end}: {message}");
        }
    }
}

#[test]
fn tpcap_complaints_give_the_position() {
    let cases = [
        ("1,2,0,3,4,zero,0", "value 6 is \"zero\""),
        ("1,2,0,NaN,4,0,0", "value 4 is \"NaN\""),
        ("1,2,0,3,4,0,-1", "value 7 is -1; expected the number of obstacles"),
        ("1,2,0,3,4,0,1,2.5", "value 8 is 2.5; expected the vertex count of obstacle 1 of 1"),
        ("1,2,0,3,4,0,1,3,0,0,1,1,2", "ends after 13 values; expected at least 14"),
        ("1,2,0,3,4,0,1,3,0,0,1,1,2,0,9", "holds 15 values, 1 too many"),
        ("1,2,0,3,4,0,1,3,0,0,1,1,1,1", "obstacles[0] has 2 vertices"),
        ("1,2,0,3,4,0,900000,3", "ends after 8 values"),
    ];
    for (content, part) in cases {
        let message = complaint("case.csv", content);
        assert!(message.contains(part), "{part:?} missing in: {message}");
    }
}

#[test]
fn files_that_are_not_there_or_no_scenes() {
    let dir = tempfile::tempdir().unwrap();
    let message = |path: &Path| Scene::read(path).unwrap_err().to_string();
    assert!(message(&dir.path().join("no.json")).contains("no such file"));
    assert!(message(&dir.path().join("scene.yaml")).contains("expected .json"));
    let folder = |path: &Path| Scene::read_dir(path).unwrap_err().to_string();
    assert!(folder(&dir.path().join("gone")).contains("no such file or folder"));
    assert!(folder(dir.path()).contains("holds no scene"));
    assert!(folder(&fixture("garage.csv")).contains("not a folder"));
    let bad = dir.path().join("image.json");
    fs::write(&bad, [0xff, 0xd8, 0xff]).unwrap();
    assert!(message(&bad).contains("not text"));
}

#[test]
fn a_folder_is_read_in_order_with_unique_names() {
    let dir = tempfile::tempdir().unwrap();
    let mut scene = Scene::read(&fixture("points.json")).unwrap();
    scene.name = "same".to_owned();
    for file in ["b.json", "a.json", "c.json"] {
        scene.write(&dir.path().join(file)).unwrap();
    }
    fs::copy(fixture("garage.csv"), dir.path().join("c.csv")).unwrap();
    fs::write(dir.path().join("notes.txt"), "not a scene").unwrap();
    fs::create_dir(dir.path().join("folder.json")).unwrap();
    let names: Vec<String> =
        Scene::read_dir(dir.path()).unwrap().into_iter().map(|s| s.name).collect();
    assert_eq!(names, ["same", "b", "c", "c.json"]);
}

#[test]
fn write_refuses_what_read_would_refuse() {
    let dir = tempfile::tempdir().unwrap();
    let mut scene = Scene::read(&fixture("points.json")).unwrap();
    scene.obstacles[0][2][1] = f64::NAN;
    let message = scene.write(&dir.path().join("x.json")).unwrap_err().to_string();
    assert!(message.contains("obstacles[0][2]") && message.contains("not finite"), "{message}");
    let missing = dir.path().join("no folder/x.json");
    let scene = Scene::read(&fixture("points.json")).unwrap();
    assert!(scene.write(&missing).unwrap_err().to_string().contains("cannot write scene"));
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0, "nothing is left behind");
}

#[test]
fn names_become_file_names() {
    let mut scene = Scene::read(&fixture("points.json")).unwrap();
    for (name, stem) in [
        ("lot A/3", "lot A%2F3"),
        ("lot A_3", "lot A_3"),
        ("../x", "%2E.%2Fx"),
        ("é-1.2", "é-1.2"),
        ("%→", "%25%E2%86%92"),
    ] {
        scene.name = name.to_owned();
        assert_eq!(scene.file_stem(), stem);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_number_survives_a_round_trip(
        v in prop::collection::vec((-1e7..1e7f64, -1.0..1.0f64), 3..20),
        // So far from the border that the goal lies within it, too.
        start in prop::array::uniform3(-9.99e6..9.99e6f64),
        away in -7e3..7e3f64,
    ) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene.json");
        let mut scene = Scene::read(&fixture("points.json")).unwrap();
        scene.start = start.into();
        scene.goal = scene.start.shifted(away);
        scene.obstacles = vec![v.iter().map(|&(x, y)| [x, y * 1e-9]).collect()];
        scene.write(&path).unwrap();
        prop_assert_eq!(Scene::read(&path).unwrap(), scene);
    }
}

#[test]
fn a_tpcap_file_written_as_json_is_the_same_scene() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["yard", "narrow", "ahead"] {
        let raw = Scene::read(&hand_made().join(format!("{name}.csv"))).unwrap();
        assert_eq!(raw.name, name);
        let json = dir.path().join(format!("{name}.json"));
        raw.write(&json).unwrap();
        assert_eq!(Scene::read(&json).unwrap(), raw);
    }
}

/// Parking lots made by hand for the tests.
fn hand_made() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/lots")
}

#[test]
#[ignore = "needs ../shared/scenes"]
fn raw_tpcap_files_are_the_benchmark_scenes() {
    // The reference files are rounded to nanometres.
    const TOL: f64 = 1e-9;
    let shared = Path::new("../shared/scenes");
    let (raw, reference) = (shared.join("tpcap-csv"), shared.join("tpcap"));
    for i in 1..=10 {
        let a = Scene::read(&raw.join(format!("Case{i}.csv"))).unwrap();
        let b = Scene::read(&reference.join(format!("tpcap-case{i:02}.json"))).unwrap();
        assert_eq!(a.name, format!("Case{i}"));
        assert_eq!((a.vehicle, a.start, a.goal), (b.vehicle, b.start, b.goal), "case {i}");
        assert_eq!(a.obstacles.len(), b.obstacles.len(), "case {i}");
        for (p, q) in a.obstacles.iter().zip(&b.obstacles) {
            assert_eq!(p.len(), q.len(), "case {i}");
            for (u, v) in p.iter().zip(q) {
                let near = (u[0] - v[0]).abs() <= TOL && (u[1] - v[1]).abs() <= TOL;
                assert!(near, "case {i}: {u:?} is not {v:?}");
            }
        }
    }
}

/// Every scene was read whole, and the car stands free at start and goal.
fn check_free_ends(scenes: &[Scene]) {
    for scene in scenes {
        let obstacles = scene.geometry().unwrap();
        let polygons = obstacles.polygons();
        assert_eq!(polygons.len(), scene.obstacles.len());
        for pose in [scene.start, scene.goal] {
            let car = scene.vehicle.footprint_at(pose);
            let inside = |p: &Polygon, q: &Polygon| q.vertices().iter().any(|&v| p.contains(v));
            let hit = polygons.iter().any(|p| inside(p, &car) || inside(&car, p));
            assert!(!hit, "{}: footprint at {pose:?}", scene.name);
            assert!(Vec2::new(pose.x, pose.y).norm().is_finite());
        }
    }
}

#[test]
fn hand_made_scenes_read_with_free_starts_and_goals() {
    check_free_ends(&Scene::read_dir(&hand_made()).unwrap());
}

#[test]
#[ignore = "needs ../shared/scenes"]
fn real_scenes_read_with_free_starts_and_goals() {
    check_free_ends(&lots::real("tpcap"));
    check_free_ends(&lots::real("dlp"));
}
