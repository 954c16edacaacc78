//! The commands' contract: exit codes, and errors that say file, field and remedy.

#![cfg(feature = "lab")]

use std::path::Path;

use assert_cmd::Command;
use n3p::lab::evaluation::{oracle, rows};
use n3p::output::PathFile;
use n3p::world::{Level, ParkingType, Scene};
use predicates::prelude::*;
use predicates::str::contains;

fn command(name: &str, dir: &Path) -> Command {
    let mut command = Command::cargo_bin(name).expect("a binary of this crate");
    command.current_dir(dir);
    command
}

/// A reverse bay between two cars, without obstacles elsewhere.
const SCENE: &str = r#"{"name": "bay", "source": "",
 "vehicle": {"length": 4.97, "width": 1.86, "wheelbase": 2.83, "rear_overhang": 1.1,
             "max_steer": 0.609},
 "start": [-6, 5.5, 0], "goal": [0, -1.4, 1.5707963267948966], "parking_type": "reverse",
 "obstacles": [[[-4, -2.7], [-1.5, -2.7], [-1.5, 2.7], [-4, 2.7]],
               [[1.5, -2.7], [4, -2.7], [4, 2.7], [1.5, 2.7]]],
 "bounds": null}"#;

/// Runs `n3p-plan --scene` on `text` and expects exit code 2 with all of `parts` on stderr.
fn refused(text: &str, parts: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("scene.json"), text).unwrap();
    let assert = command("n3p-plan", dir.path())
        .args(["--scene", "scene.json", "--method", "ha-rs"])
        .assert()
        .code(2)
        .stderr(contains("scene.json"));
    let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
    for part in parts {
        assert!(stderr.contains(part), "\"{part}\" not in: {stderr}");
    }
    assert!(stderr.trim().lines().count() <= 2, "more than two lines: {stderr}");
}

#[test]
fn bad_scenes_are_refused_with_file_field_and_remedy() {
    refused("", &["empty"]);
    refused(&SCENE[..SCENE.len() / 2], &["line"]);
    refused(&SCENE.replace("[-6, 5.5, 0]", "[NaN, 5.5, 0]"), &["line"]);
    refused(&SCENE.replace("[-6, 5.5, 0]", "[1e999, 5.5, 0]"), &[]);
    refused(
        &SCENE.replace("[-6, 5.5, 0]", "[-2, 0, 0]"),
        &["start", "touches an obstacle", "m into obstacles[0]"],
    );
    refused(&SCENE.replace("[0, -1.4, 1.57", "[2, -1.4, 1.57"), &["goal", "touches an obstacle"]);
    refused(&SCENE.replace("\"reverse\"", "\"sideways\""), &["sideways", "parallel"]);
    // Each of these once ended a run late or never, or wrote onto the terminal.
    refused(&SCENE.replace("[-6, 5.5, 0]", "[-9e6, 5.5, 0]"), &["start", "from the goal"]);
    refused(&SCENE.replace("\"bay\"", "\"\\u001b[31m\""), &["name", "control character"]);
    let long = format!("\"{}\"", "x".repeat(300));
    refused(&SCENE.replace("\"bay\"", &long), &["name", "300 bytes", "at most 200"]);
    refused(&SCENE.replace("\"width\": 1.86", "\"width\": -1"), &["width", "between"]);
}

#[test]
fn a_missing_scene_and_a_wrong_method_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    command("n3p-plan", dir.path())
        .args(["--scene", "none.json"])
        .assert()
        .code(2)
        .stderr(contains("none.json"));
    std::fs::write(dir.path().join("s.json"), SCENE).unwrap();
    command("n3p-plan", dir.path())
        .args(["--scene", "s.json", "--method", "a-star"])
        .assert()
        .code(2)
        .stderr(contains("a-star").and(contains("ha-rs")).and(contains("knn-n3p")));
    command("n3p-plan", dir.path())
        .args(["--scene", "s.json", "--method", "rl-simple"])
        .assert()
        .code(2)
        .stderr(contains("rl-simple.safetensors").and(contains("n3p-train rl --env simple")));
    command("n3p-plan", dir.path())
        .args(["--scene", "s.json", "--method", "n3p", "--model", "mine.bin"])
        .assert()
        .code(2)
        .stderr(contains("mine.bin").and(contains("n3p-train")));
}

#[test]
fn a_plan_is_printed_written_and_drawn() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.json"), SCENE).unwrap();
    command("n3p-plan", dir.path())
        .args(["--scene", "s.json", "--out", "path.json", "--svg", "picture.svg"])
        .assert()
        .success()
        .stdout(contains("path by n3p").and(contains("direction changes")));
    let scene = Scene::read(&dir.path().join("s.json")).unwrap();
    let path = PathFile::read(&dir.path().join("path.json")).unwrap();
    assert!(oracle::check(&scene, &path).unwrap() > 0.0);
    let picture = std::fs::read_to_string(dir.path().join("picture.svg")).unwrap();
    assert!(picture.contains("<svg") && picture.contains("n3p"));
}

/// A program that is copied anywhere plans with what is compiled in; files of the same names come
/// first, and one that cannot be used is told.
#[test]
fn models_are_listed_with_where_they_come_from() {
    let dir = tempfile::tempdir().unwrap();
    let list = || command("n3p-plan", dir.path()).arg("--models").assert();
    list()
        .success()
        .stdout(contains("knn.bin").and(contains("compiled in")).and(contains("4.97 x 1.86 m")));
    std::fs::create_dir(dir.path().join("models")).unwrap();
    let own = dir.path().join("models/knn.bin");
    std::fs::copy("models/knn-tpcap.bin", &own).unwrap();
    let listed = list().success();
    let text = String::from_utf8_lossy(&listed.get_output().stdout).into_owned();
    let line = text.lines().find(|l| l.starts_with("models/knn.bin")).unwrap();
    assert!(line.contains("file") && line.contains("4.69 x 1.942 m"), "{text}");
    std::fs::write(&own, "no model").unwrap();
    list().code(2).stderr(contains("models/knn.bin: not a model")).stdout(contains("fleet"));
}

#[test]
fn json_is_machine_readable_and_no_obstacles_are_fine() {
    let dir = tempfile::tempdir().unwrap();
    let begin = SCENE.find("\"obstacles\"").unwrap();
    let end = SCENE.find("\"bounds\"").unwrap();
    let empty = format!("{}\"obstacles\": [], {}", &SCENE[..begin], &SCENE[end..]);
    std::fs::write(dir.path().join("s.json"), empty).unwrap();
    let output = command("n3p-plan", dir.path())
        .args(["--scene", "s.json", "--method", "ha-rs", "--json"])
        .assert()
        .success();
    let json: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(json["row"]["ok"], true);
    assert_eq!(json["row"]["min_clearance_m"], serde_json::Value::Null);
    assert!(json["path"]["poses"].as_array().unwrap().len() > 10);
}

#[test]
fn no_path_is_exit_code_3_with_a_reason() {
    let dir = tempfile::tempdir().unwrap();
    let wall = "\"obstacles\": [[[-9, 3], [9, 3], [9, 3.2], [-9, 3.2]], \
                [[-9, -9], [-8, -9], [-8, 3.1], [-9, 3.1]], \
                [[8, -9], [9, -9], [9, 3.1], [8, 3.1]], \
                [[-9, -9], [9, -9], [9, -8], [-9, -8]], ";
    let scene = SCENE.replace("\"obstacles\": [", wall);
    std::fs::write(dir.path().join("s.json"), scene).unwrap();
    command("n3p-plan", dir.path())
        .args(["--scene", "s.json", "--method", "ha-rs"])
        .assert()
        .code(3)
        .stdout(contains("no path by ha-rs"));
}

#[test]
fn a_method_for_other_spots_says_so_and_does_not_fail() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.json"), SCENE).unwrap();
    command("n3p-plan", dir.path())
        .args(["--scene", "s.json", "--method", "sha"])
        .assert()
        .code(3)
        .stdout(contains("no path by sha: not applicable"));
    command("n3p-eval", dir.path())
        .args(["--count", "1", "--methods", "ha-rs,sha", "--out", "out"])
        .assert()
        .success()
        .stdout(
            contains("No failures in 15 rows").and(contains("sha is not applicable to 9 scenes")),
        );
    let rows = rows::read_csv(&dir.path().join("out/rows.csv")).unwrap();
    assert_eq!(rows.len(), 24, "rows are kept");
    let report = std::fs::read_to_string(dir.path().join("out/report.md")).unwrap();
    assert!(report.contains("`sha`: 3 of 3 solved, not applicable to 9 others"), "{report}");
    let lines = report.lines().filter(|l| l.contains("| sha | this run |"));
    assert!(lines.into_iter().all(|l| l.starts_with("| parallel |")), "{report}");
}

#[test]
fn eval_refuses_bad_arguments() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("file"), "").unwrap();
    std::fs::write(dir.path().join("text.bin"), "no model").unwrap();
    std::fs::create_dir(dir.path().join("empty")).unwrap();
    for (arguments, parts) in [
        (&["--type", "sideways"][..], &["sideways", "parallel"][..]),
        (&["--level", "hard"], &["hard", "extreme"]),
        (&["--world", "moon"], &["moon", "lots"]),
        (&["--world", "lots", "--level", "easy"], &["--level", "home"]),
        (&["--world", "lots", "--scenes", "empty"], &["--world", "--scenes"]),
        (&["--methods", "ha-rs,nope"], &["nope", "n3p"]),
        (&["--methods", "knn-n3p", "--model", "none.bin"], &["none.bin", "n3p-train"]),
        (&["--methods", "rl-eval"], &["rl-eval.safetensors", "n3p-train rl --env eval"]),
        (&["--methods", "policy"], &["--policy FILE.onnx", "docs/policies.md"]),
        (&["--policy", "none.onnx"], &["none.onnx", "no such file"]),
        (&["--policy", "no-such-program --fast"], &["no-such-program"]),
        (
            &["--policy", "file", "--policy-limit", "-1"],
            &["--policy-limit", "between 0.001 and 86400 seconds"],
        ),
        (&["--policy-limit", "2"], &["--policy"]),
        (&["--model", "none.bin"], &["none.bin", "n3p-train"]),
        (&["--model", "file"], &["file", "empty"]),
        (&["--model", "text.bin"], &["text.bin"]),
        (&["--count", "0"], &["--count"]),
        (&["--scenes", "nowhere"], &["nowhere"]),
        (&["--scenes", "empty"], &["empty", "holds no scene"]),
        (&["--count", "1", "--out", "file/below"], &["file/below", "choose"]),
    ] {
        let assert = command("n3p-eval", dir.path()).args(arguments).assert().code(2);
        let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        for part in parts {
            assert!(stderr.contains(part), "{arguments:?}: \"{part}\" not in: {stderr}");
        }
    }
}

/// One bad file among many used to end the evaluation before it began.
#[test]
fn files_that_cannot_be_used_are_named_and_the_others_evaluated() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = dir.path().join("scenes");
    std::fs::create_dir(&scenes).unwrap();
    let blocked = SCENE.replace("\"bay\"", "\"blocked\"").replace("[-6, 5.5, 0]", "[-2, 0, 0]");
    let narrow = SCENE.replace("\"width\": 1.86", "\"width\": -1");
    let parallel = SCENE.replace("\"reverse\"", "null");
    let files = [
        ("a.json", SCENE),
        ("b.json", &blocked),
        ("c.json", &SCENE[..200]),
        ("d.json", &narrow),
        ("e.json", &parallel),
    ];
    for (name, text) in files {
        std::fs::write(scenes.join(name), text).unwrap();
    }
    let eval = |arguments: &[&str]| {
        let mut eval = command("n3p-eval", dir.path());
        eval.args(["--methods", "ha-rs", "--scenes", "scenes"]).args(arguments).assert().code(2)
    };
    let assert = eval(&["--out", "out", "--paths", "paths"])
        .stdout(contains("No failures in 2 rows"))
        .stderr(contains("error: 3 of 5 files could not be used"));
    let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
    for parts in [["b.json", "start: the footprint"], ["c.json", "cut short"], ["d.json", "width"]]
    {
        let lines = || stderr.lines().filter(|l| l.contains(parts[0]));
        assert!(lines().count() == 1 && lines().all(|l| l.contains(parts[1])), "{stderr}");
    }
    assert_eq!(stderr.lines().count(), 4, "{stderr}");
    let rows = rows::read_csv(&dir.path().join("out/rows.csv")).unwrap();
    let names: Vec<_> = rows.iter().map(|r| r.scene.as_str()).collect();
    assert_eq!(names, ["bay", "e"]);
    assert!(rows.iter().all(|r| r.ok && r.cost_over_best == Some(1.0)), "{rows:?}");
    assert_eq!(std::fs::read_dir(dir.path().join("paths")).unwrap().count(), 2);
    let report = std::fs::read_to_string(dir.path().join("out/report.md")).unwrap();
    assert!(report.contains("2 from scenes; 3 of 5 files could not be used"), "{report}");
    let json = eval(&["--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.get_output().stdout).unwrap();
    assert_eq!(json["rows"].as_array().unwrap().len(), 2);
    assert_eq!(json["quality"]["all"][0]["paths"]["worst_cost"], 1.0);

    // Where none is left, nothing is begun.
    for name in ["a.json", "e.json"] {
        std::fs::remove_file(scenes.join(name)).unwrap();
    }
    eval(&["--out", "none"])
        .stderr(contains("3 of 3 files could not be used").and(contains("blocked")));
    assert!(!dir.path().join("none").exists());
}

#[test]
fn rows_do_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    let run = |threads: &str| {
        command("n3p-eval", dir.path())
            .args(["--count", "2", "--seed", "5", "--methods", "ha-rs", "--threads", threads])
            .args(["--out", threads, "--paths", "paths"])
            .assert()
            .success()
            .stdout(contains("No failures in 24 rows"));
        let rows = rows::read_csv(&dir.path().join(threads).join("rows.csv")).unwrap();
        rows.iter().map(n3p::episode::Row::untimed).collect::<Vec<_>>()
    };
    let rows = run("1");
    assert_eq!(rows, run("2"));
    assert_eq!(rows.len(), ParkingType::ALL.len() * Level::ALL.len() * 2);
    assert!(rows.iter().all(|r| r.ok && r.checked == "ok"));
    let paths = std::fs::read_dir(dir.path().join("paths")).unwrap().count();
    assert_eq!(paths, rows.len());
    let report = std::fs::read_to_string(dir.path().join("1/report.md")).unwrap();
    assert!(report.contains("seed 5") && report.contains("HA* with RS"));
}

#[test]
fn eval_prints_json() {
    let dir = tempfile::tempdir().unwrap();
    let output = command("n3p-eval", dir.path())
        .args(["--count", "1", "--type", "parallel", "--level", "easy", "--json"])
        .assert()
        .success();
    let json: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(json["rows"][0]["type"], "parallel");
    let summaries = json["groups"][0]["summaries"].as_array().unwrap();
    let methods: Vec<_> = summaries.iter().map(|s| s["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["ha", "ha-rs", "ha-hold", "mhha", "sha"], "all that need no model");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "nothing without --out");
}

#[test]
fn a_wrong_experiment_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let quick = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/quick.toml");
    let text = std::fs::read_to_string(quick).unwrap();
    for (old, new, parts) in [
        ("epochs", "epoks", &["x.toml", "line", "epoks"][..]),
        ("version = 1", "version = 9", &["version is 9"]),
        ("\"ha-rs\"", "\"ha-xx\"", &["ha-xx", "ha-rs"]),
        ("samples_per_cell = 25", "samples_per_cell = 0", &["collect", "samples_per_cell is 0"]),
        ("samples_per_cell = 25", "seed = 4", &["collect.seed", "at the top"]),
    ] {
        assert!(text.contains(old), "{old}");
        std::fs::write(dir.path().join("x.toml"), text.replacen(old, new, 1)).unwrap();
        let assert = command("n3p-experiment", dir.path()).args(["run", "x.toml"]).assert().code(2);
        let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        for part in parts {
            assert!(stderr.contains(part), "\"{part}\" not in: {stderr}");
        }
    }
    command("n3p-experiment", dir.path())
        .args(["run", "none.toml"])
        .assert()
        .code(2)
        .stderr(contains("none.toml"));
    std::fs::write(dir.path().join("x.toml"), text).unwrap();
    command("n3p-experiment", dir.path())
        .args(["reproduce", "x.toml"])
        .assert()
        .code(2)
        .stderr(contains("n3p-experiment run x.toml"));
    command("n3p-experiment", dir.path())
        .args(["list", "."])
        .assert()
        .success()
        .stdout(contains("x.toml: every stage"));
}

/// Planning used to come first, the message about the file after it and without a remedy.
#[test]
fn files_that_cannot_be_written_are_refused_before_planning() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.json"), SCENE).unwrap();
    for flag in ["--out", "--svg"] {
        for (path, told) in [("s.json/x", "s.json/x: cannot be written"), (".", "a folder")] {
            command("n3p-plan", dir.path())
                .args(["--scene", "s.json", "--method", "ha-rs", flag, path])
                .assert()
                .code(2)
                .stdout("")
                .stderr(contains(told).and(contains("choose another")));
        }
    }
}

/// Both used to panic.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_pipe_is_no_error_and_a_full_disk_a_plain_one() {
    use std::process::{Command, Stdio};
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.json"), SCENE).unwrap();
    let plan = |stdout: Stdio| {
        Command::new(assert_cmd::cargo::cargo_bin("n3p-plan"))
            .current_dir(dir.path())
            .args(["--scene", "s.json", "--method", "ha-rs", "--json"])
            .stdout(stdout)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let mut closed = plan(Stdio::piped());
    drop(closed.stdout.take());
    let output = closed.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), vec![]));

    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output = plan(full.into()).wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr, "error: standard output: the disk is full\n");
}

#[test]
fn wrong_arguments_are_told_in_two_lines() {
    let dir = tempfile::tempdir().unwrap();
    for (program, args, told) in [
        ("n3p-plan", &[][..], "--scene <FILE>"),
        ("n3p-eval", &["--type", "diagonal"], "forward, reverse, parallel"),
        ("n3p-eval", &["--seed", "-1"], "unexpected argument '-1'"),
        ("n3p-eval", &["--count", "1000000000"], "1..=100000"),
        ("n3p-collect", &["--threads", "99999"], "1024"),
        ("n3p-eval", &["--methods", "ha-rs,ha-rs"], "ha-rs twice"),
    ] {
        let assert = command(program, dir.path()).args(args).assert().code(2).stdout("");
        let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        assert!(stderr.contains(told), "\"{told}\" not in: {stderr}");
        assert!(stderr.trim().lines().count() <= 2, "more than two lines: {stderr}");
    }
}

/// Every worker starts the policy's program for itself. Here the files that one process may open
/// do not suffice for all of them, though they did for the checks before.
#[test]
fn a_policy_that_starts_for_some_workers_only_is_told_and_is_no_bug() {
    let dir = tempfile::tempdir().unwrap();
    let program = assert_cmd::cargo::cargo_bin("n3p-eval");
    let few_files = format!("ulimit -n 48; exec '{}' \"$@\"", program.display());
    let assert = Command::new("sh")
        .current_dir(dir.path())
        .args(["-c", &few_files, "n3p-eval", "--policy", "sh -c 'cat >/dev/null'"])
        .args(["--methods", "policy", "--count", "20", "--threads", "64"])
        .assert()
        .code(2)
        .stdout("");
    let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
    assert!(stderr.contains("Too many open files"), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

/// Planned as if nothing was wrong, and nobody knows why the path is so long.
#[test]
fn headings_that_look_like_degrees_are_warned_of_once() {
    let dir = tempfile::tempdir().unwrap();
    let plan = |text: &str| {
        std::fs::write(dir.path().join("s.json"), text).unwrap();
        let assert = command("n3p-plan", dir.path())
            .args(["--scene", "s.json", "--method", "ha-rs"])
            .args(["--max-expansions", "100"])
            .assert();
        String::from_utf8_lossy(&assert.get_output().stderr).into_owned()
    };
    for (heading, told) in [
        ("90", "start is 90;"),
        ("-45", "start is -45;"),
        ("180.0", "start is 180;"),
        ("22.5", "start is 22.5;"),
    ] {
        let stderr = plan(&SCENE.replace("[-6, 5.5, 0]", &format!("[-6, 9.5, {heading}]")));
        assert!(stderr.contains("WARN") && stderr.contains(told), "{heading}: {stderr}");
        assert!(stderr.contains("s.json") && stderr.contains("radians"), "{heading}: {stderr}");
        assert_eq!(stderr.matches("WARN").count(), 1, "{stderr}");
    }
    let both = SCENE.replace("[-6, 5.5, 0]", "[-6, 9.5, 90]").replace("1.5707963267948966", "360");
    assert!(plan(&both).contains("start is 90, that of goal is 360;"), "{}", plan(&both));
    // Radians: none, a quarter, a whole turn and a half, one written with few digits.
    for heading in ["0", "1.5707963267948966", "3", "-6", "9.42477796076938", "6.28"] {
        let stderr = plan(&SCENE.replace("[-6, 5.5, 0]", &format!("[-6, 9.5, {heading}]")));
        assert!(!stderr.contains("WARN"), "{heading}: {stderr}");
    }
    refused(
        &SCENE.replace("\"max_steer\": 0.609", "\"max_steer\": 35"),
        &["vehicle.max_steer is 35", "between 0.01 and 1.5 radians", "degrees"],
    );
}
