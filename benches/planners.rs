//! How long does each method plan, by type and level?
//!
//! One iteration plans the same ten scenes, from the scene in hand to the certified path,
//! so a tenth of the time is the mean of a plan; `elem/s` are plans per second. Medians
//! and percentiles over scenes are `n3p-eval`'s.

mod common;

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::planners::{Budget, NoPath, Problem};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType};

const SCENES: u64 = 10;
const BUDGET: Budget = Budget::new(200_000);

fn bench(c: &mut Criterion) {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    for method in Method::all() {
        let models = Models::usual(&[method], None).expect("the models of the repository load");
        let Ok(mut planner) = method.build(&models, &MethodSettings::default()) else {
            continue;
        };
        let mut group = c.benchmark_group(method.name());
        group.sampling_mode(SamplingMode::Flat).throughput(Throughput::Elements(SCENES));
        for kind in ParkingType::SQUARE {
            for level in Level::ALL {
                let scene = |i| generate(&config, &vehicle, kind, level, common::SEED, i);
                let scenes: Vec<_> = (0..SCENES).map(scene).collect();
                let mut plan = |scene| {
                    let problem = Problem::new(scene).expect("generated scenes are free");
                    planner.plan(&problem, BUDGET).outcome.err()
                };
                if plan(&scenes[0]) == Some(NoPath::NotApplicable) {
                    continue;
                }
                group.bench_function(format!("{kind}/{level}"), |b| {
                    b.iter(|| scenes.iter().filter_map(&mut plan).count());
                });
            }
        }
        group.finish();
    }
}

criterion_group! { name = benches; config = common::slow(); targets = bench }
criterion_main!(benches);
