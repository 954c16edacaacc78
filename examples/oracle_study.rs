//! How fast could anything be that proposes one preparatory pose?
//!
//! `cargo run --release --example oracle_study -- [COUNT] [SEED]` prints a Markdown table (COUNT 30, SEED
//! 2718 if left out).
//!
//! In COUNT scenes of every type and level at home, and of every type in `lots`, the paper's algorithm
//! plans with the best pose there is: all at which some manoeuvre of `models/knn.bin` begins are tried,
//! and of those with which it ends soonest the quickest counts, timed by itself. So this is a bound for
//! any model that selects one pose, as far as those poses go. The rows `knn-n3p` and `mlp-n3p` select
//! theirs without having tried.
//!
//! Columns: share of the mean time of `ha-rs` that is saved; how often no pose does without a search
//! (*searched*, of the oracle); cost over that of `ha-rs`, where that has a path (*cost*, mean, of the
//! oracle).

use std::sync::{Arc, Mutex};
use std::time::Instant;

use n3p::episode::Case;
use n3p::geometry::Pose;
use n3p::lab::evaluation::suite::{Drawn, World};
use n3p::n3p::guided::GuidedPlanner;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::planners::{Budget, HybridAStarConfig, PlanResult, Planner, Problem};
use n3p::selectors::model::Model;
use n3p::selectors::{Features, PoseSelector};
use n3p::vehicle::Vehicle;
use n3p::world::cell::{Axis, Grid};
use n3p::world::generate::GeneratorConfig;
use n3p::world::{Level, ParkingType, Stance};

const BUDGET: Budget = Budget::new(200_000);
/// Poses that are tried with a search, where none does without.
const SEARCHED: usize = 30;
/// The quickest poses that are timed again, and how often.
const AGAIN: usize = 5;
const RUNS: usize = 5;

/// The pose that is on trial, for any spot and lane.
struct Trial {
    pose: Mutex<Pose>,
    grid: Grid,
}

impl PoseSelector for Trial {
    fn select(&self, _features: &Features, _vehicle: &Vehicle, k: usize, out: &mut Vec<Pose>) {
        out.extend((k > 0).then(|| *self.pose.lock().expect("no thread panics")));
    }

    fn grid(&self, _kind: ParkingType) -> &Grid {
        &self.grid
    }

    fn kinds(&self) -> Vec<ParkingType> {
        ParkingType::SQUARE.to_vec()
    }
}

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let count = args.first().map_or(Ok(30), |s| s.parse())?;
    let seed = args.get(1).map_or(Ok(2718), |s| s.parse())?;

    let files = [
        "knn.bin",
        "mlp-forward.safetensors",
        "mlp-parallel.safetensors",
        "mlp-reverse.safetensors",
    ];
    let models = Models::load(&files)?;
    let vehicle = models.vehicle().unwrap_or_default();
    let library = Model::load("models/knn.bin".as_ref())?.into_selector();
    let methods = [Method::HA_RS, Method::KNN_N3P, Method::MLP_N3P];
    let mut planners = Vec::new();
    for method in methods {
        planners.push(method.build(&models, &MethodSettings::default())?);
    }

    println!("| set | type | oracle | `knn-n3p` | `mlp-n3p` | searched | cost |");
    println!("|---|---|--:|--:|--:|--:|--:|");
    let generator = &GeneratorConfig::default();
    for world in [World::Home, World::Lots] {
        for kind in ParkingType::SQUARE {
            let (kinds, levels) = (&[kind], &Level::ALL);
            let drawn = Drawn { generator, vehicle: &vehicle, kinds, levels, count, seed };
            let cases = drawn.cases(world)?;
            for of_level in cases.chunk_by(|a, b| a.level == b.level) {
                let poses = begins(library.as_ref(), kind, &vehicle);
                let name = of_level[0].level.map_or(world.name(), Level::name);
                println!("| {name} | {kind} {}", line(of_level, &poses, &mut planners)?);
            }
        }
    }
    Ok(())
}

/// The rest of a line of the table.
fn line(
    cases: &[Case],
    poses: &[Pose],
    planners: &mut [Box<dyn Planner + Send>],
) -> anyhow::Result<String> {
    let (mut times, mut searched, mut costs) = ([0.0; 4], 0, Vec::new());
    for Case { scene, .. } in cases {
        let problem = Problem::new(scene)?;
        let mut cost_of = [0.0; 2];
        for (i, planner) in planners.iter_mut().enumerate() {
            let (time, result) = timed(planner.as_mut(), &problem);
            times[i] += time;
            cost_of[0] = if i == 0 { cost(&problem, &result) } else { cost_of[0] };
        }
        let (time, result) = best(&problem, poses).unwrap_or_else(|| {
            // No pose leads to a path: a plain search is left.
            timed(planners[0].as_mut(), &problem)
        });
        times[3] += time;
        searched += usize::from(result.expansions > 0);
        let ratio = cost(&problem, &result) / cost_of[0];
        if ratio.is_finite() {
            costs.push(ratio);
        }
    }
    let saved = |time: f64| format!("{:.0} %", 100.0 - 100.0 * time / times[0]);
    let [_, knn, mlp, oracle] = times.map(saved);
    let cost = costs.iter().sum::<f64>() / costs.len() as f64;
    Ok(format!("| {oracle} | {knn} | {mlp} | {searched} of {} | {cost:.2} |", cases.len()))
}

/// The plan by the pose with which it ends soonest, and how long it took, seconds.
fn best(problem: &Problem, poses: &[Pose]) -> Option<(f64, PlanResult)> {
    let axis = |min, step| Axis { min, max: 30.0, step };
    // Any spot and lane will do.
    let grid = Grid {
        lane_width: axis(0.5, 1.0),
        bay_spot_width: axis(0.5, 1.0),
        parallel_spot_width: axis(0.5, 1.0),
        dead_end: axis(0.5, 1.0),
        back: 0.5,
        ..Grid::default().scaled(problem.vehicle.scale())
    };
    let trial = Arc::new(Trial { pose: Mutex::default(), grid });
    let config = HybridAStarConfig::default();
    let mut planner = GuidedPlanner::paper("oracle", trial.clone(), config);
    let set = |pose: Pose| *trial.pose.lock().expect("no thread panics") = pose;
    let mut once = |pose: &Pose, budget| {
        set(*pose);
        let begin = Instant::now();
        let result = planner.plan(problem, budget);
        let is_by_it = result.guidance.is_some_and(|g| g.preparatory.is_some());
        (result.outcome.is_ok() && is_by_it).then(|| (begin.elapsed().as_secs_f64(), *pose))
    };
    // Without any search, if that goes.
    let mut found: Vec<_> = poses.iter().filter_map(|p| once(p, Budget::new(0))).collect();
    if found.is_empty() {
        found = poses.iter().take(SEARCHED).filter_map(|p| once(p, BUDGET)).collect();
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let again = found.iter().take(AGAIN).map(|(_, pose)| {
        set(*pose);
        timed(&mut planner, problem)
    });
    again.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A warm plan and its median time, seconds.
fn timed(planner: &mut dyn Planner, problem: &Problem) -> (f64, PlanResult) {
    let mut result = planner.plan(problem, BUDGET);
    let mut times = [0.0; RUNS];
    for time in &mut times {
        let begin = Instant::now();
        result = planner.plan(problem, BUDGET);
        *time = begin.elapsed().as_secs_f64();
    }
    times.sort_by(f64::total_cmp);
    (times[RUNS / 2], result)
}

fn cost(problem: &Problem, result: &PlanResult) -> f64 {
    let model = HybridAStarConfig::default().for_vehicle(&problem.vehicle).cost;
    result.outcome.as_ref().map_or(f64::NAN, |path| model.path(&problem.vehicle, &path.segments))
}

/// Where the manoeuvres of a type begin, seen from its spot frame.
fn begins(library: &dyn PoseSelector, kind: ParkingType, vehicle: &Vehicle) -> Vec<Pose> {
    let stance = Stance::new(kind, 0.0);
    let goal = library.grid(kind).goal(stance, vehicle);
    let begin = |motions: Vec<_>| {
        motions.iter().rev().fold(goal, |at, s: &n3p::curves::Segment| s.reversed().end(at))
    };
    library.manoeuvres(stance, vehicle).into_iter().map(begin).collect()
}
