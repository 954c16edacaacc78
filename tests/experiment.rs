//! A tiny experiment from start to end: run, go on after an interruption, reproduce.

#![cfg(feature = "lab")]

use std::path::Path;

use assert_cmd::Command;
use n3p::episode::Row;
use n3p::lab::evaluation::rows::read_csv;
use predicates::prelude::*;
use predicates::str::contains;

const TINY: &str = r#"
version = 1
name = "tiny"
description = "one type, four cells"
seed = 3

[collect]
samples_per_cell = 20
max_expansions = 5000

[collect.grid]
lane_width = { min = 5.0, max = 6.0, step = 1.0 }
bay_spot_width = { min = 2.4, max = 3.4, step = 1.0 }
parallel_spot_width = { min = 6.5, max = 7.5, step = 1.0 }
dead_end = { min = 6.0, max = 8.0, step = 2.0 }
back = 10.0
bay_depth = 5.5
parallel_depth = 2.4

[train.knn]
worlds = 20

[train.mlp]
epochs = 2
validation_share = 0.25

[learning_curve]
methods = ["knn-n3p", "n3p"]
count = 2
seed = 12
parts = [{ samples_per_cell = 5 }, { lane_width = 2, samples_per_cell = 10 }]

[evaluate]
methods = ["ha-rs", "mlp-n3p", "knn-n3p", "n3p"]
types = ["reverse"]
levels = ["easy", "complex"]
count = 3
seed = 11
"#;

fn experiment(dir: &Path, arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("n3p-experiment").unwrap();
    command.current_dir(dir).args(arguments).assert()
}

fn untimed(file: &Path) -> Vec<Row> {
    read_csv(file).unwrap().iter().map(Row::untimed).collect()
}

#[test]
fn runs_goes_on_and_reproduces() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("tiny.toml"), TINY).unwrap();
    experiment(dir.path(), &["run", "tiny.toml"]).success().stdout(contains("rows"));
    let results = dir.path().join("results/tiny");
    let files = ["config.toml", "run.json", "rows.parquet", "report.md", "report.html"];
    let models = ["models/knn.bin", "models/knn.card.md", "models/mlp-reverse.card.md"];
    for file in files.into_iter().chain(models) {
        assert!(results.join(file).exists(), "{file}");
    }
    let report = std::fs::read_to_string(results.join("report.md")).unwrap();
    let curve = |steps, per_cell| format!("| reverse | knn-n3p | {steps} / 1 / 2 | {per_cell} |");
    assert!(report.contains(&curve(1, 5)) && report.contains(&curve(2, 10)), "{report}");
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("id=\"plot-curve\"") && page.contains("5 in each cell"));
    let traces = std::fs::read_to_string(results.join("traces.jsonl")).unwrap();
    assert_eq!(traces.lines().count(), 2 * 3 * 4);
    let rows_csv = results.join("rows.csv");
    let rows = untimed(&rows_csv);
    assert_eq!(rows.len(), 2 * 3 * 4);
    assert!(rows.iter().all(|r| r.checked.is_empty() || r.checked == "ok"));

    // A second run has nothing to do.
    let before = std::fs::read(&rows_csv).unwrap();
    experiment(dir.path(), &["run", "tiny.toml"])
        .success()
        .stderr(contains("train-knn: finished before"));
    assert_eq!(std::fs::read(&rows_csv).unwrap(), before);

    // As if killed in the middle of the evaluation: it ends with the same rows.
    let half: Vec<u8> = before[..before.len() / 2].to_vec();
    std::fs::write(&rows_csv, &half).unwrap();
    let stage = results.join("stages/evaluate.json");
    let record = std::fs::read_to_string(&stage).unwrap();
    std::fs::write(&stage, record.replace("true", "false")).unwrap();
    std::fs::remove_file(results.join("report.html")).unwrap();
    experiment(dir.path(), &["run", "tiny.toml"]).success();
    assert_eq!(untimed(&rows_csv), rows);
    // The paths of all rows, too, so that the report is complete.
    assert_eq!(std::fs::read_to_string(results.join("traces.jsonl")).unwrap(), traces);
    assert!(results.join("report.html").exists());
    let kept = half.iter().rposition(|b| *b == b'\n').unwrap();
    assert_eq!(std::fs::read(&rows_csv).unwrap()[..kept], half[..kept], "rows done are kept");

    experiment(dir.path(), &["reproduce", "tiny.toml"]).success().stdout(contains("24 rows agree"));
    let models = ["reproduce", "tiny.toml", "--models", "results/tiny/models", "--out", "again"];
    experiment(dir.path(), &models).success().stdout(contains("24 rows agree"));
    assert!(!dir.path().join("again/dataset").exists(), "nothing is collected");
    let data = ["reproduce", "tiny.toml", "--data", "results/tiny/dataset", "--out", "anew"];
    experiment(dir.path(), &data).success().stdout(contains("24 rows agree"));
    assert!(!dir.path().join("anew/dataset").exists());
    let model =
        |folder: &str| std::fs::read(dir.path().join(folder).join("models/knn.bin")).unwrap();
    assert!(model("anew") == model("results/tiny"), "the same data, the same model");

    let other = TINY.replace("samples_per_cell = 20", "samples_per_cell = 21");
    std::fs::write(dir.path().join("other.toml"), other).unwrap();
    for (arguments, told) in [
        (["other.toml", "--data", "results/tiny/dataset"], "samples_per_cell is 20, but the"),
        (["tiny.toml", "--data", "nowhere"], "--data: nowhere: no data set here"),
        (["tiny.toml", "--models", "nowhere"], "--models: model nowhere/knn.bin: no such file"),
    ] {
        let arguments = [&["run", "--out", "refused"][..], &arguments[..]].concat();
        experiment(dir.path(), &arguments).code(2).stderr(contains(told));
        assert!(!dir.path().join("refused").exists(), "nothing is written");
    }
    // What is refused leaves the results alone, and they are not compared with themselves.
    let before = std::fs::read(&rows_csv).unwrap();
    experiment(dir.path(), &["run", "tiny.toml", "--models", "nowhere"]).code(2);
    experiment(dir.path(), &["reproduce", "tiny.toml", "--out", "results/tiny"]).code(2);
    assert_eq!(std::fs::read(&rows_csv).unwrap(), before);

    // Another curve is another report; what is gone is made again.
    std::fs::remove_file(results.join("models/knn.bin")).unwrap();
    let changed = TINY.replace("{ samples_per_cell = 5 }", "{ samples_per_cell = 7 }");
    std::fs::write(dir.path().join("tiny.toml"), changed).unwrap();
    experiment(dir.path(), &["run", "tiny.toml"])
        .success()
        .stderr(contains("train-mlp-reverse: finished before"))
        .stderr(contains("train-knn: finished before").not());
    let report = std::fs::read_to_string(results.join("report.md")).unwrap();
    assert!(report.contains(&curve(1, 7)) && !report.contains(&curve(1, 5)), "{report}");
    assert_eq!(untimed(&rows_csv), rows);

    let other =
        std::fs::read_to_string(&rows_csv).unwrap().replacen("ha-rs,true", "ha-rs,false", 1);
    std::fs::write(&rows_csv, other).unwrap();
    experiment(dir.path(), &["reproduce", "tiny.toml"])
        .code(1)
        .stdout(contains("ok was false, is true"));
}

/// Every set of scenes has rows and a table of its own, and nothing is mixed.
#[test]
fn an_experiment_may_be_at_home_away_and_in_files() {
    let dir = tempfile::tempdir().unwrap();
    let real = dir.path().join("scenes/real");
    std::fs::create_dir_all(&real).unwrap();
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/reverse.json");
    std::fs::copy(fixture, real.join("reverse.json")).unwrap();
    let text = "version = 1\nname = \"sets\"\nseed = 3\n[evaluate]\nmethods = [\"ha-rs\", \"mhha\"]\n\
        worlds = [\"home\", \"lots\"]\nscenes = [\"../scenes/real\"]\nlevels = [\"easy\"]\n\
        count = 2\nseed = 11\n";
    std::fs::create_dir(dir.path().join("e")).unwrap();
    std::fs::write(dir.path().join("e/sets.toml"), text).unwrap();
    experiment(dir.path(), &["run", "e/sets.toml"]).success();
    let results = dir.path().join("e/results/sets");
    let rows = read_csv(&results.join("rows.csv")).unwrap();
    let of = |set: &str| rows.iter().filter(|r| r.set == set).count();
    assert_eq!((of("home"), of("lots"), of("real"), rows.len()), (12, 12, 2, 26));
    assert!(rows.iter().all(|r| r.level.is_some() == (r.set == "home")));
    let report = std::fs::read_to_string(results.join("report.md")).unwrap();
    let found: Vec<&str> = report.lines().filter(|l| l.contains(": T in ms, Δδ")).collect();
    let titles = ["## Level easy", "## Car parks (lots)", "## Scenes of real"];
    assert!(found.iter().zip(titles).all(|(line, title)| line.starts_with(title)), "{found:?}");
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(report.contains("12 generated (home and lots)") && report.contains("1 from files"));
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("Car parks (lots)") && page.contains("Scenes of real"));
    experiment(dir.path(), &["run", "e/sets.toml"]).success().stderr(contains("nothing to do"));
    experiment(dir.path(), &["reproduce", "e/sets.toml"]).success();
    // What a folder holds is a part of the settings.
    std::fs::write(real.join("broken.json"), "{").unwrap();
    experiment(dir.path(), &["run", "e/sets.toml"]).code(2).stderr(contains("broken.json"));
    std::fs::remove_file(real.join("broken.json")).unwrap();
    std::fs::copy(real.join("reverse.json"), real.join("twin.json")).unwrap();
    experiment(dir.path(), &["run", "e/sets.toml"]).success();
    assert_eq!(read_csv(&results.join("rows.csv")).unwrap().len(), 28);
}
