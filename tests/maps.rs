//! Maps of every kind: what is read, what comes out again, and what is said of files that are damaged.
#![cfg(feature = "scene")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use n3p::geometry::{Polygon, Pose, Vec2};
use n3p::vehicle::Vehicle;
use n3p::world::maps::Place;
use n3p::world::{Map, MapOptions, MapRequest, Scene};
use tempfile::TempDir;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/maps").join(name)
}

fn read(name: &str) -> Map {
    Map::read(&fixture(name)).unwrap()
}

fn polygons(map: &Map) -> Vec<Polygon> {
    let polygon = |v: &Vec<[f64; 2]>| {
        Polygon::new(v.iter().map(|&[x, y]| Vec2::new(x, y)).collect()).unwrap()
    };
    map.obstacles.iter().map(polygon).collect()
}

/// A copy of the small grid's description that names another image.
fn grid_of(folder: &Path, image: &Path, change: impl Fn(String) -> String) -> PathBuf {
    let text = fs::read_to_string(fixture("lot.yaml")).unwrap();
    let yaml = folder.join("grid.yaml");
    fs::write(&yaml, change(text.replace("lot.pgm", image.to_str().unwrap()))).unwrap();
    yaml
}

#[test]
fn rectangles_of_a_grid_are_exactly_its_occupied_cells() {
    let rows = [
        "############",
        "#..........#",
        "#..........#",
        "#...??.....#",
        "#...??..##.#",
        "#.......##.#",
        "#..........#",
        "############",
    ];
    for (unknown_is_occupied, blocked) in [(false, "#"), (true, "#?")] {
        let options = MapOptions { unknown_is_occupied, ..MapOptions::default() };
        let map = Map::read_with(&fixture("lot.yaml"), &options).unwrap();
        let polygons = polygons(&map);
        let origin = Pose::new(-3.0, -2.0, 0.3);
        for (j, row) in rows.iter().rev().enumerate() {
            for (i, cell) in row.chars().enumerate() {
                for (u, v) in [(0.5, 0.5), (0.01, 0.02), (0.99, 0.03), (0.98, 0.97)] {
                    let local = Vec2::new((i as f64 + u) * 0.5, (j as f64 + v) * 0.5);
                    let p = origin.point_to_parent(local);
                    let covered = polygons.iter().filter(|polygon| polygon.contains(p)).count();
                    assert_eq!(covered, usize::from(blocked.contains(cell)), "cell {i}, {j}");
                }
            }
        }
    }
}

#[test]
fn images_of_all_kinds_are_the_same_map() {
    let folder = TempDir::new().unwrap();
    let expected = read("lot.yaml");
    let careful = MapOptions { unknown_is_occupied: true, ..MapOptions::default() };
    let expected_careful = Map::read_with(&fixture("lot.yaml"), &careful).unwrap();
    assert!(expected.obstacles.len() < expected_careful.obstacles.len());
    for image in ["lot.png", "lot-rgba.png", "lot-16.png", "lot-palette.png", "lot-ascii.pgm"] {
        // Transparency counts as a colour in trinary maps: it is told of by the mode scale alone.
        let mode = |text: String| match image {
            "lot-rgba.png" => text.replace("trinary", "scale"),
            _ => text,
        };
        let yaml = grid_of(folder.path(), &fixture(image), mode);
        let map = Map::read(&yaml).unwrap();
        assert_eq!(map.obstacles, expected.obstacles, "{image}");
        assert_eq!(map.drivable_area, expected.drivable_area, "{image}");
        if image != "lot-rgba.png" {
            let map = Map::read_with(&yaml, &careful).unwrap();
            assert_eq!(map.obstacles, expected_careful.obstacles, "{image}");
        }
    }
    // One bit knows no unknown cells: they are free or occupied.
    let yaml = grid_of(folder.path(), &fixture("lot-1.png"), |text| text);
    assert_eq!(Map::read(&yaml).unwrap().obstacles, expected.obstacles);
}

#[test]
fn clouds_of_all_kinds_are_the_same_points() {
    let all = [[1.5, 2.25], [-3.125, 4.0], [2.0, -1.0]];
    for name in ["cloud.csv", "cloud-ascii.pcd", "cloud-binary.pcd", "cloud-compressed.pcd"] {
        assert_eq!(read(name).points, all, "{name}");
        let options = MapOptions { heights: [0.5, 2.0], ..MapOptions::default() };
        let some = Map::read_with(&fixture(name), &options).unwrap();
        assert_eq!(some.points, all[..2], "{name}");
        let options = MapOptions { heights: [5.0, 6.0], ..MapOptions::default() };
        let error = Map::read_with(&fixture(name), &options).unwrap_err().to_string();
        assert!(error.contains("from z = 5 to 6 m"), "{error}");
    }
    // Some programs name its columns so.
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("columns.pcd");
    let text = fs::read_to_string(fixture("cloud-ascii.pcd")).unwrap();
    fs::write(&file, text.replace("FIELDS", "COLUMNS")).unwrap();
    assert_eq!(Map::read(&file).unwrap().points, all);
}

/// Map servers take transparency for a fourth colour, so that what is seen through is black: that is told.
#[test]
fn transparent_cells_are_told_of() {
    let folder = TempDir::new().unwrap();
    let yaml = grid_of(folder.path(), &fixture("lot-transparent.png"), |text| text);
    let check = |yaml: &Path| {
        let mut command = Command::cargo_bin("n3p-scene").unwrap();
        let output = command.arg("check").arg(yaml).output().unwrap();
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert!(check(&yaml).contains("transparent pixels"), "{}", check(&yaml));
    let yaml =
        grid_of(folder.path(), &fixture("lot-transparent.png"), |t| t.replace("trinary", "scale"));
    assert!(!check(&yaml).contains("transparent"), "{}", check(&yaml));
}

#[test]
fn geojson_becomes_metres() {
    let map = read("lot.geojson");
    let origin = map.geographic.unwrap();
    assert!((origin.longitude - 13.4003).abs() < 1e-9, "{origin:?}");
    // A degree at 52.5° is 67.9 km of longitude and 111.3 km of latitude.
    let [a, b] = map.polylines[0][..] else { panic!("one wall") };
    assert!((b[0] - a[0] - 54.32).abs() < 0.02 && (b[1] - a[1]).abs() < 1e-4, "{a:?} {b:?}");
    assert_eq!((map.points.len(), map.low.polylines.len(), map.spots.len()), (1, 1, 1));
    let spot = &map.spots[0];
    assert_eq!(spot.name, "A1");
    assert!((spot.length - 5.006).abs() < 0.01 && (spot.width - 2.58).abs() < 0.01, "{spot:?}");
    // The yard of the building is outside of it.
    let building = &polygons(&map)[0];
    assert!(building.contains(origin.to_local([13.4001, 52.50005]).into()));
    assert!(!building.contains(origin.to_local([13.4003, 52.50015]).into()));
    let scene = map.scene(&MapRequest::default()).unwrap();
    assert!((scene.start.heading - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
}

/// Scenes with everything that a scene may have.
fn scenes() -> Vec<Scene> {
    let full = r#"{"name": "full", "source": "by hand", "start": [-9.0, 5.0, 0.1], "goals": [[0.0, -1.385, 1.5707963267948966], [3.1, -1.3, 1.57]],
        "vehicle": {"length": 4.97, "width": 1.86, "wheelbase": 2.83, "rear_overhang": 1.1, "max_steer": 0.609},
        "contour": [[-1.0, -0.9], [3.5, -0.9], [3.8, 0.0], [3.5, 0.9], [-1.0, 0.9]],
        "margins": {"front": 0.2, "rear": 0.1, "left": 0.05, "right": 0.05},
        "goal_tolerance": {"position_m": 0.1, "heading_rad": 0.05}, "parking_type": "reverse",
        "obstacles": [[[-4.0, -2.6], [-1.4, -2.6], [-1.4, 2.6], [-4.0, 2.6]], [[6.0, 1.0], [7.1, 1.3]]],
        "polylines": [[[1.5, -2.7], [1.6, 0.3], [2.0, 2.2]]], "points": [[2.0, 1.5], [0.1, 9.7]],
        "low": {"obstacles": [[[8.0, 0.0], [9.0, 0.0], [9.0, 0.3]], [[8.0, 2.0], [9.0, 2.0]]], "polylines": [[[5.0, 0.0], [6.0, 0.5]]], "points": [[5.5, 5.5]]},
        "drivable_area": {"outer": [[-20.0, -4.0], [20.0, -4.0], [20.0, 19.0], [-20.0, 19.0]], "holes": [[[14.0, 14.0], [15.0, 14.0], [15.0, 15.0]]]},
        "bounds": [-20.0, -4.0, 20.0, 9.0]}"#;
    let examples = ["forward", "parallel", "reverse"].map(|name| {
        let file = format!("examples/scenes/{name}.json");
        Scene::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
    });
    let full = Scene::from_json(full, Path::new("full")).unwrap();
    examples.into_iter().chain([full]).collect()
}

#[test]
fn scenes_come_back_from_geojson_as_they_were() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("scene.geojson");
    for scene in scenes() {
        let mut map = Map::from(scene.clone());
        fs::write(&file, map.to_geojson()).unwrap();
        let back = Map::read(&file).unwrap();
        assert_eq!(back.scene(&MapRequest::default()).unwrap(), scene, "every number");
        // Somewhere on Earth degrees resolve 3 nm.
        map.geographic = Some([179.9999, -45.3].into());
        fs::write(&file, map.to_geojson()).unwrap();
        let back = Map::read(&file).unwrap().scene(&MapRequest::default()).unwrap();
        let far = |a: &[Vec<[f64; 2]>], b: &[Vec<[f64; 2]>]| {
            let pairs = a.iter().flatten().zip(b.iter().flatten());
            pairs.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max)
        };
        assert_eq!(back.obstacles.len(), scene.obstacles.len());
        assert!(far(&back.obstacles, &scene.obstacles) < 1e-8);
        assert!(far(&back.polylines, &scene.polylines) < 1e-8);
        assert!(back.goal.distance(scene.goal) < 1e-8 && back.goal.heading == scene.goal.heading);
        // Written again it is the same place on Earth.
        assert_eq!(Map::read(&file).unwrap().geographic, map.geographic);
    }
}

#[test]
fn commonroad_says_where_things_and_goals_are() {
    let map = read("lot-2020a.xml");
    assert_eq!((&map.name[..], map.obstacles.len()), ("ZAM_Lot-1_1_T-1", 4));
    let polygons = polygons(&map);
    assert!(
        polygons[0].contains(Vec2::new(-2.7, 2.2)) && polygons[1].contains(Vec2::new(2.7, -2.2))
    );
    // The polygon around the circle holds all of it.
    for i in 0..100 {
        let (sin, cos) = (f64::from(i) * 0.063).sin_cos();
        assert!(polygons[2].contains(Vec2::new(-7.5 + 0.299 * cos, -1.0 + 0.299 * sin)));
    }
    assert_eq!(map.start, Some(Place::Middle(Pose::new(-8.0, 5.2, 0.0))));
    let scene =
        map.scene(&MapRequest { vehicle: Some(Vehicle::default()), ..MapRequest::default() });
    let scene = scene.unwrap();
    let middle = scene.vehicle.body_center(scene.goal);
    assert!(
        middle.x.abs() < 1e-12 && middle.y.abs() < 1e-12 && (middle.heading - 1.57).abs() < 1e-12
    );
    let tolerance = scene.goal_tolerance.unwrap();
    assert!(
        (tolerance.position_m - 0.2).abs() < 1e-12 && (tolerance.heading_rad - 0.1).abs() < 1e-9
    );
    let options = MapOptions { borders: true, ..MapOptions::default() };
    let borders = Map::read_with(&fixture("lot-2020a.xml"), &options).unwrap().polylines;
    assert_eq!(borders, [[[-10.0, 8.0], [10.0, 8.0]], [[-10.0, 2.8], [10.0, 2.8]]]);
    let old = read("lot-2018b.xml");
    assert_eq!((old.obstacles.len(), old.goals.len()), (1, 1));
    assert!((old.goal_tolerance.unwrap().position_m - 0.25).abs() < 1e-12);
}

#[test]
fn opendrive_has_spots_and_objects_at_their_road_coordinates() {
    let map = read("lot.xodr");
    assert_eq!((map.spots.len(), map.obstacles.len(), map.points.len()), (3, 3, 1));
    assert_eq!(map.low.obstacles.len(), 1);
    let [parked, spot, _] = &map.spots[..] else { panic!("three") };
    assert!((parked.middle.x - 8.0).abs() < 1e-12 && (parked.middle.y - 6.0).abs() < 1e-12);
    assert!((spot.middle.x - 10.6).abs() < 1e-9 && (spot.length - 5.0).abs() < 1e-9, "{spot:?}");
    assert!((spot.width - 2.6).abs() < 1e-9);
    // 10 m into an arc of 20 m radius that begins at (39.792, 1.6555) with 0.25 rad, and 6 m to the right of it.
    let (sin, cos) = 0.75_f64.sin_cos();
    let centre = [39.7920 - 20.0 * 0.25_f64.sin(), 1.6555 + 20.0 * 0.25_f64.cos()];
    let [x, y] = map.points[0];
    assert!((x - centre[0] - 26.0 * sin).hypot(y - centre[1] + 26.0 * cos) < 1e-9, "{x} {y}");
    // Both ways into the two that are long enough.
    let request = MapRequest {
        start: Some(Pose::new(0.0, 0.0, 0.0)),
        vehicle: Some(Vehicle::default()),
        ..MapRequest::default()
    };
    assert_eq!(map.scene(&request).unwrap().all_goals().len(), 4);
}

/// Objects in rows, along the road, known by what is inside of them, and as other programs write them.
#[test]
fn opendrive_rows_stand_where_they_say() {
    let map = read("rows.xodr");
    let names: Vec<&str> = map.spots.iter().map(|spot| &spot.name[..]).collect();
    let count = |name: &str| names.iter().filter(|n| **n == name).count();
    assert_eq!((count("bay"), count("outlined"), count("3")), (11, 4, 1), "{names:?}");
    for (i, spot) in map.spots.iter().filter(|spot| spot.name == "bay").enumerate() {
        let middle = Vec2::new(10.0 + 2.5 * i as f64, -6.5);
        assert!((spot.middle.position() - middle).norm() < 1e-9, "{spot:?}");
        assert!((spot.length - 5.0).abs() < 1e-9 && (spot.width - 2.5).abs() < 1e-9, "{spot:?}");
    }
    let outlined = map.spots.iter().filter(|spot| spot.name == "outlined");
    for (i, spot) in outlined.enumerate() {
        let middle = Vec2::new(0.05 + 2.55 * i as f64 + 1.25, 6.5);
        assert!((spot.middle.position() - middle).norm() < 1e-9, "{spot:?}");
    }
    let polygons = polygons(&map);
    let inside = |x: f64, y: f64| polygons.iter().any(|polygon| polygon.contains(Vec2::new(x, y)));
    for x in [20.0, 30.0, 40.0, 50.0] {
        assert!(inside(x, 5.5) && inside(x + 0.149, 5.5) && !inside(x + 0.2, 5.5), "pole at {x}");
    }
    assert!(!inside(8.0, 5.5), "where a repeated object says it is itself, there is none");
    // The wall, 30 cm thick, from 9.5 m beside the road to 10.5 m.
    for x in [0.1, 20.0, 37.3, 59.9] {
        let middle = -9.5 - x / 60.0;
        assert!(inside(x, middle + 0.14) && inside(x, middle - 0.14), "wall at {x}");
        assert!(!inside(x, middle + 0.16) && !inside(x, middle - 0.16), "wall at {x}");
    }
    for (s, t) in [(40.0, 10.0), (44.0, 12.0)] {
        assert!(inside(s + 0.9, t + 0.4) && inside(s - 0.9, t - 0.4) && !inside(s, t + 0.6));
    }
    // A railing without a width, 9 m left of an arc of 50 m radius.
    let [railing, fence] = &map.polylines[..] else { panic!("two lines") };
    assert!(railing.len() > 50 && fence.len() == 3, "{} {}", railing.len(), fence.len());
    for &[x, y] in railing {
        assert!(((x - 60.0).hypot(y - 50.0) - 41.0).abs() < 1e-9);
    }
    assert_eq!(map.points, [[5.0, 33.0]]);
    assert_eq!(map.low.obstacles.len(), 0);
}

/// What stands still is in the way, whatever it is called.
#[test]
fn commonroad_buildings_are_obstacles() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("a.xml");
    let text = fs::read_to_string(fixture("lot-2020a.xml")).unwrap();
    let building = r#"<environmentObstacle id="900"><type>building</type><shape><polygon>
        <point><x>-10</x><y>10</y></point><point><x>10</x><y>10</y></point><point><x>10</x><y>12</y></point>
        </polygon></shape></environmentObstacle><planningProblem "#;
    fs::write(&file, text.replacen("<planningProblem ", building, 1)).unwrap();
    let map = Map::read(&file).unwrap();
    assert_eq!(map.obstacles.len(), 5);
    assert!(polygons(&map)[4].contains(Vec2::new(9.0, 11.5)));
    // A goal that is a polygon says by its shape which way to stand.
    let from = text.find("<goalState>").unwrap();
    let to = text.find("</goalState>").unwrap();
    let corner = |x: f64, y: f64| format!("<point><x>{x}</x><y>{y}</y></point>");
    let corners = [(-0.3, -0.6), (0.3, -0.6), (0.3, 0.6), (-0.3, 0.6)].map(|(x, y)| corner(x, y));
    let goal = format!("<goalState><position><polygon>{}</polygon></position>", corners.concat());
    fs::write(&file, format!("{}{goal}{}", &text[..from], &text[to..])).unwrap();
    let map = Map::read(&file).unwrap();
    let headings: Vec<f64> = map
        .goals
        .iter()
        .map(|goal| match goal {
            Place::Middle(pose) | Place::RearAxle(pose) => pose.heading.abs(),
        })
        .collect();
    assert_eq!(headings.len(), 2);
    assert!(
        headings.iter().all(|h| (h - std::f64::consts::FRAC_PI_2).abs() < 1e-9),
        "{headings:?}"
    );
}

/// Of an extract of OpenStreetMap roads and the car park's own area are no obstacles.
#[test]
fn tags_of_openstreetmap_say_what_is_in_the_way() {
    let map = read("street.geojson");
    assert_eq!((map.spots.len(), map.obstacles.len(), map.polylines.len()), (2, 1, 1));
    assert_eq!((map.points.len(), map.low.polylines.len()), (1, 1));
}

fn n3p_plan(arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::cargo_bin("n3p-plan").unwrap().args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout) + &text(&output.stderr))
}

#[test]
fn every_kind_of_map_is_planned_on() {
    let folder = TempDir::new().unwrap();
    let out = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let map = |name: &str| fixture(name).to_str().unwrap().to_owned();
    let example = |name: &str| format!("{}/examples/maps/{name}", env!("CARGO_MANIFEST_DIR"));
    let (floor, tugger) = (example("shop-floor.yaml"), example("tugger.json"));
    let trajectory = out("drive.mcap");
    let floor = [
        "--map",
        &floor,
        "--start",
        "0,12,0",
        "--goal",
        "12.3,0.2,1.5708",
        "--vehicle",
        &tugger,
        "--trajectory",
        &trajectory,
    ];
    assert_eq!(n3p_plan(&floor).0, Some(0), "{}", n3p_plan(&floor).1);
    let recording = fs::read(trajectory).unwrap();
    assert!(recording.starts_with(b"\x89MCAP0\r\n") && recording.ends_with(b"\x89MCAP0\r\n"));
    let geojson = out("drive.geojson");
    for arguments in [
        vec!["--map", &map("lot-2020a.xml"), "--vehicle", "accord", "--out", &out("a.csv")],
        vec!["--map", &map("lot-2018b.xml"), "--vehicle", "tpcap"],
        vec!["--map", &map("lot.xodr"), "--vehicle", "accord", "--start", "1,0,0"],
        vec![
            "--map",
            &map("cloud.csv"),
            "--vehicle",
            "tpcap",
            "--start",
            "-8,-4,0",
            "--goal",
            "8,-4,0",
        ],
        vec![
            "--map",
            &map("cloud-binary.pcd"),
            "--vehicle",
            "tpcap",
            "--start",
            "-8,-4,0",
            "--goal",
            "8,-4,0;9,-4,0",
        ],
        vec!["--map", &map("lot.geojson"), "--trajectory", &geojson],
    ] {
        let (code, text) = n3p_plan(&arguments);
        assert_eq!(code, Some(0), "{arguments:?}: {text}");
    }
    // What was written in WGS-84 is a map as well.
    let drive = Map::read(Path::new(&geojson)).unwrap();
    let there = read("lot.geojson");
    assert_eq!(drive.geographic, there.geographic);
    let (Some(Place::RearAxle(a)), Some(Place::RearAxle(b))) = (drive.start, there.start) else {
        panic!("both have a start")
    };
    assert!(a.distance(b) < 1e-8);
    let csv = fs::read_to_string(out("a.csv")).unwrap();
    assert!(csv.starts_with("x_m,y_m,heading_rad,gear,steer_rad\n") && csv.lines().count() > 50);
}

#[test]
fn a_plan_is_the_same_whichever_way_the_scene_came() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scene = |arguments: &[&str]| {
        Command::cargo_bin("n3p-scene").unwrap().args(arguments).assert().success();
    };
    let map = fixture("lot-2020a.xml").to_str().unwrap().to_owned();
    scene(&["convert", &map, &at("scene.json"), "--vehicle", "accord"]);
    scene(&["convert", &at("scene.json"), &at("scene.geojson")]);
    scene(&["draw", &at("scene.geojson"), &at("scene.svg")]);
    scene(&["draw", fixture("lot.xodr").to_str().unwrap(), &at("place.svg")]);
    scene(&["check", &at("scene.json"), &at("scene.geojson"), &map]);
    assert!(fs::read_to_string(at("place.svg")).unwrap().contains(">spot<"));
    for (from, out) in [
        (vec!["--map", &map[..], "--vehicle", "accord"], "a.json"),
        (vec!["--scene", &at("scene.json")], "b.json"),
        (vec!["--map", &at("scene.geojson")], "c.json"),
    ] {
        let (code, text) = n3p_plan(&[&from[..], &["--out", &at(out)]].concat());
        assert_eq!(code, Some(0), "{text}");
        assert_eq!(fs::read(at(out)).unwrap(), fs::read(at("a.json")).unwrap(), "{from:?}");
    }
}

#[test]
fn what_a_map_lacks_is_named() {
    let map = fixture("lot.yaml").to_str().unwrap().to_owned();
    for (arguments, named) in [
        (vec![], "vehicle is missing"),
        (vec!["--vehicle", "accord"], "start is missing"),
        (vec!["--vehicle", "accord", "--start", "0,0,0"], "goal is missing"),
        (vec!["--vehicle", "bus"], "bus is no vehicle"),
        (vec!["--vehicle", "none.json"], "cannot read vehicle"),
        (vec!["--vehicle", "accord", "--start", "0,0"], "expected three finite numbers"),
        (vec!["--vehicle", "accord", "--start", "0,0,NaN"], "expected three finite numbers"),
    ] {
        let (code, text) = n3p_plan(&[&["--map", &map[..]], &arguments[..]].concat());
        assert_eq!(code, Some(2), "{text}");
        assert!(text.contains(named) && text.lines().count() <= 2, "{text}");
    }
    let (code, text) = n3p_plan(&["--scene", &map, "--start", "0,0,0"]);
    assert!(code == Some(2) && text.contains("--map"), "{text}");
}
