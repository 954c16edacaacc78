//! How long do Reeds-Shepp queries take: the shortest length alone, all words in
//! order of length, and clothoids fitted to the shortest word?
//!
//! One query each, over a thousand fixed pairs of poses up to 28 m apart.

mod common;

use std::f64::consts::PI;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use n3p::curves::Path;
use n3p::curves::reeds_shepp::{shortest_length, words};
use n3p::curves::smoothing::{Smoothing, smooth};
use n3p::geometry::Pose;
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use rand::RngExt;

fn pairs() -> Vec<(Pose, Pose)> {
    let mut rng = rng(common::SEED, Stream::Start, 0);
    let mut pose = || {
        let mut within = |limit: f64| limit * (2.0 * rng.random::<f64>() - 1.0);
        Pose::new(within(10.0), within(10.0), within(PI))
    };
    (0..1000).map(|_| (pose(), pose())).collect()
}

fn bench(c: &mut Criterion) {
    let radius = Vehicle::default().turning_radius();
    let pairs = pairs();
    let mut group = c.benchmark_group("reeds_shepp");
    let mut next = pairs.iter().cycle();
    group.bench_function("shortest_length", |b| {
        b.iter(|| {
            let &(from, to) = next.next().expect("endless");
            shortest_length(black_box(from), black_box(to), radius)
        });
    });
    let mut found = Vec::new();
    group.bench_function("all_words_sorted", |b| {
        b.iter(|| {
            let &(from, to) = next.next().expect("endless");
            found.clear();
            words(black_box(from), black_box(to), radius, &mut found);
            found.sort_by(|a, b| a.length().total_cmp(&b.length()));
            found.len()
        });
    });
    let curves: Vec<Path> = pairs
        .iter()
        .map(|&(from, to)| {
            found.clear();
            words(from, to, radius, &mut found);
            let shortest = found.iter().min_by(|a, b| a.length().total_cmp(&b.length()));
            Path::new(from, shortest.expect("there is one").segments().iter().copied())
        })
        .collect();
    let mut next = curves.iter().cycle();
    let (turned_at_changes, sharpness) = (true, &[4.0 / (radius * radius)]);
    let smoothing = Smoothing {
        begin: 0.0,
        turned_at_start: false,
        turned_at_changes,
        sharpness,
        last_straight: None,
    };
    group.bench_function("smooth", |b| {
        b.iter(|| {
            let path = next.next().expect("endless");
            smooth(black_box(path), path.end(), &smoothing)
        });
    });
    group.finish();
}

criterion_group! { name = benches; config = common::quick(); targets = bench }
criterion_main!(benches);
