//! Writing a data set and reading it back; what a damaged or foreign one is answered with.

#![cfg(feature = "lab")]

mod fixtures;

use std::fs;
use std::path::Path;

use fixtures::{assert_same_files, collect, config, sample};
use n3p::geometry::Pose;
use n3p::lab::dataset::collect::collect_with;
use n3p::lab::dataset::schema::FORMAT_VERSION;
use n3p::lab::dataset::{CollectConfig, CollectOptions, Dataset, DatasetError, Part, Status};
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use n3p::world::ParkingType;
use n3p::world::ParkingType::{Forward, Parallel, Reverse};
use rand::RngExt;

const FRESH: CollectOptions = CollectOptions { resume: false, part: Part::ALL };
const RESUME: CollectOptions = CollectOptions { resume: true, part: Part::ALL };

fn collected(kinds: &[ParkingType]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    collect(&config(), folder.path(), kinds, FRESH, 2).unwrap();
    folder
}

fn read_error(folder: &Path) -> String {
    Dataset::read(folder, Some(Reverse)).unwrap_err().to_string()
}

#[test]
fn rows_survive_the_round_trip() {
    let config = config();
    let folder = collected(&ParkingType::SQUARE);
    let data = Dataset::read(folder.path(), None).unwrap();
    assert_eq!(data.metadata, config.metadata());
    let mut expected = Vec::new();
    for kind in ParkingType::SQUARE {
        for cell in 0..12 {
            expected.extend((0..4).map(|i| sample(&config, kind, cell, i)));
        }
    }
    // Debug text, since NaN differs from itself.
    assert_eq!(format!("{:?}", data.samples), format!("{expected:?}"));
    assert_eq!(data.solved().count(), 36);

    let reverse = Dataset::read(folder.path(), Some(Reverse)).unwrap();
    assert!(reverse.samples.iter().all(|s| s.cell.kind() == Reverse));
    assert_eq!(reverse.samples.len(), 48);
    assert_eq!(reverse.content_sha256(&[Reverse]), data.content_sha256(&[Reverse]));
    assert_ne!(data.content_sha256(&ParkingType::SQUARE), data.content_sha256(&[Reverse]));
}

#[test]
fn bytes_do_not_depend_on_threads_or_order_of_types() {
    let folder = collected(&ParkingType::SQUARE);
    let other = tempfile::tempdir().unwrap();
    for kind in [Reverse, Forward, Parallel] {
        let reports = collect(&config(), other.path(), &[kind], FRESH, 1).unwrap();
        assert_eq!((reports[0].rows, reports[0].solved, reports[0].missing_shards), (48, 12, 0));
    }
    assert_same_files(folder.path(), other.path());
}

#[test]
fn parts_make_the_whole() {
    let whole = collected(&[Reverse]);
    let other = tempfile::tempdir().unwrap();
    for (part, missing) in [("2/3", 2), ("1/3", 1), ("3/3", 0)] {
        let options = CollectOptions { resume: false, part: part.parse().unwrap() };
        let report = &collect(&config(), other.path(), &[Reverse], options, 2).unwrap()[0];
        assert_eq!(report.missing_shards, missing, "{part}");
        let manifest = other.path().join("reverse.manifest.json").exists();
        assert_eq!(manifest, missing == 0, "{part}");
    }
    assert_same_files(whole.path(), other.path());
}

#[test]
fn an_unfinished_type_is_refused() {
    let folder = collected(&[Reverse]);
    let error = Dataset::read(folder.path(), Some(Parallel)).unwrap_err().to_string();
    assert!(error.contains("no parallel samples"), "{error}");
    let manifest = folder.path().join("reverse.manifest.json");
    fs::remove_file(manifest).unwrap();
    let error = read_error(folder.path());
    assert!(error.contains("incomplete") && error.contains("--resume"), "{error}");
    assert!(Dataset::read(folder.path(), None).is_err());
    let error = read_error(&folder.path().join("elsewhere"));
    assert!(error.contains("elsewhere") && error.contains("no data set"), "{error}");
}

#[test]
fn damaged_shards_are_named_and_mended() {
    let intact = collected(&[Reverse]);
    let folder = collected(&[Reverse]);
    let path = folder.path().join("reverse-0001.parquet");
    let bytes = fs::read(&path).unwrap();
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 3] ^= 4;
    for damaged in [&flipped[..], &bytes[..bytes.len() / 2], &[]] {
        fs::write(&path, damaged).unwrap();
        let error = read_error(folder.path());
        assert!(error.contains("reverse-0001.parquet"), "{error}");
        assert!(error.contains("does not match its checksum"), "{error}");
        let report = &collect(&config(), folder.path(), &[Reverse], RESUME, 2).unwrap()[0];
        assert_eq!(report.collected_rows, 20);
        assert_same_files(intact.path(), folder.path());
    }
    fs::remove_file(&path).unwrap();
    assert!(read_error(folder.path()).contains("reverse-0001.parquet"));
}

#[test]
fn damaged_bookkeeping_is_named() {
    let folder = collected(&[Reverse]);
    for name in ["reverse.manifest.json", "metadata.json"] {
        let path = folder.path().join(name);
        let bytes = fs::read(&path).unwrap();
        let number = String::from_utf8(bytes.clone()).unwrap().replace("48", "\"x\"");
        let number = number.replace("\"seed\": 1", "\"seed\": -1");
        for damaged in [&bytes[..bytes.len() / 2], b"[]", number.as_bytes()] {
            fs::write(&path, damaged).unwrap();
            let error = read_error(folder.path());
            assert!(error.contains(name), "{error}");
        }
        fs::write(&path, &bytes).unwrap();
    }
    // A manifest that leads out of the folder, or to fewer shards, is not followed.
    let path = folder.path().join("reverse.manifest.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("reverse-0001", "../reverse-0001")).unwrap();
    assert!(matches!(Dataset::read(folder.path(), Some(Reverse)), Err(DatasetError::Json { .. })));
}

#[test]
fn edited_metadata_is_noticed() {
    let folder = collected(&[Reverse]);
    let path = folder.path().join("metadata.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\"width\": 1.86", "\"width\": 1.5")).unwrap();
    let error = read_error(folder.path());
    assert!(error.contains("metadata differs"), "{error}");
    let version = format!("\"format_version\": {FORMAT_VERSION}");
    fs::write(&path, text.replace(&version, "\"format_version\": 99")).unwrap();
    let error = read_error(folder.path());
    let told = format!("format version 99; this program reads version {FORMAT_VERSION}");
    assert!(error.contains(&told), "{error}");
}

#[test]
fn another_vehicle_is_refused() {
    let folder = collected(&[Reverse]);
    let data = Dataset::read(folder.path(), None).unwrap();
    data.check_vehicle(&Vehicle::default()).unwrap();
    let other = Vehicle { width: 2.0, ..Vehicle::default() };
    let error = data.check_vehicle(&other).unwrap_err().to_string();
    assert!(error.contains("vehicle.width is 1.86, but 2.0"), "{error}");
}

#[test]
fn existing_data_is_never_mixed() {
    let folder = collected(&[Reverse]);
    let error = collect(&config(), folder.path(), &[Reverse], FRESH, 1).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("--resume"), "{error}");

    let other = CollectConfig { seed: 5, ..config() };
    for (kind, options) in [(Reverse, RESUME), (Forward, FRESH)] {
        let error = collect(&other, folder.path(), &[kind], options, 1).unwrap_err();
        assert!(error.is_bad_input(), "{error}");
        assert!(error.to_string().contains("seed was 1, now 5"), "{error}");
    }

    let foreign = tempfile::tempdir().unwrap();
    fs::write(foreign.path().join("notes.txt"), "mine").unwrap();
    let error = collect(&config(), foreign.path(), &[Reverse], RESUME, 1).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("other files"), "{error}");

    let file = foreign.path().join("notes.txt").join("data");
    let error = collect(&config(), &file, &[Reverse], FRESH, 1).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("notes.txt"), "{error}");
}

#[test]
fn a_complete_set_of_another_build_stays_as_it_is() {
    let folder = collected(&[Reverse]);
    let path = folder.path().join("metadata.json");
    let text = fs::read_to_string(&path).unwrap();
    let revision = config().metadata().git_revision;
    fs::write(&path, text.replace(&revision, "0123abc")).unwrap();
    let report = &collect(&config(), folder.path(), &[Reverse], RESUME, 1).unwrap()[0];
    assert_eq!((report.collected_rows, report.missing_shards), (0, 0));
    let error = collect(&config(), folder.path(), &[Forward], RESUME, 1).unwrap_err();
    assert!(error.is_bad_input(), "{error}");
    assert!(error.to_string().contains("git_revision was \"0123abc\""), "{error}");
}

#[test]
fn every_status_has_its_own_name() {
    for status in Status::ALL {
        assert_eq!(Status::from_name(status.name()), Some(status));
        assert_eq!(serde_json::to_value(status).unwrap(), status.name());
    }
}

/// The full set must stay shippable: 450 000 rows in at most 15 MiB.
#[test]
fn rows_take_few_bytes() {
    let config = CollectConfig { samples_per_cell: 256, ..CollectConfig::default() };
    let folder = tempfile::tempdir().unwrap();
    let bar = indicatif::ProgressBar::hidden();
    let options = CollectOptions { resume: false, part: "1/36".parse().unwrap() };
    let make = || {
        |kind, cell, index| {
            let mut rng = rng(1, Stream::Bootstrap, u64::from(cell * 256 + index));
            let mut random = |min: f64, max: f64| rng.random_range(min..max);
            let mut a = sample(&config, kind, cell, 0);
            a.sample_index = index;
            a.status = Status::Solved;
            a.start = Pose::new(random(-10.0, 12.0), random(2.75, 9.75), random(-1.0, 1.0));
            a.rs_start = Pose::new(random(-10.0, 12.0), random(2.75, 9.75), random(-3.0, 3.0));
            a.rs_word = ["L+R-S-", "L-S-R-", "R+S-L-"][random(0.0, 3.0) as usize].to_owned();
            a.rs_lengths = [random(-6.0, 6.0), random(-6.0, 6.0), random(-6.0, 6.0), 0.0, 0.0];
            a.entry = [0.0, -1.0, -2.0][random(0.0, 3.0) as usize];
            a.path_length = random(5.0, 40.0);
            a.direction_changes = random(0.0, 5.0) as u32;
            a.expansions = random(1.0, 300.0) as u32;
            a.rounded()
        }
    };
    let report = collect_with(&config, folder.path(), &[Reverse], options, &bar, make).unwrap();
    let per_row = report[0].bytes as f64 / report[0].rows as f64;
    println!("{per_row:.2} bytes per row");
    assert!(per_row < 35.0, "{per_row} bytes per row");
}
