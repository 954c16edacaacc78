//! Plans one method over generated scenes, again and again: a target for profilers.
//!
//! `cargo run --release --example plan_many -- METHOD [COUNT] [REPEATS] [TYPE] [LEVEL]`
//! plans COUNT scenes of every type and level (or of those given), REPEATS times each, and
//! prints the median and the 95th percentile of the time of one plan.

use std::time::Instant;

use n3p::n3p::{Method, MethodSettings, Models};
use n3p::planners::{Budget, Problem};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};

const SEED: u64 = 1;
const BUDGET: Budget = Budget::new(200_000);

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: usize| args.get(i).map_or(Ok(default), |s| s.parse());
    let method: Method = args.first().map_or("n3p", String::as_str).parse()?;
    let (count, repeats) = (number(1, 30)?, number(2, 5)?);
    let kinds =
        args.get(3).map_or(Ok(ParkingType::SQUARE.to_vec()), |s| s.parse().map(|k| vec![k]))?;
    let levels = args.get(4).map_or(Ok(Level::ALL.to_vec()), |s| s.parse().map(|l| vec![l]))?;

    let models = Models::usual(&[method], None)?;
    let mut planner = method.build(&models, &MethodSettings::default())?;
    for &kind in &kinds {
        for &level in &levels {
            let of = (&GeneratorConfig::default(), &Vehicle::default());
            let scenes: Vec<Scene> =
                (0..count).map(|i| generate(of.0, of.1, kind, level, SEED, i as u64)).collect();
            let (mut times, mut failures, mut expansions) = (Vec::new(), 0, 0);
            for scene in &scenes {
                for _ in 0..repeats {
                    let start = Instant::now();
                    let problem = Problem::new(scene)?;
                    let result = planner.plan(&problem, BUDGET);
                    times.push(start.elapsed().as_secs_f64());
                    failures += usize::from(result.outcome.is_err());
                    expansions += result.expansions;
                }
            }
            times.sort_by(f64::total_cmp);
            let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize] * 1e6;
            println!(
                "{method:8} {kind:8} {level:8} median {:9.1} us  P95 {:9.1} us  \
                 expansions {:8.1}  failures {failures}",
                at(0.5),
                at(0.95),
                expansions as f64 / times.len() as f64,
            );
        }
    }
    Ok(())
}
