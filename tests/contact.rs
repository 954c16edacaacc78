//! `--allow-contact`: a contact is left and never deepened, whoever plans.

#![cfg(feature = "lab")]

use assert_cmd::Command;
use n3p::curves::smoothing::StandstillSteering;
use n3p::curves::{Path, Segment};
use n3p::geometry::{Frame, Pose};
use n3p::lab::evaluation::oracle;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::output::PathFile;
use n3p::planners::goals::{self, Planned, Terms};
use n3p::planners::{
    Budget, HybridAStar, HybridAStarConfig, NoPath, PlanResult, Planner, Problem, ProblemError,
    Shape,
};
use n3p::vehicle::Vehicle;
use n3p::world::collision::CollisionWorld;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{GoalTolerance, Level, ParkingType, Scene};
use predicates::prelude::*;
use predicates::str::contains;
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assert_eq, prop_assume, proptest};

const BUDGET: Budget = Budget::new(20_000);
const ALLOWED: f64 = 0.05;
const TERMS: Terms = Terms {
    margin: Problem::MARGIN,
    contact: ALLOWED,
    standstill: StandstillSteering::Anywhere,
    shape: Shape { least_move: None, last_straight: None },
};
const PILLAR: &str = "tests/fixtures/goals/beside-a-pillar.json";

fn scene(index: u64) -> Scene {
    let kind = ParkingType::SQUARE[index as usize % 3];
    generate(&GeneratorConfig::default(), &Vehicle::default(), kind, Level::Easy, 161, index)
}

/// A box of a metre whose nearest side lies `depth` inside one side of the car at `pose`: at the
/// share `along` of that side's length.
fn box_at(vehicle: &Vehicle, pose: Pose, side: usize, along: f64, depth: f64) -> Vec<[f64; 2]> {
    let body = vehicle.footprint(0.0);
    let (x, y) = (
        body.min.x + along * (body.max.x - body.min.x),
        body.min.y + along * (body.max.y - body.min.y),
    );
    let [x0, y0] = match side {
        0 => [body.max.x - depth, y - 0.5],
        1 => [body.min.x + depth - 1.0, y - 0.5],
        2 => [x - 0.5, body.max.y - depth],
        _ => [x - 0.5, body.min.y + depth - 1.0],
    };
    let corners = [[x0, y0], [x0 + 1.0, y0], [x0 + 1.0, y0 + 1.0], [x0, y0 + 1.0]];
    corners
        .map(|[x, y]| {
            let p = pose.point_to_parent(n3p::geometry::Vec2::new(x, y));
            [p.x, p.y]
        })
        .to_vec()
}

/// How deep the car reaches into one obstacle, to a tenth of a millimetre.
fn depth(scene: &Scene, obstacle: &[[f64; 2]], pose: Pose) -> f64 {
    let alone = Scene { obstacles: vec![obstacle.to_vec()], points: vec![], ..scene.clone() };
    let alone = alone.geometry().unwrap();
    let (mut touching, mut free) = (0.0, 1.0);
    let is_free = |d: f64| CollisionWorld::new(&alone, None, &scene.vehicle, -d).pose_is_free(pose);
    if is_free(0.0) {
        return 0.0;
    }
    while free - touching > 1e-5 {
        let middle = f64::midpoint(touching, free);
        *(if is_free(middle) { &mut free } else { &mut touching }) = middle;
    }
    free
}

fn plan(planner: &mut dyn Planner, scene: &Scene) -> Result<Planned, ProblemError> {
    goals::plan(planner, scene, TERMS, BUDGET)
}

fn ha_rs() -> HybridAStar {
    HybridAStar::new(HybridAStarConfig::default())
}

/// What the law says of the depths along a path that begins in contact: they never grow, and end.
fn only_left(depths: &[f64]) -> bool {
    let mut least = f64::INFINITY;
    depths.iter().all(|&d| {
        let fine = d <= least + 3e-4 && (least > 0.0 || d == 0.0);
        least = least.min(d);
        fine
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn a_contact_at_the_start_is_only_left(
        index in 0_u64..300, side in 0_usize..4, along in 0.0..1.0, deep in 0.001..0.049,
        guided in any::<bool>(),
    ) {
        let mut scene = scene(index);
        let obstacle = box_at(&scene.vehicle, scene.start, side, along, deep);
        prop_assume!(depth(&scene, &obstacle, scene.goal) == 0.0);
        scene.obstacles.push(obstacle.clone());
        prop_assert!(Problem::new(&scene).is_err());
        let models = Models::load(&["models/knn.bin"]).unwrap();
        let mut planner: Box<dyn Planner> = match guided {
            true => Method::N3P.build(&models, &MethodSettings::default()).unwrap(),
            false => Box::new(ha_rs()),
        };
        let planned = plan(planner.as_mut(), &scene).unwrap();
        let contact = planned.problem.contact.as_ref().unwrap();
        prop_assert!((contact.start_depth - deep).abs() < 1e-4, "{}", contact.start_depth);
        prop_assert_eq!(contact.goal_depth, 0.0);
        prop_assert!(planned.result.expansions <= BUDGET.max_expansions);
        if let Ok(path) = &planned.result.outcome {
            let file = PathFile::new(&scene, &planned.problem.frame, path, "test");
            let depths: Vec<f64> =
                file.poses.iter().map(|&p| depth(&scene, &obstacle, p.into())).collect();
            prop_assert!(only_left(&depths), "{:?}", depths);
            prop_assert!(oracle::measure(&scene, &file, None, ALLOWED).is_ok());
            // Who allows no contact finds one, and so does who allows less.
            prop_assert!(oracle::check(&scene, &file).is_err());
            prop_assert!(oracle::measure(&scene, &file, None, deep / 2.0).is_err() || deep < 1e-3);
            // Apart from the obstacle touched the path is as free as any.
            let mut others = scene.clone();
            others.obstacles.pop();
            prop_assert!(oracle::check(&others, &file).is_ok());
        }
    }

    /// The same backward: a goal in contact is only entered.
    #[test]
    fn a_contact_at_the_goal_is_only_entered(
        index in 0_u64..300, side in 0_usize..4, along in 0.0..1.0, deep in 0.001..0.049,
    ) {
        let mut scene = scene(index);
        let obstacle = box_at(&scene.vehicle, scene.goal, side, along, deep);
        prop_assume!(depth(&scene, &obstacle, scene.start) == 0.0);
        scene.obstacles.push(obstacle.clone());
        let planned = plan(&mut ha_rs(), &scene).unwrap();
        prop_assert!(planned.result.expansions <= BUDGET.max_expansions);
        if let Ok(path) = &planned.result.outcome {
            let file = PathFile::new(&scene, &planned.problem.frame, path, "test");
            let depths: Vec<f64> =
                file.poses.iter().rev().map(|&p| depth(&scene, &obstacle, p.into())).collect();
            prop_assert!(only_left(&depths), "{:?}", depths);
            prop_assert!(oracle::measure(&scene, &file, None, ALLOWED).is_ok());
        }
    }

    /// Scenes without contact are planned as if nobody had allowed any.
    #[test]
    fn where_nothing_is_touched_nothing_changes(index in 0_u64..300) {
        let scene = scene(index);
        let usual = goals::plan(&mut ha_rs(), &scene, Terms::default(), BUDGET).unwrap();
        let allowing = plan(&mut ha_rs(), &scene).unwrap();
        prop_assert!(allowing.problem.contact.is_none());
        prop_assert_eq!(usual.result.outcome, allowing.result.outcome);
        prop_assert_eq!(usual.result.expansions, allowing.result.expansions);
    }
}

#[test]
fn most_starts_in_contact_are_planned_out_of() {
    let (mut tried, mut found) = (0, 0);
    for index in 0..60 {
        let mut scene = scene(index);
        let side = index as usize % 4;
        let along = [0.1, 0.5, 0.9][index as usize % 3];
        scene.obstacles.push(box_at(&scene.vehicle, scene.start, side, along, 0.03));
        let Ok(planned) = plan(&mut ha_rs(), &scene) else { continue };
        tried += 1;
        found += u32::from(planned.result.outcome.is_ok());
    }
    println!("{found} of {tried}");
    assert!(tried > 50 && found * 10 > tried * 9, "{found} of {tried}");
}

/// Drives what it is told, and never looks where.
struct Blind(Vec<f64>);

impl Planner for Blind {
    fn name(&self) -> &str {
        "blind"
    }

    fn plan(&mut self, problem: &Problem, _: Budget) -> PlanResult {
        let segments = self.0.iter().map(|&length| Segment::straight(length)).collect();
        PlanResult::certified(problem, Path { start: problem.start, segments }, 1)
    }
}

/// A car at the origin with a wall 2 cm inside its nose, or its tail, that is to drive to `x`.
fn wall(nose: bool, x: f64) -> Scene {
    let vehicle = Vehicle::default();
    let body = vehicle.footprint(0.0);
    let at = if nose { body.max.x - 0.02 } else { body.min.x + 0.02 };
    let text = format!(
        r#"{{"vehicle": {}, "start": [0, 0, 0], "goal": [{x}, 0, 0],
            "obstacles": [[[{at}, -3], [{at}, 3]]]}}"#,
        serde_json::to_string(&vehicle).unwrap()
    );
    serde_json::from_str(&text).unwrap()
}

#[test]
fn no_planner_deepens_a_contact_or_returns_to_it() {
    let drive = |scene: &Scene, lengths: &[f64]| {
        let problem = Problem::allowing_contact(scene, 0.0, ALLOWED).unwrap();
        Blind(lengths.to_vec()).plan(&problem, BUDGET).outcome
    };
    let away = wall(true, -3.0);
    assert!(drive(&away, &[-3.0]).is_ok());
    // Back and forth, but free from the first metre on.
    assert!(drive(&away, &[-1.0, 0.9, -2.9]).is_ok());
    for wrong in [&[0.002, -3.002][..], &[-1.0, 0.99, -2.99], &[-0.01, 0.005, -2.995]] {
        assert_eq!(drive(&away, wrong), Err(NoPath::Uncertified), "{wrong:?}");
        let lengths = wrong.iter().map(|&l| Segment::straight(l)).collect();
        let path = Path { start: Pose::default(), segments: lengths };
        let file = PathFile::new(&away, &Frame::WORLD, &path, "test");
        assert!(oracle::measure(&away, &file, None, ALLOWED).is_err(), "{wrong:?}");
    }
    // Straight through is no way out.
    assert_eq!(drive(&wall(true, 9.0), &[9.0]), Err(NoPath::Uncertified));
    assert!(drive(&wall(false, 3.0), &[3.0]).is_ok());
}

#[test]
fn an_allowance_is_a_number_of_centimetres() {
    let scene = wall(true, -3.0);
    for wrong in [f64::NAN, -0.01, 0.21, f64::INFINITY] {
        let error = Problem::allowing_contact(&scene, 0.0, wrong).unwrap_err();
        assert!(matches!(error, ProblemError::Contact(_)), "{error}");
    }
    let error = Problem::allowing_contact(&scene, 0.0, 0.019).unwrap_err();
    assert!(error.to_string().contains("0.020 m into obstacles[0]"), "{error}");
    assert!(Problem::allowing_contact(&scene, 0.0, 0.021).is_ok());
}

fn n3p_plan(args: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("n3p-plan").expect("a binary of this crate");
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(["--scene", PILLAR]).args(args).assert()
}

#[test]
fn the_command_allows_contact_only_when_told() {
    let touches = || contains("start").and(contains("0.030 m into obstacles[8]"));
    n3p_plan(&[]).code(2).stderr(touches());
    n3p_plan(&["--allow-contact", "0"]).code(2).stderr(touches());
    n3p_plan(&["--allow-contact", "0.02"])
        .code(2)
        .stderr(touches().and(contains("--allow-contact 0.02 m is not enough")));
    n3p_plan(&["--allow-contact", "0.05"])
        .success()
        .stderr(contains("the start reaches 0.030 m into an obstacle"));
    let run = n3p_plan(&["--allow-contact", "0.05", "--json"]).success();
    let json: serde_json::Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert!((json["contact_m"]["start"].as_f64().unwrap() - 0.03).abs() < 1e-3, "{json}");
    assert_eq!(json["contact_m"]["goal"], 0.0);
    assert_eq!(json["row"]["checked"], "ok");
    for value in ["-0.1", "NaN", "inf", "0.3", "5cm", ""] {
        n3p_plan(&["--allow-contact", value])
            .code(2)
            .stderr(contains("--allow-contact").and(contains(format!("'{value}'"))));
    }
}

#[test]
fn an_evaluation_allows_it_too() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::copy(PILLAR, dir.path().join("pillar.json")).unwrap();
    let eval = |args: &[&str]| {
        let mut command = Command::cargo_bin("n3p-eval").expect("a binary of this crate");
        let command = command.args(["--methods", "ha-rs,mhha,ha", "--json", "--scenes"]);
        command.arg(dir.path()).args(args).assert()
    };
    eval(&[]).code(2).stderr(contains("into obstacles[8]"));
    let run = eval(&["--allow-contact", "0.05"]).success();
    let json: serde_json::Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    let rows = json["rows"].as_array().unwrap();
    assert!(rows.len() == 3 && rows.iter().all(|row| row["ok"] == true), "{rows:?}");
}

/// A tolerance only adds ways to arrive: a plan that touches at the goal is not given up for a goal
/// beside it to which none was found.
#[test]
fn a_path_into_contact_is_better_than_none_beside_it() {
    let little = Budget::new(60);
    let (mut found, mut plans) = (0, 0);
    for index in 0..24 {
        let mut exact = scene(index);
        let side = index as usize % 4;
        exact.obstacles.push(box_at(&exact.vehicle, exact.goal, side, 0.3, 0.02));
        let tolerance = GoalTolerance { position_m: 0.1, heading_rad: 0.0 };
        let wide = Scene { goal_tolerance: Some(tolerance), ..exact.clone() };
        let solved = |scene: &Scene| {
            let planned = goals::plan(&mut ha_rs(), scene, TERMS, little);
            planned.is_ok_and(|p| p.result.outcome.is_ok())
        };
        plans += 1;
        if solved(&exact) {
            found += 1;
            assert!(solved(&wide), "{index}");
        }
    }
    assert!(found > 0 && found < plans, "{found} of {plans} within a small budget");
}
