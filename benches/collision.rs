//! How long does the exact swept check of one motion primitive take?
//!
//! One check each, from free poses all over the lane and the spot: `full` among the
//! polygons of a generated scene, `dense` among the same scene seen by a range sensor, its
//! outlines as points 5 cm apart.

mod common;

use std::f64::consts::PI;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use n3p::curves::Segment;
use n3p::geometry::{Pose, Vec2};
use n3p::planners::Problem;
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use n3p::world::collision::{BodyFrame, CollisionWorld, Sweep};
use n3p::world::{Level, Obstacles, ParkingType};
use rand::RngExt;

/// The primitives of the coarse lattice: 0.4 m, five steering angles, both gears.
fn primitives(vehicle: &Vehicle) -> Vec<Sweep> {
    let footprint = vehicle.footprint(Problem::MARGIN);
    let lengths = [0.4, -0.4].into_iter();
    lengths
        .flat_map(|length| (-2..=2).map(move |i| (length, f64::from(i) / 2.0)))
        .map(|(length, lock)| {
            let curvature = (vehicle.max_steer * lock).tan() / vehicle.wheelbase;
            Sweep::new(&footprint, Segment { curvature, length })
        })
        .collect()
}

/// Free poses around the spot, as a search meets them.
fn free_poses(world: &CollisionWorld) -> Vec<Pose> {
    let mut rng = rng(common::SEED, Stream::Start, 1);
    let mut within = |min: f64, max: f64| min + (max - min) * rng.random::<f64>();
    let mut drawn = std::iter::repeat_with(|| {
        Pose::new(within(-12.0, 8.0), within(-2.0, 8.0), within(-PI, PI))
    });
    drawn.by_ref().filter(|p| world.pose_is_free(*p)).take(1009).collect()
}

fn as_points(obstacles: &Obstacles) -> Obstacles {
    let along = |(a, b): (Vec2, Vec2)| {
        let n = ((b - a).norm() / 0.05).ceil() as usize;
        (0..n).map(move |i| a + (b - a) * (i as f64 / n as f64))
    };
    Obstacles::new(vec![], vec![], obstacles.edges().flat_map(along).collect()).unwrap()
}

fn bench(c: &mut Criterion) {
    let problem = common::problems(ParkingType::Reverse, Level::Extreme, 1).remove(0);
    let (vehicle, full) = (problem.vehicle, &problem.collision);
    let points = as_points(&problem.obstacles);
    let dense = CollisionWorld::new(&points, None, &vehicle, Problem::MARGIN);
    let (sweeps, poses) = (primitives(&vehicle), free_poses(full));
    println!("full: {} edges; dense: {} points", full_edges(&problem), points.points().len());

    let mut group = c.benchmark_group("swept_check");
    for (name, world) in [("full", full), ("dense", &dense)] {
        // 1009 poses and 10 primitives: every pair has its turn.
        let mut next = poses.iter().cycle().zip(sweeps.iter().cycle());
        group.bench_function(name, |b| {
            b.iter(|| {
                let (&pose, sweep) = next.next().expect("endless");
                world.sweep_is_free(&BodyFrame::new(black_box(pose)), sweep)
            });
        });
    }
    group.finish();
}

fn full_edges(problem: &Problem) -> usize {
    problem.obstacles.edges().count()
}

criterion_group! { name = benches; config = common::quick(); targets = bench }
criterion_main!(benches);
