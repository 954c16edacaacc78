//! How long does a selector take to choose preparatory poses?
//!
//! One query each, over fixed scenes of every type and level, with the models of the
//! repository. The trees of the cells are built in the warm-up.

mod common;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use n3p::n3p::{Method, Models};
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
    group.finish();
}

criterion_group! { name = benches; config = common::quick(); targets = bench }
criterion_main!(benches);
