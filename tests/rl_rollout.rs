//! Policies as planners: rows like any other, failures with a reason.

#![cfg(feature = "lab")]

use n3p::environment::courses::{Course, Stratum};
use n3p::environment::motion::{action, admitted};
use n3p::environment::{Action, MASK, Observation};
use n3p::episode;
use n3p::episode::{Case, EpisodeConfig};
use n3p::lab::evaluation::oracle;
use n3p::lab::rl::rollout::PolicyPlanner;
use n3p::lab::rl::{Policy, PolicyFault};
use n3p::n3p::RolloutConfig;
use n3p::output::PathFile;
use n3p::planners::{Budget, HybridAStarConfig, NoPath, PARKED_COVER, Planner, Problem};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const BUDGET: Budget = Budget::new(100_000);

/// A policy made of a function.
struct Function<F>(F);

impl<F> Policy for Function<F>
where
    F: FnMut(&Observation, &mut ChaCha8Rng) -> Result<Action, PolicyFault>,
{
    fn act(&mut self, o: &Observation, rng: &mut ChaCha8Rng) -> Result<Action, PolicyFault> {
        (self.0)(o, rng)
    }
}

fn planner<F>(act: F) -> PolicyPlanner<Function<F>>
where
    F: FnMut(&Observation, &mut ChaCha8Rng) -> Result<Action, PolicyFault>,
{
    let (rules, curves) = (RolloutConfig::default(), HybridAStarConfig::default());
    PolicyPlanner::new("policy", Function(act), rules, curves)
}

fn wander(o: &Observation, rng: &mut ChaCha8Rng) -> Result<Action, PolicyFault> {
    Ok(admitted(action(rng.random_range(0..MASK)), &o.mask))
}

fn scene(kind: ParkingType, index: u64) -> Scene {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    generate(&config, &vehicle, kind, Level::Easy, 31_337, index)
}

#[test]
fn even_a_random_walk_parks_and_passes_the_independent_check() {
    let mut planner = planner(wander);
    let mut parked = 0;
    for kind in ParkingType::SQUARE {
        for index in 0..20 {
            let case = Case {
                scene: scene(kind, index),
                kind: Some(kind),
                level: None,
                set: String::new(),
            };
            let config = EpisodeConfig::new(BUDGET);
            let row = episode::run(&case, &mut planner, &config, &oracle::JUDGE).unwrap().row;
            assert_eq!(row.method, "policy");
            assert!(row.nodes <= 400);
            if row.ok {
                parked += 1;
                assert_eq!(row.checked, "ok");
            } else {
                assert_eq!(row.reason, "not parked within the steps allowed");
            }
        }
    }
    assert!(parked >= 50, "{parked} of 60");
}

#[test]
fn a_plan_does_not_depend_on_plans_before() {
    let problems: Vec<Problem> = (0..10)
        .map(|i| Problem::new(&scene(ParkingType::SQUARE[i as usize % 3], i)).unwrap())
        .collect();
    let alone: Vec<_> = problems.iter().map(|p| planner(wander).plan(p, BUDGET)).collect();
    let mut one = planner(wander);
    for (problem, alone) in problems.iter().zip(alone).rev() {
        let result = one.plan(problem, BUDGET);
        assert_eq!((result.outcome, result.expansions), (alone.outcome, alone.expansions));
    }
}

#[test]
fn faults_are_reasons_and_the_next_scene_begins_anew() {
    let mut bad = 0;
    let mut planner = planner(|o, rng| {
        if o.step == 0 {
            bad += 1;
        }
        match (bad, o.step) {
            (1, 2) => Ok(Action { steer: f64::NAN, speed: 1.0 }),
            (2, 2) => Ok(Action { steer: 0.0, speed: f64::INFINITY }),
            (3, 2) => Err(PolicyFault::Ended),
            (4, 2) => Err(PolicyFault::TimedOut),
            (5, 2) => Err(PolicyFault::NoAction),
            _ => wander(o, rng),
        }
    });
    // A scene that takes more than two steps.
    let problem = Problem::new(&scene(ParkingType::Parallel, 1)).unwrap();
    for reason in [
        "policy: the answer is not finite",
        "policy: the answer is not finite",
        "policy: its process ended",
        "policy: no answer within its time limit",
        "policy: the answer is no action",
    ] {
        let result = planner.plan(&problem, BUDGET);
        assert_eq!(result.outcome, Err(NoPath::Failed(reason)));
        assert_eq!(result.expansions, 2);
    }
    assert!(planner.plan(&problem, BUDGET).outcome.is_ok());
}

#[test]
fn steps_are_limited_by_horizon_and_budget_and_standing_still_is_no_path() {
    let mut planner = planner(|_, _| Ok(Action::default()));
    let problem = Problem::new(&scene(ParkingType::Parallel, 1)).unwrap();
    let result = planner.plan(&problem, BUDGET);
    assert_eq!((result.outcome, result.expansions), (Err(NoPath::OutOfSteps), 400));
    let result = planner.plan(&problem, Budget::new(7));
    assert_eq!((result.outcome, result.expansions), (Err(NoPath::BudgetSpent), 7));
}

/// Where no curve is asked for, a car that covers its spot well enough is parked, and the
/// independent check agrees.
#[test]
fn ninety_per_cent_of_the_spot_is_parked() {
    let mut scene = scene(ParkingType::Reverse, 3);
    // Straight into the spot from a metre before it, but 5 cm aside.
    let goal = scene.goal;
    let (sin, cos) = goal.heading.sin_cos();
    scene.start.x = goal.x + 1.5 * cos - 0.05 * sin;
    scene.start.y = goal.y + 1.5 * sin + 0.05 * cos;
    scene.start.heading = goal.heading;
    let config = RolloutConfig { curve_distance: 0.0, ..RolloutConfig::default() };
    let back =
        Function(|_: &Observation, _: &mut ChaCha8Rng| Ok(Action { steer: 0.0, speed: -1.0 }));
    let mut planner = PolicyPlanner::new("policy", back, config, HybridAStarConfig::default());
    let problem = Problem::new(&scene).unwrap();
    let result = planner.plan(&problem, BUDGET);
    let path = result.outcome.expect("it backs into the spot");
    assert!(result.covered.unwrap() >= PARKED_COVER && result.covered.unwrap() < 1.0);
    let file = PathFile::new(&scene, &problem.frame, &path, "policy");
    assert!(oracle::measure(&scene, &file, Some(PARKED_COVER), 0.0).is_ok());
    let error = oracle::measure(&scene, &file, Some(0.999), 0.0).unwrap_err().to_string();
    assert!(error.contains("of the parked footprint is covered, expected 0.999"), "{error}");
    assert!(oracle::check(&scene, &file).is_err());
}

#[test]
fn training_problems_are_not_those_of_an_evaluation() {
    // Same generator, other seed: the streams never meet.
    let vehicle = Vehicle::default();
    for index in 0..50 {
        let stratum = Stratum::nth(index as usize % Stratum::COUNT);
        let trained = Course::Eval.problem(&vehicle, stratum, 2, index);
        let config = GeneratorConfig::default();
        let reported = generate(&config, &vehicle, stratum.kind, stratum.level, 20_261_122, index);
        assert_ne!(trained.start, Problem::new(&reported).unwrap().start);
    }
}
