//! Plans from polygons, asks for the path in time, and measures a warm plan; then plans the scenes
//! of a list and writes each path as `n3p-plan --out` does.
//!
//! `embed [LIST FOLDER]`: LIST names a scene file a line; their paths go to FOLDER.

mod allocations;

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::time::{Duration, Instant};
use std::{env, fs};

use n3p::curves::TrajectoryLimits;
use n3p::curves::smoothing::StandstillSteering;
use n3p::geometry::Pose;
use n3p::world::Scene;
use n3p::{Lot, Parker, PlanError, Vehicle};

#[global_allocator]
static COUNTED: allocations::Counted = allocations::Counted;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match &arguments[..] {
        [] => from_polygons(),
        [list, folder] => from_files(Path::new(list), Path::new(folder)),
        _ => Err("usage: embed [LIST FOLDER]".into()),
    }
}

fn from_polygons() -> Result<(), Box<dyn Error>> {
    let parker = Parker::new(Vehicle::default())?;
    // Two parked cars, a bay between them, and the kerb across the lane; metres.
    let mut lot = Lot::new();
    lot.polygon([[-4.1, -2.6], [-1.6, -2.6], [-1.6, 2.4], [-4.1, 2.4]]);
    lot.polygon([[1.6, -2.6], [4.1, -2.6], [4.1, 2.4], [1.6, 2.4]]);
    lot.polyline([[-15.0, 9.5], [15.0, 9.5]]);
    let start = Pose::new(-9.0, 6.0, 0.0);
    let goal = Pose::new(0.0, -1.4, FRAC_PI_2);

    let plan = parker.plan(start, goal, &lot)?;
    let (length, changes) = (plan.length(), plan.direction_changes());
    println!("{length:.2} m with {changes} changes of direction by {}", plan.method());
    println!("{} poses", plan.poses().poses.len());
    // A path for a car to follow: the steering angle does not jump while it drives.
    let follower = Parker::new(Vehicle::default())?;
    let follower = follower.standstill_steering(StandstillSteering::AtChanges);
    let driven = follower.plan(start, goal, &lot)?.trajectory(&TrajectoryLimits::default())?;
    let end = driven.moments.last().ok_or("a path has an end")?;
    println!("{:.1} s of driving in {} moments", end.time, driven.moments.len());

    println!("a warm plan: {:.1} µs", micros(warm(2001, || parker.plan(start, goal, &lot))));
    let before = allocations::so_far();
    let again = parker.plan(start, goal, &lot);
    println!("a warm plan: {} allocations", allocations::so_far() - before);
    drop(again);

    // What cannot be planned is said in words.
    if let Err(error) = parker.plan(Pose::new(2.0, 0.0, 0.0), goal, &lot) {
        println!("{error}");
    }
    Ok(())
}

fn from_files(list: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
    for file in fs::read_to_string(list)?.lines().map(Path::new) {
        let scene = Scene::read(file)?;
        let parker = Parker::new(scene.vehicle)?;
        let plan = parker.plan_scene(&scene)?;
        let stem = file.file_stem().ok_or("a scene file has a name")?;
        plan.poses().write(&folder.join(stem).with_extension("json"))?;
        let time = micros(warm(101, || parker.plan_scene(&scene)));
        let (stem, length) = (stem.to_string_lossy(), plan.length());
        println!("{stem:26} {length:6.2} m, a warm plan {time:8.1} µs");
    }
    Ok(())
}

/// The median time of so many calls, since other programs disturb.
fn warm(count: usize, plan: impl Fn() -> Result<n3p::Plan, PlanError>) -> Duration {
    let timed = || {
        let before = Instant::now();
        let plan = plan();
        let time = before.elapsed();
        drop(plan);
        time
    };
    let mut times: Vec<Duration> = (0..count).map(|_| timed()).collect();
    times.sort();
    times[count / 2]
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}
