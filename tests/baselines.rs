//! The graph-search baselines on generated scenes: their paths hold, and each is what its
//! description says.

#![cfg(feature = "lab")]

use n3p::lab::evaluation::oracle;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::output::PathFile;
use n3p::planners::{
    Budget, Effort, HybridAStar, HybridAStarConfig, NoPath, PlanResult, Planner, Problem,
};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};

const SEED: u64 = 78;
const SCENES: u64 = 12;
const BUDGET: Budget = Budget::new(200_000);

fn scenes() -> Vec<(ParkingType, Scene)> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let settings = ParkingType::SQUARE.into_iter().flat_map(|k| Level::ALL.map(|l| (k, l)));
    let of = |(k, l)| (0..SCENES).map(move |i| (k, generate(&config, &vehicle, k, l, SEED, i)));
    settings.flat_map(of).collect()
}

/// The results of `method` on all scenes, after checking that they are certified, accepted
/// by the independent check, and the same from a planner that never planned before.
fn plan_all(method: Method) -> Vec<PlanResult> {
    let build = || method.build(&Models::default(), &MethodSettings::default()).unwrap();
    let mut planner = build();
    let plan = |(kind, scene): &(ParkingType, Scene)| {
        let problem = Problem::new(scene).unwrap();
        let result = planner.plan(&problem, BUDGET);
        let again = build().plan(&problem, BUDGET);
        let what = format!("{method} on {} (seed {SEED})", scene.name);
        assert_eq!(result.outcome, again.outcome, "{what} depends on earlier calls");
        assert_eq!(result.expansions, again.expansions, "{what} depends on earlier calls");
        assert!(result.expansions <= BUDGET.max_expansions, "{what}");
        match &result.outcome {
            Ok(path) => {
                assert_eq!(path.start, problem.start, "{what}");
                let file = PathFile::new(scene, &problem.frame, path, method.name());
                oracle::check(scene, &file).unwrap_or_else(|e| panic!("{what}: {e}"));
            }
            Err(reason) => {
                let no_parallel = method == Method::SHA && *kind != ParkingType::Parallel;
                assert_eq!(*reason == NoPath::NotApplicable, no_parallel, "{what}: {reason}");
                assert!(no_parallel || *reason == NoPath::BudgetSpent, "{what}: {reason}");
            }
        }
        result
    };
    scenes().iter().map(plan).collect()
}

fn nodes(results: &[PlanResult]) -> usize {
    results.iter().map(|r| r.expansions).sum()
}

#[test]
fn without_curves_the_search_still_arrives_exactly() {
    let results = plan_all(Method::HA);
    let solved = results.iter().filter(|r| r.outcome.is_ok()).count();
    assert!(solved * 100 >= results.len() * 95, "{solved} of {}", results.len());
    assert!(results.iter().all(|r| r.expansions > 0), "there is no curve to end it at once");
}

#[test]
fn more_heuristics_mean_fewer_nodes() {
    let (one, many) = (plan_all(Method::HA_RS), plan_all(Method::MHHA));
    assert!(many.iter().all(|r| r.outcome.is_ok()));
    assert!(nodes(&many) < nodes(&one), "{} {}", nodes(&many), nodes(&one));
}

#[test]
fn the_exit_manoeuvre_saves_most_of_the_search() {
    let parallel: Vec<bool> = scenes().iter().map(|(k, _)| *k == ParkingType::Parallel).collect();
    let of_parallel = |method| -> Vec<PlanResult> {
        plan_all(method).into_iter().zip(&parallel).filter(|(_, p)| **p).map(|(r, _)| r).collect()
    };
    let (plain, scenario) = (of_parallel(Method::HA_RS), of_parallel(Method::SHA));
    assert!(scenario.iter().all(|r| r.outcome.is_ok()));
    assert!(nodes(&scenario) * 2 < nodes(&plain), "{} {}", nodes(&scenario), nodes(&plain));
}

/// The best of five is never worse than the first of them, as they are found.
#[test]
fn holding_on_never_costs_more() {
    let (config, vehicle) = (HybridAStarConfig::default(), Vehicle::default());
    let plan_all = |solutions| -> Vec<PlanResult> {
        let mut planner = HybridAStar::hold(config, solutions);
        let first = Budget { effort: Effort::First, ..BUDGET };
        let plan = |(_, scene): &(_, Scene)| planner.plan(&Problem::new(scene).unwrap(), first);
        scenes().iter().map(plan).collect()
    };
    let (first, best) = (plan_all(1), plan_all(5));
    let cost = |r: &PlanResult| {
        config.cost.path(&vehicle, &r.outcome.as_ref().expect("both solve all").segments)
    };
    for (first, best) in first.iter().zip(&best) {
        assert!(cost(best) <= cost(first) + 1e-3, "{} {}", cost(best), cost(first));
    }
}

/// A budget too small for anything is told, not overdrawn.
#[test]
fn a_spent_budget_is_the_reason() {
    let (_, scene) = scenes().pop().unwrap();
    let problem = Problem::new(&scene).unwrap();
    let mut planner = Method::HA.build(&Models::default(), &MethodSettings::default()).unwrap();
    let result = planner.plan(&problem, Budget::new(10));
    assert_eq!((result.outcome, result.expansions), (Err(NoPath::BudgetSpent), 10));
}

/// More effort never ends with a dearer path, the first path takes no more than it did to find, and
/// an unknown effort is refused by name.
#[test]
fn effort_only_ever_pays() {
    let config = HybridAStarConfig::default();
    let models = Models::load(&["models/knn.bin".to_owned()]).unwrap();
    for method in [Method::HA_RS, Method::MHHA, Method::N3P] {
        let mut planner = method.build(&models, &MethodSettings::default()).unwrap();
        for (kind, scene) in scenes().iter().step_by(3) {
            let problem = Problem::new(scene).unwrap();
            let [first, usual, most] =
                Effort::ALL.map(|effort| planner.plan(&problem, Budget { effort, ..BUDGET }));
            let what = format!("{method} {kind} {}", scene.name);
            let cost = |r: &PlanResult| {
                config.cost.of_plan(&problem, r.outcome.as_ref().expect("each is solved"))
            };
            assert!(first.expansions <= usual.expansions, "{what}");
            assert!(cost(&usual) <= cost(&first) + 1e-3, "{what}");
            assert!(cost(&most) <= cost(&usual) + 1e-3, "{what}");
            assert!(most.expansions <= BUDGET.max_expansions, "{what}");
        }
    }
    assert_eq!("most".parse(), Ok(Effort::Most));
    assert!("utmost".parse::<Effort>().unwrap_err().to_string().contains("first, usual, most"));
}
