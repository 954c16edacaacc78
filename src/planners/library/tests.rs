use super::*;
use crate::geometry::signed_angle;
use crate::planners::{Budget, HybridAStar, HybridAStarConfig, PlanResult, Planner};
use crate::world::generate::{GeneratorConfig, generate};
use crate::world::{Level, ParkingType};

const BUDGET: Budget = Budget::new(200_000);

fn problems(kind: ParkingType, level: Level, seed: u64) -> Vec<Problem> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let scene = |i| generate(&config, &vehicle, kind, level, seed, i);
    (0..20).map(|i| Problem::new(&scene(i)).unwrap()).collect()
}

/// How the searched paths of other scenes end.
fn library(kind: ParkingType, footprint: Aabb) -> Library {
    let config = HybridAStarConfig::default();
    let mut hars = HybridAStar::new(config);
    let manoeuvres: Vec<_> = problems(kind, Level::Extreme, 1)
        .iter()
        .filter_map(|p| {
            let path = hars.plan(p, BUDGET).outcome.ok()?;
            hars.manoeuvre(p, &path)
        })
        .collect();
    assert!(manoeuvres.len() > 10, "{}", manoeuvres.len());
    Library::new(&manoeuvres, &Vehicle::default(), footprint, &config.cost)
}

#[test]
fn no_verdict_depends_on_what_was_touched_before() {
    for kind in ParkingType::ALL {
        for problem in problems(kind, Level::Extreme, 3) {
            let library = library(kind, *problem.collision.footprint());
            let base = BodyFrame::new(problem.goal);
            let alone = |i: &usize| {
                let is_free = |(at, sweep): &(BodyFrame, Sweep)| {
                    problem.collision.sweep_is_free(&base.compose(at), sweep)
                };
                library.manoeuvres[*i].motions.iter().all(is_free)
            };
            let expected: Vec<usize> = (0..library.len()).filter(alone).collect();
            let mut verdicts = Verdicts::default();
            let free = |i: &usize| verdicts.is_free(&library, *i, &problem, problem.goal);
            let found: Vec<usize> = (0..library.len()).filter(free).collect();
            assert_eq!(found, expected);
        }
    }
}

#[test]
fn whoever_stands_within_a_manoeuvre_is_found() {
    for kind in ParkingType::ALL {
        let problem = &problems(kind, Level::Easy, 5)[0];
        let library = library(kind, *problem.collision.footprint());
        let vehicle = &problem.vehicle;
        let passages = Passages::new(&library.manoeuvres, vehicle);
        let is_beside = |at: Pose, pose: Pose| {
            let turn = signed_angle(at.heading, pose.heading).abs();
            // But for the rounding of what is stored.
            at.distance(pose) + turn * vehicle.turning_radius() < rest::BESIDE - 1e-4
        };
        let mut found = 0;
        for i in 0..300 {
            // Beside some pose of some manoeuvre.
            let poses = library.manoeuvres[i % library.len()].poses(1.0);
            let (.., at) = poses.step_by(3).nth(i % 5).unwrap();
            let [x, y, turn] = [7, 11, 13].map(|k| (i * k % 101) as f64 / 50.0 - 1.0);
            let pose = at.compose(Pose::new(0.3 * x, 0.3 * y, 0.1 * turn));
            let near = passages.near(pose, vehicle);
            for (m, manoeuvre) in library.manoeuvres.iter().enumerate() {
                let is_within =
                    manoeuvre.poses(vehicle.scale()).any(|(.., at)| is_beside(at, pose));
                assert!(
                    !is_within || near.iter().any(|(i, ..)| *i as usize == m),
                    "{kind} {m} {pose:?}"
                );
                found += usize::from(is_within);
            }
        }
        assert!(found > 100, "{kind}: {found}");
    }
}

#[test]
fn plans_are_certified_cost_what_they_say_and_keep_the_bound() {
    let config = HybridAStarConfig::default();
    let mut search = LibrarySearch::default();
    let mut found = 0;
    for kind in ParkingType::ALL {
        for problem in problems(kind, Level::Complex, 2) {
            let library = library(kind, *problem.collision.footprint());
            let mut within = |bound| {
                let mut new = Verdicts::default();
                search.plan(&library, &mut new, &problem, &config.cost, bound)
            };
            let Some(plan) = within(f64::INFINITY) else { continue };
            found += 1;
            let cost = config.cost.path(&problem.vehicle, &plan.path.segments);
            assert!((cost - plan.cost).abs() < 1e-6, "{cost} {}", plan.cost);
            let less = plan.cost - 1.0;
            assert!(within(less).is_none_or(|p| p.cost < less));
            assert_eq!(within(f64::INFINITY).as_ref(), Some(&plan));
            let mut verdicts = Verdicts::default();
            for bound in [less, f64::INFINITY, f64::INFINITY] {
                let mut new = Verdicts::default();
                let [again, anew] = [&mut verdicts, &mut new]
                    .map(|v| search.plan(&library, v, &problem, &config.cost, bound));
                assert_eq!(again, anew);
            }
            // In parts as at once, but for the long ways round.
            let mut new = Verdicts::default();
            let mut look_up =
                search.look_up(&library, &mut new, &problem, &config.cost, f64::INFINITY);
            // Nothing costs less than nothing: what is left out then is found afterwards.
            assert!(look_up.next(0.0, usize::MAX).is_none());
            let parts = (0..library.len()).find_map(|_| look_up.next(f64::INFINITY, 1));
            match parts {
                Some(parts) => assert_eq!(parts, plan),
                None => {
                    let around = look_up.long_way(f64::INFINITY, usize::MAX);
                    assert_eq!(around.as_ref(), Some(&plan));
                }
            }
            let near = |s: &crate::curves::Sample| s.pose.distance(plan.preparatory) < 0.03;
            assert!(plan.path.sample(0.05).iter().any(near));
            assert!(PlanResult::certified(&problem, plan.path, 0).outcome.is_ok());
        }
    }
    assert!(found > 30, "{found} of 60");
}

#[test]
fn plans_by_way_of_a_pose_are_certified_cost_what_they_say_and_keep_the_bound() {
    let config = HybridAStarConfig::default();
    let mut search = LibrarySearch::default();
    let (mut found, mut joined) = ([0; 2], 0);
    for kind in ParkingType::ALL {
        for problem in problems(kind, Level::Extreme, 4) {
            let library = library(kind, *problem.collision.footprint());
            let any = f64::INFINITY;
            let mut by_way = |bound, motions| {
                let mut new = Verdicts::default();
                let mut look_up = search.look_up(&library, &mut new, &problem, &config.cost, any);
                look_up.by_way(bound, Reach { motions, manoeuvres: 40, tries: 100 })
            };
            assert!(by_way(any, 0).is_none());
            for motions in [1, 2] {
                let Some(plan) = by_way(any, motions) else { continue };
                found[motions - 1] += 1;
                let cost = config.cost.path(&problem.vehicle, &plan.path.segments);
                assert!((cost - plan.cost).abs() < 1e-6, "{cost} {}", plan.cost);
                let less = plan.cost - 1.0;
                assert!(by_way(less, motions).is_none_or(|p| p.cost < less));
                assert_eq!(by_way(any, motions).as_ref(), Some(&plan));
                assert!(PlanResult::certified(&problem, plan.path, 0).outcome.is_ok());
            }
            let mut new = Verdicts::default();
            let plan = search.plan(&library, &mut new, &problem, &config.cost, any);
            joined += usize::from(plan.is_some());
        }
    }
    // What one motion leads to, two do, and they lead where no curve alone does.
    assert!(found[0] <= found[1] && joined < found[1], "{joined} {found:?}");
}
