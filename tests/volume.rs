//! Very many scenes, at a small scale: in any number of parts, killed or not, the records say the same.

#![cfg(feature = "lab")]

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use n3p::episode::Case;
use n3p::lab::volume::record::Outcome;
use n3p::lab::volume::{ShardRecord, VolumeConfig, draw::draw};
use n3p::world::Scene;
use predicates::prelude::*;
use predicates::str::contains;

const CONFIG: &str =
    "version = 1\nseed = 9\ncount = 27\nscenes_per_shard = 4\nmap_coordinates = 1e5\n";

fn volume(dir: &Path, arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("n3p-experiment").unwrap();
    command.current_dir(dir).args(["volume", "v.toml"]).args(arguments).assert()
}

fn results(folder: &Path) -> Vec<String> {
    let record = |shard| ShardRecord::read(folder, shard).unwrap().results;
    (0..7).map(|shard| serde_json::to_string(&record(shard)).unwrap()).collect()
}

#[test]
fn shards_make_the_same_records_in_any_number_of_runs() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("v.toml"), CONFIG).unwrap();
    volume(dir.path(), &["--out", "whole", "--threads", "2"])
        .success()
        .stdout(contains("| all | 27 |").and(contains("7 of 7 shards")));
    let whole = dir.path().join("whole");
    let expected = results(&whole);
    assert!(whole.join("volume.json").exists() && whole.join("volume.md").exists());

    volume(dir.path(), &["--out", "parts", "--shard", "2/2"]).success().stdout(contains("3 of 7"));
    let parts = dir.path().join("parts");
    assert!(!parts.join("volume.json").exists());
    volume(dir.path(), &["--out", "parts", "--shard", "1/2"]).success().stdout(contains("7 of 7"));
    assert_eq!(results(&parts), expected);

    // What is damaged or of another scene is made again; what is whole stays, with its times.
    let path = |shard| ShardRecord::path(&parts, shard);
    let kept = fs::read(path(4)).unwrap();
    let bytes = fs::read(path(1)).unwrap();
    fs::write(path(1), &bytes[..bytes.len() / 2]).unwrap();
    fs::copy(path(3), path(2)).unwrap();
    fs::remove_file(path(6)).unwrap();
    volume(dir.path(), &["--out", "parts"]).success().stdout(contains("7 of 7"));
    assert_eq!(results(&parts), expected);
    assert_eq!(fs::read(path(4)).unwrap(), kept);

    let merge = ["--out", "parts", "--merge"];
    volume(dir.path(), &merge).success().stdout(contains("7 of 7"));
    let intact = fs::read_to_string(path(5)).unwrap();
    let spoilt = [
        (None, "shard-000005.json is missing"),
        (Some(intact.replacen("\"scenes\": ", "\"scenes\": 1", 1)), "is damaged: it has not"),
        (Some(fs::read_to_string(path(3)).unwrap()), "is foreign: it is the record of shard 3"),
    ];
    for (text, why) in spoilt {
        fs::remove_file(path(5)).unwrap_or_default();
        text.map_or(Ok(()), |text| fs::write(path(5), text)).unwrap();
        volume(dir.path(), &merge).code(2).stderr(contains(why));
    }
    volume(dir.path(), &["--out", "parts", "--status"])
        .success()
        .stdout(contains(r#"{"part":6,"file":"shard-000005.json","state":"foreign","why":"#))
        .stdout(contains(r#"{"parts":7,"#));
    fs::write(path(5), intact).unwrap();
    assert_eq!(results(&parts), expected);

    volume(dir.path(), &["--out", "parts", "--set", "seed=10"])
        .code(2)
        .stderr(contains("records of another configuration"));
    volume(dir.path(), &["--out", "x", "--set", "worlds=[\"home\", \"home\"]"])
        .code(2)
        .stderr(contains("worlds names home twice"));
}

#[test]
fn scenes_and_paths_are_written_for_others_to_check() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("v.toml"), CONFIG).unwrap();
    let some = ["--out", "out", "--samples", "samples", "--sample-every", "3"];
    volume(dir.path(), &some).success();
    let config = VolumeConfig::read(&dir.path().join("v.toml"), &[]).unwrap();
    let (mut lines, mut failed) = (0, 0);
    for shard in 0..7 {
        let record = ShardRecord::read(&dir.path().join("out"), shard).unwrap();
        let no_path = record.results.failures.iter().filter(|f| f.what == Outcome::NoPath);
        failed += no_path.filter(|f| f.number % 3 == 0).count();
        let file = dir.path().join(format!("samples/shard-{shard:06}.jsonl"));
        for line in fs::read_to_string(file).unwrap().lines() {
            let sample: serde_json::Value = serde_json::from_str(line).unwrap();
            let number = sample["number"].as_u64().unwrap();
            let Case { scene, .. } = draw(&config, number);
            assert_eq!(number % 3, 0);
            assert_eq!(serde_json::from_value::<Scene>(sample["scene"].clone()).unwrap(), scene);
            lines += 1;
        }
    }
    assert_eq!(lines + failed, 9);
    volume(dir.path(), &["--write-scene", "7", "--out", "one"]).success();
    let written =
        Scene::read(&dir.path().join(format!("one/{}.json", draw(&config, 7).scene.name)));
    assert_eq!(written.unwrap(), draw(&config, 7).scene);
}
