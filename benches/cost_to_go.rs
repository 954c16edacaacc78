//! How long does the A* cost-to-go take at most?
//!
//! The cost-to-go is computed lazily, as far as a search asks. Here a wall closes the spot:
//! the wave fills everything that can be reached before `ha-rs` knows that the goal is
//! enclosed, without expanding a node. What else such a plan does (a few Reeds-Shepp
//! curves that end in the wall) is measured with it.

mod common;

use criterion::{Criterion, criterion_group, criterion_main};
use n3p::planners::{Budget, HybridAStar, HybridAStarConfig, NoPath, Planner, Problem};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType};

/// Generated problems whose lane a thin wall parts from the spots.
fn closed_problems(kind: ParkingType) -> Vec<Problem> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let boundary = config.depth(kind) / 2.0;
    let [x0, x1, y0, y1] = [-40.0, 40.0, boundary + 0.1, boundary + 0.2];
    let wall = vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let scenes = (0..10).map(|i| generate(&config, &vehicle, kind, Level::Easy, common::SEED, i));
    let closed = scenes.map(|mut scene| {
        scene.obstacles.push(wall.clone());
        Problem::new(&scene).expect("starts keep a distance from the spots")
    });
    closed.collect()
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("cost_to_go");
    for kind in ParkingType::SQUARE {
        let problems = closed_problems(kind);
        let mut planner = HybridAStar::new(HybridAStarConfig::default());
        let mut next = problems.iter().cycle();
        group.bench_function(kind.name(), |b| {
            b.iter(|| {
                let problem = next.next().expect("endless");
                let result = planner.plan(problem, Budget::new(1));
                assert_eq!(result.outcome, Err(NoPath::Enclosed));
            });
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::quick(); targets = bench }
criterion_main!(benches);
