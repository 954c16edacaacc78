//! `--margin`: plans keep it, say when they cannot, and refuse what is none.

#![cfg(feature = "lab")]

use std::path::Path;

use assert_cmd::Command;
use n3p::episode;
use n3p::episode::{Case, EpisodeConfig};
use n3p::lab::evaluation::suite::{self, SuiteConfig};
use n3p::lab::evaluation::{oracle, rows};
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::output::PathFile;
use n3p::planners::goals::Terms;
use n3p::planners::{Budget, Problem};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use predicates::prelude::*;
use predicates::str::contains;
use proptest::prelude::{ProptestConfig, prop_assert, prop_assert_eq, proptest};

const BUDGET: Budget = Budget::new(50_000);

/// What the oracle, which looks every centimetre, may find below the margin, metres: rounding.
const TOL: f64 = 1e-3;

fn models() -> Models {
    Models::load(&["models/knn.bin"]).unwrap()
}

fn scene(kind: ParkingType, level: Level, index: u64) -> Scene {
    generate(&GeneratorConfig::default(), &Vehicle::default(), kind, level, 2718, index)
}

/// A reverse bay whose neighbours stand `room` metres beside the parked car, which is 1.86 m wide.
fn bay(room: f64) -> String {
    let x = 0.93 + room;
    format!(
        r#"{{"name": "bay", "vehicle": {{"length": 4.97, "width": 1.86, "wheelbase": 2.83,
            "rear_overhang": 1.1, "max_steer": 0.609}},
            "start": [-6, 6.5, 0], "goal": [0, -1.4, 1.5707963267948966],
            "parking_type": "reverse", "obstacles": [
            [[-4, -2.7], [-{x}, -2.7], [-{x}, 2.7], [-4, 2.7]],
            [[{x}, -2.7], [4, -2.7], [4, 2.7], [{x}, 2.7]]]}}"#
    )
}

/// `n3p-plan --method ha-rs` on the text of a scene.
fn plan(text: &str, args: &[&str]) -> assert_cmd::assert::Assert {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.json"), text).unwrap();
    let mut command = Command::cargo_bin("n3p-plan").expect("a binary of this crate");
    let command = command.current_dir(dir.path()).args(["--scene", "s.json", "--method", "ha-rs"]);
    command.args(args).assert()
}

#[test]
fn plans_keep_the_margin_in_the_eyes_of_the_oracle() {
    const ASKED: f64 = 0.2;
    let models = models();
    for method in [Method::HA_RS, Method::N3P] {
        let mut planner = method.build(&models, &MethodSettings::default()).unwrap();
        let (mut found, mut whole) = (0, 0);
        for i in 0..30 {
            let kind = ParkingType::SQUARE[i as usize % 3];
            let set = String::new();
            let case =
                Case { scene: scene(kind, Level::Easy, i), kind: Some(kind), level: None, set };
            let usual = EpisodeConfig::new(BUDGET);
            let terms = Terms { margin: ASKED, ..Terms::default() };
            let config = EpisodeConfig { terms, repeats: 0, ..usual };
            let episode = episode::run(&case, planner.as_mut(), &config, &oracle::JUDGE).unwrap();
            let margin = episode.problem.margin;
            whole += usize::from(margin == ASKED);
            if let Some(clearance) = episode.row.min_clearance_m {
                found += 1;
                let name = &case.scene.name;
                assert!(clearance >= margin - TOL, "{method} {name}: {clearance} below {margin}");
            }
        }
        // A car that leaves a parallel spot swings its tail towards the kerb: 20 cm are too much
        // for most of them, but for no bay.
        assert!(whole > 20 && found > 20, "{method}: {whole} with all of it, {found} paths");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// The rule, written here from its words: all of it where both ends allow it, else the most
    /// whole centimetres, else the usual margin, else nothing.
    #[test]
    fn start_and_goal_decide_how_much_is_kept(room in 0.0001..0.5, asked in 0.0..=1.0) {
        let scene: Scene = serde_json::from_str(&bay(room)).unwrap();
        let problem = Problem::with_margin(&scene, asked).unwrap();
        let room = 0.93 + room - 0.93; // What the decimals of the scene leave.
        let wanted = asked.max(Problem::MARGIN);
        let expected = if wanted < room {
            wanted
        } else if room > 0.01 {
            (room * 100.0).floor() / 100.0
        } else if room > Problem::MARGIN {
            Problem::MARGIN
        } else {
            0.0
        };
        prop_assert_eq!(problem.margin, expected, "room {} asked {}", room, asked);
        // From what is not next to start or goal all of it is kept.
        prop_assert_eq!(*problem.collision.footprint(), scene.vehicle.footprint(wanted));
        prop_assert!(problem.collision.pose_is_free(problem.goal));
    }
}

#[test]
fn results_do_not_depend_on_margins_planned_before() {
    let models = models();
    for method in [Method::HA_RS, Method::N3P, Method::KNN_N3P] {
        let build = || method.build(&models, &MethodSettings::default()).unwrap();
        let mut used = build();
        for i in 0..12 {
            let scene = scene(ParkingType::SQUARE[i as usize % 3], Level::Complex, i);
            for margin in [0.0, 0.15, 0.07, 0.0, 0.15] {
                let problem = Problem::with_margin(&scene, margin).unwrap();
                let again = used.plan(&problem, BUDGET);
                let fresh = build().plan(&problem, BUDGET);
                assert_eq!(again.outcome, fresh.outcome, "{method} {} {margin}", scene.name);
                assert_eq!(again.expansions, fresh.expansions);
            }
        }
    }
}

#[test]
fn no_margin_is_the_usual_one() {
    let (models, kinds) = (models(), ParkingType::SQUARE);
    let cases = suite::at_home(&Vehicle::default(), &kinds, &Level::ALL, 3, 11).unwrap();
    let rows = |margin| {
        let config = SuiteConfig {
            methods: vec![Method::HA_RS, Method::N3P],
            settings: MethodSettings::default(),
            budget: BUDGET,
            terms: Terms { margin, ..Terms::default() },
            threads: 1,
        };
        let mut rows =
            suite::run(&cases, &models, &config, 0, |_, _| Ok::<_, suite::SuiteError>(())).unwrap();
        rows.iter_mut().for_each(|r| r.plan_time_s = 0.0);
        rows
    };
    assert_eq!(rows(0.0), rows(Problem::MARGIN));
    assert_ne!(rows(0.0), rows(0.2));
}

#[test]
fn a_plan_says_what_it_keeps() {
    plan(&bay(0.3), &[]).success().stdout(contains("margin            0.005 m"));
    let quiet = || contains("--margin").not();
    plan(&bay(0.3), &["--margin", "0.2"])
        .success()
        .stdout(contains("margin            0.2 m"))
        .stderr(quiet());
    plan(&bay(0.1003), &["--margin", "0.2"])
        .success()
        .stdout(contains("margin            0.1 m"))
        .stderr(contains("--margin 0.2").and(contains("as near as 0.1 m")));
    // Without the option nobody asked for more.
    plan(&bay(0.003), &[]).success().stdout(contains("margin            0 m")).stderr(quiet());
    // Walls all around the bays.
    let walls = "\"obstacles\": [[[-9, 3], [9, 3], [9, 3.2], [-9, 3.2]], \
                 [[-9, -9], [-8, -9], [-8, 3.1], [-9, 3.1]], \
                 [[8, -9], [9, -9], [9, 3.1], [8, 3.1]], [[-9, -9], [9, -9], [9, -8], [-9, -8]], ";
    plan(&bay(0.5).replace("\"obstacles\": [", walls), &["--margin", "0.45"])
        .code(3)
        .stdout(contains("margin 0.45 m").and(contains("smaller --margin")));
    let output = plan(&bay(0.1003), &["--margin", "0.2", "--json"]).success();
    let json: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(json["margin_m"], 0.1);
    assert!(json["row"]["min_clearance_m"].as_f64().unwrap() >= 0.1 - TOL);
}

#[test]
fn an_evaluation_keeps_it_and_counts_the_scenes_with_less() {
    let dir = tempfile::tempdir().unwrap();
    let (scenes, paths) = (dir.path().join("scenes"), dir.path().join("paths"));
    std::fs::create_dir(&scenes).unwrap();
    for (name, room) in [("wide", 0.4), ("narrow", 0.1003)] {
        let text = bay(room).replace("\"bay\"", &format!("\"{name}\""));
        std::fs::write(scenes.join(format!("{name}.json")), text).unwrap();
    }
    let mut command = Command::cargo_bin("n3p-eval").expect("a binary of this crate");
    command
        .current_dir(dir.path())
        .args(["--methods", "ha-rs,mhha", "--scenes", "scenes", "--paths", "paths"])
        .args(["--margin", "0.25", "--out", "out"])
        .assert()
        .success()
        .stderr(contains("in 1 of 2 scenes").and(contains("--margin 0.25")));
    let rows = rows::read_csv(&dir.path().join("out/rows.csv")).unwrap();
    assert_eq!(rows.len(), 4);
    for row in rows {
        let kept = if row.scene == "wide" { 0.25 } else { 0.1 };
        assert!(row.ok && row.min_clearance_m.unwrap() >= kept - TOL, "{row:?}");
        let scene = Scene::read(&scenes.join(format!("{}.json", row.scene))).unwrap();
        let path = PathFile::read(&paths.join(PathFile::file_name(&scene, &row.method))).unwrap();
        assert_eq!(oracle::check(&scene, &path).ok(), row.min_clearance_m);
    }
}

#[test]
fn what_is_no_margin_is_refused() {
    for command in ["n3p-plan", "n3p-eval"] {
        for value in ["-0.1", "NaN", "-inf", "inf", "1.001", "5cm", ""] {
            Command::cargo_bin(command)
                .expect("a binary of this crate")
                .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")))
                .args(["--margin", value])
                .args((command == "n3p-plan").then_some(["--scene", "none.json"]).iter().flatten())
                .assert()
                .code(2)
                .stderr(contains("--margin").and(contains(format!("'{value}'"))));
        }
    }
}
