//! Scenes whose sizes are drawn far wider than those of any level: worlds to learn in, and, of other
//! seeds, to choose by what was learnt.

use rand::RngExt;

use super::{GeneratorConfig, GeneratorError, LevelConfig, generate};
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;
use crate::world::{Level, ParkingType, Scene};

/// The scene number `index` of a type and seed, named `wide-TYPE-INDEX`. An error where the sizes drawn
/// leave no room for the vehicle, as now and then they do.
pub fn wide(
    vehicle: &Vehicle,
    kind: ParkingType,
    seed: u64,
    index: u64,
) -> Result<Scene, GeneratorError> {
    let mut rng = rng(seed, Stream::World, index << 8 | number(kind));
    let mut between = |min: f64, max: f64| rng.random_range(min..=max);
    let config = drawn(vehicle, &mut between);
    config.validate(vehicle)?;
    let scene = generate(&config, vehicle, kind, Level::Complex, rng.random(), 0);
    Ok(Scene {
        name: format!("wide-{kind}-{index:04}"),
        source: format!("generated: sizes drawn wide, type {kind}, seed {seed}, index {index}"),
        ..scene
    })
}

/// The first `count` scenes of a type and seed that there are. An error where so many of the sizes drawn
/// leave no room for the vehicle that it is the vehicle's fault.
pub fn some_wide(
    vehicle: &Vehicle,
    kind: ParkingType,
    seed: u64,
    count: usize,
) -> Result<Vec<Scene>, GeneratorError> {
    const DRAWS: u64 = 4;
    let mut scenes = Vec::new();
    let mut why = None;
    for index in 0..DRAWS * count as u64 {
        if scenes.len() == count {
            break;
        }
        match wide(vehicle, kind, seed, index) {
            Ok(scene) => scenes.push(scene),
            Err(error) => why = Some(error),
        }
    }
    match why {
        Some(error) if scenes.len() < count => Err(error),
        _ => Ok(scenes),
    }
}

/// Which of the random streams is that of a type. Part of what models are made of, so never renumbered.
fn number(kind: ParkingType) -> u64 {
    match kind {
        ParkingType::Forward => 0,
        ParkingType::Parallel => 1,
        ParkingType::Reverse => 2,
        ParkingType::Angled => 3,
    }
}

/// Sizes of one scene, in metres for the default vehicle, of `vehicle`'s size.
fn drawn(vehicle: &Vehicle, between: &mut impl FnMut(f64, f64) -> f64) -> GeneratorConfig {
    let mut size = |min: f64, max: f64| between(min, max) * vehicle.scale();
    let exactly = |v: f64| [v, v];
    let level = LevelConfig {
        bay_spot_width: exactly(size(2.3, 4.2)),
        parallel_spot_width: exactly(size(5.8, 8.2)),
        dead_end_probability: 0.75,
        dead_end: exactly(size(4.0, 13.0)),
    };
    GeneratorConfig {
        easy: level,
        complex: level,
        extreme: level,
        lane_width: size(4.6, 8.0),
        bay_depth: size(5.25, 6.2),
        parallel_depth: size(2.2, 2.8),
        passing_room: size(0.9, 1.4),
        max_slant: between(0.0, 0.08),
        lane_car_probability: 0.4,
        max_incline: 0.35,
        start_reach: [-3.4, 3.4],
        ..GeneratorConfig::default()
    }
}
