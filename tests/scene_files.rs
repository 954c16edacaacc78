//! `n3p-scene`: what it writes, and what it refuses.

#![cfg(feature = "scene")]

use std::path::Path;

use assert_cmd::Command;
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use predicates::str::contains;

fn generate_in(dir: &Path, arguments: &str) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("n3p-scene").expect("a binary of this crate");
    command.current_dir(dir).arg("generate").args(arguments.split_whitespace()).assert()
}

#[test]
fn every_world_has_its_files() {
    let dir = tempfile::tempdir().unwrap();
    for (world, count) in [("home", 12), ("lots", 4), ("clutter", 1), ("bays", 14)] {
        let out = dir.path().join(world);
        let arguments = format!("--world {world} --count 2 --seed 3 --out {world}");
        let told = format!("{world}: {} scenes", 2 * count);
        generate_in(dir.path(), &arguments).success().stdout(contains(told));
        let scenes = Scene::read_dir(&out).unwrap();
        assert_eq!(scenes.len(), 2 * count, "{world}");
        for scene in &scenes {
            assert!(out.join(format!("{}.json", scene.name)).exists(), "{}", scene.name);
        }
        // The same again changes nothing.
        generate_in(dir.path(), &arguments).success();
        assert_eq!(Scene::read_dir(&out).unwrap(), scenes, "{world}");
    }
    let read = Scene::read(&dir.path().join("home/easy-reverse-0001.json")).unwrap();
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let made = generate(&config, &vehicle, ParkingType::Reverse, Level::Easy, 3, 1);
    assert_eq!(read, made);
}

#[test]
fn a_type_that_a_world_has_not_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    generate_in(dir.path(), "--world bays --type angled --count 2 --seed 3 --out o")
        .code(2)
        .stderr(contains("--type: the world bays has no scenes of that type"));
    assert!(!dir.path().join("o").exists());
}

#[test]
fn types_levels_vehicle_and_hint_are_chosen() {
    let dir = tempfile::tempdir().unwrap();
    let vehicle = Vehicle { length: 4.7, ..Vehicle::default() };
    let fields = [
        ("length", vehicle.length),
        ("width", vehicle.width),
        ("wheelbase", vehicle.wheelbase),
        ("rear_overhang", vehicle.rear_overhang),
        ("max_steer", vehicle.max_steer),
    ];
    let text: String = fields.iter().map(|(name, value)| format!("{name} = {value}\n")).collect();
    std::fs::write(dir.path().join("car.toml"), text).unwrap();
    generate_in(
        dir.path(),
        "--world home --type forward --type parallel --level extreme --count 1 --seed 1 \
         --vehicle car.toml --no-hint --out home",
    )
    .success();
    let scenes = Scene::read_dir(&dir.path().join("home")).unwrap();
    let names: Vec<&str> = scenes.iter().map(|s| &s.name[..]).collect();
    assert_eq!(names, ["extreme-forward-0000", "extreme-parallel-0000"]);
    assert!(scenes.iter().all(|s| s.parking_type.is_none() && s.vehicle.is_like(&vehicle)));
}

#[test]
fn what_is_wrong_is_told_in_two_lines() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("full")).unwrap();
    std::fs::write(dir.path().join("full/mine.json"), "{}").unwrap();
    std::fs::write(dir.path().join("file"), "length = 4").unwrap();
    let some = "--count 1 --seed 1";
    for (arguments, parts) in [
        ("--world moon --count 1 --seed 1 --out a", &["moon", "home", "clutter"][..]),
        ("--count 1 --seed 1 --out a", &["--world"]),
        ("--world lots --seed 1 --out a", &["--count"]),
        ("--world lots --count 0 --seed 1 --out a", &["--count", "1..="]),
        (&format!("--world lots {some}"), &["--out"]),
        (&format!("--world lots {some} --type sideways --out a"), &["sideways", "parallel"]),
        (
            &format!("--world lots {some} --level easy --out a"),
            &["--level", "lots", "leave it out"],
        ),
        (&format!("--world clutter {some} --type reverse --out a"), &["--type", "clutter"]),
        (&format!("--world bays {some} --vehicle file --out a"), &["--vehicle", "bays"]),
        (&format!("--world lots {some} --vehicle file --out a"), &["file", "width"]),
        (&format!("--world lots {some} --vehicle none --out a"), &["none", "no such file"]),
        (&format!("--world lots {some} --out full"), &["full", "mine.json", "new folder"]),
        (&format!("--world lots {some} --out file/below"), &["file/below", "choose"]),
    ] {
        let assert = generate_in(dir.path(), arguments).code(2);
        let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        for part in parts {
            assert!(stderr.contains(part), "{arguments}: \"{part}\" not in: {stderr}");
        }
        assert!(stderr.trim().lines().count() <= 2, "{arguments}: {stderr}");
    }
    assert!(!dir.path().join("a").exists(), "what is refused leaves nothing");
    assert_eq!(std::fs::read_dir(dir.path().join("full")).unwrap().count(), 1);
}
