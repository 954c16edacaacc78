//! What the benches share: short measurements, fixed scenes.

#![allow(dead_code, reason = "every bench includes this file and uses a part of it")]

use std::time::Duration;

use criterion::Criterion;
use n3p::planners::Problem;
use n3p::selectors::Features;
use n3p::vehicle::Vehicle;
use n3p::world::abstraction::abstractions;
use n3p::world::cell::Grid;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType};

/// Seed of every scene and every random input of the benches.
pub const SEED: u64 = 2026;

/// Settings for questions answered within microseconds.
pub fn quick() -> Criterion {
    Criterion::default()
        .without_plots()
        .sample_size(30)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(700))
}

/// Settings for questions that take milliseconds each.
pub fn slow() -> Criterion {
    Criterion::default()
        .without_plots()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500))
}

/// The first `count` generated problems of a type and level.
pub fn problems(kind: ParkingType, level: Level, count: u64) -> Vec<Problem> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    (0..count)
        .map(|i| generate(&config, &vehicle, kind, level, SEED, i))
        .map(|scene| Problem::new(&scene).expect("generated scenes are free at both ends"))
        .collect()
}

/// `count` problems of a type, of every level.
pub fn problems_of(kind: ParkingType, count: u64) -> Vec<Problem> {
    Level::ALL.iter().flat_map(|&level| problems(kind, level, count)).collect()
}

/// What a selector is asked in `problems`.
pub fn features(problems: &[Problem], grid: &Grid) -> Vec<Features> {
    let of = |p: &Problem| {
        let found = abstractions(&p.obstacles, p.stance()?, grid);
        found.first().map(|f| Features::new(p.start, f.cell))
    };
    problems.iter().filter_map(of).collect()
}
