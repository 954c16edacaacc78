//! How long large maps take from the bytes of their file to a scene: 10⁶ points, and a grid of 4,000 × 4,000 cells; and
//! from a scene of so many points to an indexed problem, and to a plan in it.

use std::f64::consts::TAU;
use std::fs;
use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use n3p::geometry::Pose;
use n3p::planners::{Budget, HybridAStar, HybridAStarConfig, Planner, Problem};
use n3p::vehicle::Vehicle;
use n3p::world::{Map, MapRequest, Scene};

fn request() -> MapRequest {
    MapRequest {
        start: Some(Pose::new(1.0, 1.0, 0.0)),
        goals: vec![Pose::new(9.0, 1.0, 0.0)],
        vehicle: Some(Vehicle::default()),
    }
}

/// A number from 0 to 1, always the same for the same `i`.
fn scattered(i: u32) -> f64 {
    f64::from(i.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24)
}

fn points() -> impl Iterator<Item = [f64; 3]> {
    (0..1_000_000)
        .map(|i| [100.0 * scattered(i), 100.0 * scattered(i ^ 0x5555), 2.0 * scattered(!i)])
}

fn write_clouds(folder: &Path) {
    let mut csv = String::from("x,y,z\n");
    let head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1000000\nHEIGHT 1\n\
                VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1000000\nDATA binary\n";
    let mut pcd = head.as_bytes().to_vec();
    for [x, y, z] in points() {
        csv += &format!("{x:.4},{y:.4},{z:.4}\n");
        for v in [x, y, z] {
            pcd.extend_from_slice(&(v as f32).to_le_bytes());
        }
    }
    fs::write(folder.join("cloud.csv"), csv).unwrap();
    fs::write(folder.join("cloud.pcd"), pcd).unwrap();
}

/// Walls of rooms, shelves that are not quite straight, and a rim of which nothing is known.
fn write_grid(folder: &Path) {
    const SIDE: u32 = 4000;
    let mut image = format!("P5\n{SIDE} {SIDE}\n255\n").into_bytes();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let rim = x < 100 || y < 100 || x >= SIDE - 100 || y >= SIDE - 100;
            let wall = x % 500 < 4 && y % 500 > 80 || y % 500 < 4 && x % 500 > 80;
            let uneven = (8.0 * scattered(y / 3)) as u32;
            let shelf = (60..90 + uneven).contains(&(x % 250)) && (100..200).contains(&(y % 250));
            image.push(if rim {
                205
            } else if wall || shelf {
                0
            } else {
                254
            });
        }
    }
    fs::write(folder.join("grid.pgm"), image).unwrap();
    let yaml = "image: grid.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    fs::write(folder.join("grid.yaml"), yaml).unwrap();
}

fn maps(c: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    write_clouds(folder.path());
    write_grid(folder.path());
    let mut group = c.benchmark_group("maps");
    group.sample_size(10);
    let files: &[&str] = if cfg!(feature = "maps") {
        &["cloud.csv", "cloud.pcd", "grid.yaml"]
    } else {
        &["cloud.csv", "cloud.pcd"]
    };
    for name in files {
        let file = folder.path().join(name);
        group.bench_function(*name, |b| b.iter(|| Map::read(black_box(&file)).unwrap()));
        let map = Map::read(&file).unwrap();
        println!("{name}: {} obstacles, {} points", map.obstacles.len(), map.points.len());
        let request = request();
        group.bench_function(format!("{name} to scene"), |b| {
            b.iter(|| map.scene(&request).unwrap())
        });
    }
    group.finish();
}

/// A bay between two scanned cars, and very many points farther away.
fn scanned(others: u32) -> Scene {
    let side = |x: f64| (0..40).map(move |i| [x, -2.6 + 0.12 * f64::from(i)]);
    let away = (0..others).map(|i| {
        let (radius, angle) = (30.0 + 170.0 * scattered(i), TAU * scattered(i ^ 0x5555));
        [radius * angle.cos(), radius * angle.sin()]
    });
    Scene {
        start: Pose::new(-9.0, 5.5, 0.0),
        goal: Pose::new(0.0, -1.4, std::f64::consts::FRAC_PI_2),
        points: side(-1.6).chain(side(1.6)).chain(away).collect(),
        ..Scene::default()
    }
}

fn planning(c: &mut Criterion) {
    let mut group = c.benchmark_group("among points");
    group.sample_size(10);
    for others in [100, 1_000_000] {
        let scene = scanned(others);
        group.bench_function(format!("{others} to an indexed problem"), |b| {
            b.iter(|| Problem::new(black_box(&scene)).unwrap())
        });
        let problem = Problem::new(&scene).unwrap();
        let mut planner = HybridAStar::new(HybridAStarConfig::default());
        group.bench_function(format!("{others}, a plan by ha-rs"), |b| {
            b.iter(|| planner.plan(&problem, Budget::new(200_000)))
        });
    }
    group.finish();
}

criterion_group!(benches, maps, planning);
criterion_main!(benches);
