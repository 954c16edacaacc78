//! How long one plan takes, and how many a batch plans a second: what `examples/python/speed.py`
//! measures from Python, on the same scenes.
//!
//! `cargo run --release --example throughput` (needs `--features generate,models` where the default
//! features are left out).

use std::hint::black_box;
use std::time::Instant;

use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use n3p::{Lot, Parker, Request, Vehicle};

const SEED: u64 = 7;
/// Scenes of the batch.
const BATCH: usize = 10_000;
/// Scenes planned one by one, and how often each.
const SINGLE: u64 = 200;
const REPEATS: usize = 100;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let vehicle = Vehicle::default();
    let config = GeneratorConfig::default();
    let scene = |kind, level, index| generate(&config, &vehicle, kind, level, SEED, index);
    let parker = Parker::new(vehicle)?;

    let easy: Vec<Scene> =
        (0..SINGLE).map(|i| scene(ParkingType::Reverse, Level::Easy, i)).collect();
    let of_scene = |scene: &Scene| {
        let mut lot = Lot::new();
        for outline in &scene.obstacles {
            lot.polygon(outline.clone());
        }
        let request = Request::new(scene.start, scene.goal);
        if let Some(bounds) = scene.bounds {
            lot.bounds(bounds);
        }
        (Request { parking_type: scene.parking_type, ..request }, lot)
    };
    let lots: Vec<(Request, Lot)> = easy.iter().map(of_scene).collect();
    for scene in &easy {
        parker.plan_scene(scene)?;
    }
    // Of each scene the fastest time, which other programs disturb least.
    let microseconds = |plan: &dyn Fn(usize)| {
        let mut fastest = vec![f64::INFINITY; easy.len()];
        for _ in 0..REPEATS {
            for (i, time) in fastest.iter_mut().enumerate() {
                let start = Instant::now();
                plan(i);
                *time = time.min(start.elapsed().as_secs_f64());
            }
        }
        1e6 * fastest.iter().sum::<f64>() / fastest.len() as f64
    };
    let (of_scenes, of_lots, with_poses) = (
        microseconds(&|i| drop(black_box(parker.plan_scene(&easy[i])))),
        microseconds(&|i| drop(black_box(parker.plan_request(&lots[i].0, &lots[i].1)))),
        microseconds(&|i| drop(black_box(parker.plan_scene(&easy[i]).map(|plan| plan.poses())))),
    );
    println!("plan_scene           {of_scenes:8.1} us");
    println!("plan of polygons     {of_lots:8.1} us");
    println!("plan_scene and poses {with_poses:8.1} us");

    let each = BATCH.div_ceil(9) as u64;
    let kinds = ParkingType::SQUARE.into_iter().flat_map(|k| Level::ALL.map(|l| (k, l)));
    let all = kinds.flat_map(|(kind, level)| (0..each).map(move |i| scene(kind, level, i)));
    let all: Vec<Scene> = all.take(BATCH).collect();
    for _ in 0..3 {
        let start = Instant::now();
        let plans = parker.plan_scenes(&all);
        let seconds = start.elapsed().as_secs_f64();
        let failed = plans.iter().filter(|p| p.is_err()).count();
        println!(
            "batch of {BATCH}: {:.0} plans per second, {failed} failed",
            BATCH as f64 / seconds
        );
    }
    Ok(())
}
