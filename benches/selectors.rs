//! How long does a selector take to choose preparatory poses?
//!
//! One query each, over fixed scenes of every type and level, with the models of the
//! repository; the points of the cells are computed in the warm-up. `nearest_…`: one of so many
//! samples of a cell; below 500 each is looked at, from there on a tree is asked.

mod common;

use std::hint::black_box;
use std::num::NonZero;

use criterion::{Criterion, criterion_group, criterion_main};
use n3p::n3p::{Method, Models};
use n3p::selectors::nearest::Points;
use n3p::vehicle::Vehicle;
use n3p::world::ParkingType;

fn bench(c: &mut Criterion) {
    let problems: Vec<_> =
        ParkingType::SQUARE.iter().flat_map(|&kind| common::problems_of(kind, 20)).collect();
    let vehicle = Vehicle::default();
    let selector = |method| {
        let models =
            Models::usual(&[method], Some(&vehicle)).expect("the models of the repository load");
        models.selector(method, &vehicle).expect("models/ holds a model for the method")
    };
    let (knn, mlp) = (selector(Method::KNN_N3P), selector(Method::MLP_N3P));
    let mut group = c.benchmark_group("selectors");
    for (name, selector, k) in [("knn_1", &knn, 1), ("knn_8", &knn, 8), ("mlp", &mlp, 1)] {
        let features = common::features(&problems, selector.grid(ParkingType::Reverse));
        let mut poses = Vec::new();
        for f in &features {
            selector.select(f, &vehicle, k, &mut poses);
        }
        let mut next = features.iter().cycle();
        group.bench_function(name, |b| {
            b.iter(|| {
                poses.clear();
                let features = black_box(next.next().expect("endless"));
                selector.select(features, &vehicle, k, &mut poses);
                poses.len()
            });
        });
    }
    for count in [120, 499, 500, 20_000] {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = || [16.0 * random(), 6.0 * random(), 2.0 * random(), 2.0 * random()];
        let points = Points::new((0..count).map(|_| point()).collect());
        let queries: Vec<_> = (0..64).map(|_| point()).collect();
        let mut next = queries.iter().cycle();
        group.bench_function(format!("nearest_{count}"), |b| {
            b.iter(|| {
                points.nearest(black_box(next.next().expect("endless")), NonZero::<usize>::MIN)
            });
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::quick(); targets = bench }
criterion_main!(benches);
