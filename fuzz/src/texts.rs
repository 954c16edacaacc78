//! Texts that people and programs hand in. What is accepted means something and comes back the same.

use std::path::Path;

use n3p::Vehicle;
use n3p::output::PathFile;
use n3p::planners::{HybridAStarConfig, Problem};
use n3p::toml_file::{Setting, parse_toml};
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene, tpcap as tpcap_file};

const ORIGIN: &str = "fuzz";

/// A scene as JSON.
pub fn scene_json(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else { return };
    let Ok(scene) = Scene::from_json(text, Path::new(ORIGIN)) else { return };
    let again = serde_json::to_string(&scene).unwrap();
    assert_eq!(Scene::from_json(&again, Path::new(ORIGIN)).unwrap(), scene);
    assert!(!scene.file_stem().contains(['/', '\\', '\0']), "{:?}", scene.file_stem());
    made_ready(&scene);
}

/// A scene as a TPCAP file.
pub fn tpcap(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else { return };
    let Ok(scene) = tpcap_file::parse(text, Path::new(ORIGIN)) else { return };
    if scene.validate(Path::new(ORIGIN)).is_ok() {
        made_ready(&scene);
    }
}

/// What every planner begins with.
fn made_ready(scene: &Scene) {
    let _ = scene.geometry();
    if let Ok(problem) = Problem::new(scene) {
        assert!(problem.start.is_finite() && problem.goal.is_finite(), "{scene:?}");
        let there = problem.frame.world_from_local(problem.start);
        let apart = there.distance(scene.start);
        assert!(apart <= 1e-6 + 4.0 * scene.start.resolution(), "{apart} m from the start");
    }
}

/// A vehicle as TOML.
pub fn vehicle_toml(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else { return };
    let Ok(vehicle) = Vehicle::from_toml(text, Path::new(ORIGIN)) else { return };
    let again = toml::to_string(&vehicle).unwrap();
    assert_eq!(Vehicle::from_toml(&again, Path::new(ORIGIN)).unwrap(), vehicle);
    assert!(vehicle.turning_radius().is_finite() && vehicle.turning_radius() > 0.0, "{vehicle:?}");
}

/// Settings: KEY=VALUE on the first line, those of a generator and of a search after it.
pub fn settings(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else { return };
    let (setting, text) = text.split_once('\n').unwrap_or((text, ""));
    if let Ok(setting) = setting.parse::<Setting>() {
        let set = std::slice::from_ref(&setting);
        let _ = n3p::toml_file::read_settings::<HybridAStarConfig>(None, set);
    }
    if let Ok(config) = parse_toml::<HybridAStarConfig>(text, Path::new(ORIGIN)) {
        let _ = config.validate();
    }
    let vehicle = Vehicle::default();
    let Ok(config) = parse_toml::<GeneratorConfig>(text, Path::new(ORIGIN)) else { return };
    if config.validate(&vehicle).is_ok() {
        for kind in ParkingType::ALL {
            let scene = generate(&config, &vehicle, kind, Level::Extreme, 1, 0);
            scene.validate(Path::new(ORIGIN)).unwrap();
        }
    }
}

/// A path file.
pub fn path_file(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else { return };
    let Ok(path) = PathFile::from_json(text, Path::new(ORIGIN)) else { return };
    assert_eq!(PathFile::from_json(&path.to_json(), Path::new(ORIGIN)).unwrap(), path);
    assert!(!path.poses.is_empty() && path.poses.len() == path.gears.len());
}
