//! How many samples does the data collection solve per second, on one thread?
//!
//! One iteration draws and solves the same 60 samples: three in each of 20 cells spread
//! over the whole grid. `elem/s` are samples per second.

mod common;

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use n3p::lab::dataset::CollectConfig;
use n3p::lab::dataset::sampler::Sampler;
use n3p::world::ParkingType;

const CELLS: usize = 20;
const PER_CELL: u32 = 3;

fn bench(c: &mut Criterion) {
    let config = CollectConfig { seed: common::SEED, ..CollectConfig::default() };
    let mut sampler = Sampler::new(&config);
    let mut group = c.benchmark_group("collection");
    group.sampling_mode(SamplingMode::Flat);
    group.throughput(Throughput::Elements(CELLS as u64 * u64::from(PER_CELL)));
    for kind in ParkingType::SQUARE {
        let count = config.grid.cell_count(kind);
        group.bench_function(kind.name(), |b| {
            b.iter(|| {
                for i in 0..CELLS {
                    for sample in 0..PER_CELL {
                        sampler.sample(kind, (i * count / CELLS) as u32, sample);
                    }
                }
            });
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::slow(); targets = bench }
criterion_main!(benches);
