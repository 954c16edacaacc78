//! How long does it take to find the cells around a spot?
//!
//! One scene each, in turn over 30 generated scenes of every type.

mod common;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use n3p::world::ParkingType;
use n3p::world::abstraction::abstractions;
use n3p::world::cell::Grid;

fn bench(c: &mut Criterion) {
    let grid = Grid::default();
    let mut group = c.benchmark_group("abstraction");
    for kind in ParkingType::ALL {
        let problems = common::problems_of(kind, 10);
        let mut next = problems.iter().cycle();
        group.bench_function(kind.name(), |b| {
            b.iter(|| {
                let problem = next.next().expect("endless");
                let stance = problem.stance().expect("generated scenes have one");
                abstractions(black_box(&problem.obstacles), stance, &grid)
            });
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::quick(); targets = bench }
criterion_main!(benches);
