//! A collection that is killed at any moment and resumed ends with the same bytes.

#![cfg(feature = "lab")]

mod fixtures;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use assert_cmd::cargo::cargo_bin;
use fixtures::{assert_same_files, collect, config, files, sample};
use n3p::lab::dataset::collect::collect_with;
use n3p::lab::dataset::{CollectConfig, CollectOptions, Dataset, Part};
use n3p::rng::{Stream, rng};
use n3p::world::ParkingType;
use n3p::world::ParkingType::{Forward, Reverse};
use rand::RngExt;

const RESUME: CollectOptions = CollectOptions { resume: true, part: Part::ALL };

/// Collects with a solver that panics at its `last`-th sample; whether it came that far.
fn collect_until(config: &CollectConfig, folder: &Path, last: u32) -> bool {
    let solved = AtomicU32::new(0);
    let bar = indicatif::ProgressBar::hidden();
    let make = || {
        |kind: ParkingType, cell: u32, index: u32| {
            if solved.fetch_add(1, Ordering::Relaxed) >= last {
                // A panic that prints nothing.
                resume_unwind(Box::new("aborted on purpose"));
            }
            sample(config, kind, cell, index)
        }
    };
    let kinds = [Forward, Reverse];
    catch_unwind(AssertUnwindSafe(|| {
        collect_with(config, folder, &kinds, RESUME, &bar, make).unwrap();
    }))
    .is_err()
}

#[test]
fn aborted_runs_lose_only_the_shard_at_hand() {
    let config = config();
    let whole = tempfile::tempdir().unwrap();
    collect(&config, whole.path(), &[Forward, Reverse], RESUME, 2).unwrap();
    let folder = tempfile::tempdir().unwrap();
    // A shard has 20 samples or fewer, so each run finishes one at least.
    let runs = (0..).take_while(|_| collect_until(&config, folder.path(), 25)).count();
    assert!((1..=5).contains(&runs), "{runs} aborted runs");
    assert_same_files(whole.path(), folder.path());
}

#[test]
fn every_state_between_two_renames_is_mended() {
    let config = config();
    let whole = tempfile::tempdir().unwrap();
    collect(&config, whole.path(), &[Reverse], RESUME, 1).unwrap();
    let all = files(whole.path());
    let (shard, manifest) = ("reverse-0002.parquet", "reverse.manifest.json");
    let half = |name: &str| all[name][..all[name].len() / 2].to_vec();
    type State<'a> = (&'a str, &'a [(&'a str, Vec<u8>)]);
    let states: [State; 7] = [
        ("metadata in the making", &[("metadata.json.77.tmp", half("metadata.json"))]),
        (
            "a card in the making",
            &[
                ("metadata.json", all["metadata.json"].clone()),
                ("card.md.77.tmp", b"# Data".to_vec()),
            ],
        ),
        ("metadata alone", &[("metadata.json", all["metadata.json"].clone())]),
        (
            "a shard in the making",
            &[
                ("metadata.json", all["metadata.json"].clone()),
                ("reverse-0002.parquet.77.tmp", half(shard)),
            ],
        ),
        (
            "a shard without record",
            &[
                ("metadata.json", all["metadata.json"].clone()),
                (shard, all[shard].clone()),
                ("reverse-0002.json.77.tmp", b"{".to_vec()),
            ],
        ),
        (
            "a record without shard",
            &[
                ("metadata.json", all["metadata.json"].clone()),
                ("reverse-0002.json", b"{\"file\": 3}".to_vec()),
            ],
        ),
        (
            "a manifest in the making, and one without shards",
            &[
                ("metadata.json", all["metadata.json"].clone()),
                (manifest, all[manifest].clone()),
                ("reverse.manifest.json.77.tmp", half(manifest)),
                ("reverse-0000.json", b"".to_vec()),
            ],
        ),
    ];
    for (state, left) in states {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in left {
            fs::write(folder.path().join(name), bytes).unwrap();
        }
        let report = collect(&config, folder.path(), &[Reverse], RESUME, 2);
        assert_eq!(report.expect(state)[0].missing_shards, 0, "{state}");
        assert_same_files(whole.path(), folder.path());
    }
}

/// Settings small enough to collect in about a second, and their file.
fn tiny_config(folder: &Path) -> std::path::PathBuf {
    let config =
        CollectConfig { samples_per_cell: 10, cells_per_shard: 1, max_expansions: 300, ..config() };
    let path = folder.join("tiny.toml");
    fs::write(&path, toml::to_string(&config).unwrap()).unwrap();
    path
}

fn n3p_collect(config: &Path, out: &Path, threads: u32) -> Command {
    let mut command = Command::new(cargo_bin("n3p-collect"));
    command.args(["--type", "reverse", "--config"]).arg(config).arg("--out").arg(out);
    command.args(["--threads", &threads.to_string()]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn finish(mut command: Command) -> (Option<i32>, String) {
    let output = command.output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8(text).unwrap())
}

#[test]
fn killed_processes_resume_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let config = tiny_config(folder.path());
    let whole = folder.path().join("whole");
    let begin = Instant::now();
    let (code, text) = finish(n3p_collect(&config, &whole, 1));
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("reverse: 120 rows (120 new)"), "{text}");
    let duration = begin.elapsed();
    Dataset::read(&whole, Some(Reverse)).unwrap();

    let seed = 1;
    let mut rng = rng(seed, Stream::Bootstrap, 0);
    let killed = folder.path().join("killed");
    for run in 0..6 {
        let mut command = n3p_collect(&config, &killed, 1 + run % 2);
        let mut child = command.arg("--resume").spawn().unwrap();
        let wait = duration.mul_f64(rng.random_range(0.02..0.5));
        std::thread::sleep(wait.min(Duration::from_secs(20)));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let mut last = n3p_collect(&config, &killed, 2);
    last.arg("--resume");
    let (code, text) = finish(last);
    assert_eq!(code, Some(0), "seed {seed}: {text}");
    assert_same_files(&whole, &killed);

    let (code, text) = finish(n3p_collect(&config, &whole, 1));
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("--resume"), "{text}");
}

#[test]
fn bad_input_is_exit_code_2_and_says_where() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("bad.toml");
    fs::write(&config, "[grid]\nbakc = 3.0\n").unwrap();
    let (code, text) = finish(n3p_collect(&config, &folder.path().join("out"), 1));
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("bad.toml: line 2") && text.contains("bakc"), "{text}");

    fs::write(&config, "seed = 1\n").unwrap();
    let (code, text) = finish(n3p_collect(&config, &config.join("out"), 1));
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("bad.toml/out") && text.contains("cannot be written"), "{text}");

    for bad in [["--shard", "3/2"], ["--type", "sideways"], ["--threads", "many"]] {
        let mut command = Command::new(cargo_bin("n3p-collect"));
        command.args(bad);
        let (code, text) = finish(command);
        assert_eq!(code, Some(2), "{text}");
        assert!(text.contains(bad[1]), "{text}");
    }
}
