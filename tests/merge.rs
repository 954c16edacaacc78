//! Shards that were made apart are merged into what one process makes, and nothing else is.

#![cfg(feature = "lab")]

mod fixtures;

use std::fs;
use std::path::Path;

use fixtures::{assert_same_files, collect, config, files};
use n3p::lab::dataset::card::card;
use n3p::lab::dataset::{CollectConfig, CollectOptions, Dataset, Metadata, Summary, merge, shards};
use n3p::lab::shards::State;
use n3p::world::ParkingType::{self, Forward, Reverse};

const KINDS: [ParkingType; 2] = [Forward, Reverse];

fn collect_part(config: &CollectConfig, folder: &Path, part: &str) {
    let options = CollectOptions { resume: true, part: part.parse().unwrap() };
    collect(config, folder, &KINDS, options, 2).unwrap();
}

fn states(folder: &Path) -> Vec<State> {
    shards(&config(), folder, &KINDS).unwrap().shards.into_iter().map(|s| s.state).collect()
}

#[test]
fn parts_collected_in_folders_of_their_own_make_the_whole() {
    let [whole, merged] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    collect_part(&config(), whole.path(), "1/1");
    let missing = merged.path().join("not there yet");
    let all = shards(&config(), &missing, &KINDS).unwrap();
    assert!(!missing.exists() && all.parts == 3);
    assert!(all.shards.iter().all(|s| s.state == State::Missing));
    for part in 1..=all.parts {
        let error = merge(&config(), merged.path(), &KINDS).unwrap_err();
        assert!(error.is_bad_input() && error.to_string().contains("is missing"), "{error}");
        let own = tempfile::tempdir().unwrap();
        collect_part(&config(), own.path(), &format!("{part}/{}", all.parts));
        let mine: Vec<&str> =
            all.shards.iter().filter(|s| s.part == part).map(|s| s.file.as_str()).collect();
        assert_eq!(mine.len(), 2);
        for (name, bytes) in files(own.path()) {
            let is_its = |file: &&str| name.starts_with(file.trim_end_matches(".parquet"));
            assert!(name == "metadata.json" || mine.iter().any(is_its), "{name}");
            fs::write(merged.path().join(name), bytes).unwrap();
        }
    }
    assert!(states(merged.path()).iter().all(|s| *s == State::Finished));
    let reports = merge(&config(), merged.path(), &KINDS).unwrap();
    assert!(reports.iter().all(|r| (r.rows, r.collected_rows, r.missing_shards) == (48, 0, 0)));
    assert_same_files(whole.path(), merged.path());
    // Merged again, nothing changes.
    merge(&config(), merged.path(), &KINDS).unwrap();
    assert_same_files(whole.path(), merged.path());
}

#[test]
fn what_is_damaged_or_foreign_is_not_merged() {
    let folder = tempfile::tempdir().unwrap();
    collect_part(&config(), folder.path(), "1/1");
    fs::remove_file(folder.path().join("reverse.manifest.json")).unwrap();
    let reseeded = CollectConfig { seed: 77, ..config() };
    let other = tempfile::tempdir().unwrap();
    collect_part(&reseeded, other.path(), "1/3");
    collect_part(&config(), folder.path(), "3/3");
    let [shard, record] = ["reverse-0000.parquet", "reverse-0000.json"];
    let refused = |why: &str| {
        let before = files(folder.path());
        let error = merge(&config(), folder.path(), &KINDS).unwrap_err();
        let told = error.to_string();
        assert!(error.is_bad_input() && told.contains(shard) && told.contains(why), "{told}");
        assert_eq!(files(folder.path()), before);
    };
    // Only the manifest knew of them, and with their own records they are known again.
    refused("is missing");
    for name in [shard, record] {
        fs::copy(other.path().join(name), folder.path().join(name)).unwrap();
    }
    refused("is foreign: its metadata differs");
    assert!(matches!(states(folder.path())[3], State::Foreign(_)));
    fs::write(folder.path().join(shard), b"PAR1").unwrap();
    refused("is damaged: its bytes");
    assert!(matches!(states(folder.path())[3], State::Damaged(_)));

    let error = merge(&reseeded, folder.path(), &KINDS).unwrap_err().to_string();
    assert!(error.contains("another configuration: seed was"), "{error}");
}

#[test]
fn unfinished_work_of_another_build_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let metadata = Metadata { git_revision: "elsewhere".to_owned(), ..config().metadata() };
    let json = serde_json::to_string(&metadata).unwrap();
    fs::write(folder.path().join("metadata.json"), json).unwrap();
    let error = shards(&config(), folder.path(), &KINDS).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("another build"), "{error}");
}

#[test]
fn a_summary_says_of_shards_what_the_whole_says() {
    for name in ["datasets/small", "datasets/paper"] {
        let folder = Path::new(name);
        let set = Summary::read(folder, &ParkingType::SQUARE).unwrap();
        assert_eq!(card(&set), fs::read_to_string(folder.join("card.md")).unwrap());
    }
    let folder = Path::new("datasets/small");
    let all = Dataset::read(folder, None).unwrap();
    for kinds in [&[Reverse, Forward][..], &[Reverse], &ParkingType::SQUARE] {
        let set = Summary::read(folder, kinds).unwrap();
        assert_eq!(set.sha256, all.content_sha256(kinds));
        assert_eq!(set.kinds.len(), kinds.len());
        let solved: u64 = set.kinds.values().map(|tally| tally.solved()).sum();
        let expected = all.solved().filter(|s| kinds.contains(&s.cell.kind())).count();
        assert_eq!(solved, expected as u64);
    }
}
