//! Several goals and goal tolerances: the cheapest is taken, whatever the order, and none is dearer.

#![cfg(feature = "lab")]

use std::f64::consts::FRAC_PI_2;
use std::path::Path as FilePath;

use assert_cmd::Command;
use n3p::curves::{Path, Segment};
use n3p::episode;
use n3p::episode::{Case, EpisodeConfig};
use n3p::geometry::{Pose, signed_angle};
use n3p::lab::evaluation::oracle;
use n3p::output::PathFile;
use n3p::planners::cost::CostModel;
use n3p::planners::goals::{self, Planned, Terms};
use n3p::planners::{
    Budget, HybridAStar, HybridAStarConfig, NoPath, PlanResult, Planner, Problem, ProblemError,
};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{GoalTolerance, Level, ParkingType, Scene};
use predicates::prelude::*;
use predicates::str::contains;
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assert_eq, proptest};

const BUDGET: Budget = Budget::new(20_000);

fn fixture(name: &str) -> Scene {
    let dir = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/goals");
    Scene::read(&dir.join(name)).unwrap()
}

fn plan(scene: &Scene) -> Result<Planned, ProblemError> {
    let mut planner = HybridAStar::new(HybridAStarConfig::default());
    goals::plan(&mut planner, scene, Terms::default(), BUDGET)
}

fn cost(planned: &Planned) -> f64 {
    let vehicle = &planned.problem.vehicle;
    let model = CostModel::default().scaled(vehicle.scale());
    let path = planned.result.outcome.as_ref();
    path.map_or(f64::INFINITY, |path| model.path(vehicle, &path.segments))
}

/// The end of a plan in the world.
fn end(planned: &Planned) -> Option<Pose> {
    let path = planned.result.outcome.as_ref().ok()?;
    Some(planned.problem.frame.world_from_local(path.end()))
}

/// A generated scene with goals beside its own, some of which are in the neighbours.
fn with_goals(index: u64, moves: &[(f64, f64, bool)]) -> Scene {
    let kind = ParkingType::SQUARE[index as usize % 3];
    let config = GeneratorConfig::default();
    let scene = generate(&config, &Vehicle::default(), kind, Level::Easy, 314, index);
    let around = |&(along, across, turned): &(f64, f64, bool)| {
        let turn = if turned { FRAC_PI_2 } else { 0.0 };
        scene.goal.compose(Pose::new(along, across, turn))
    };
    let mut goals = vec![scene.goal];
    goals.extend(moves.iter().map(around));
    Scene { goals, parking_type: None, ..scene }
}

fn moves() -> impl proptest::strategy::Strategy<Value = Vec<(f64, f64, bool)>> {
    proptest::collection::vec((-3.0..8.0, -6.0..6.0, any::<bool>()), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    /// Each goal alone is planned to as well: the choice costs as much as the cheapest of them.
    #[test]
    fn the_cheapest_goal_is_taken(index in 0_u64..300, moves in moves()) {
        let scene = with_goals(index, &moves);
        let chosen = plan(&scene).unwrap();
        let alone: Vec<_> =
            scene.goals.iter().map(|&goal| plan(&scene.with_goal(goal)).ok()).collect();
        let costs: Vec<f64> =
            alone.iter().map(|p| p.as_ref().map_or(f64::INFINITY, cost)).collect();
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        prop_assert_eq!(cost(&chosen), least);
        if least.is_finite() {
            prop_assert_eq!(chosen.goal_index, costs.iter().position(|&c| c == least).unwrap());
            let own = alone[chosen.goal_index].as_ref().unwrap();
            prop_assert_eq!(&own.result.outcome, &chosen.result.outcome);
        }
    }

    #[test]
    fn the_order_of_the_goals_does_not_matter(
        index in 0_u64..300, moves in moves(), first in 0_usize..4,
    ) {
        let scene = with_goals(index, &moves);
        let mut other = scene.clone();
        other.goals.reverse();
        let middle = first % other.goals.len();
        other.goals.rotate_left(middle);
        other.goal = other.goals[0];
        let (one, two) = (plan(&scene).unwrap(), plan(&other).unwrap());
        prop_assert_eq!(&one.result.outcome.clone().ok(), &two.result.outcome.clone().ok());
        if one.result.outcome.is_ok() {
            prop_assert_eq!(scene.goals[one.goal_index], other.goals[two.goal_index]);
        }
    }

    /// With a tolerance a plan costs no more than without, and ends where it may.
    #[test]
    fn a_tolerance_never_makes_a_plan_dearer(
        index in 0_u64..300, position_m in 0.0..0.4, heading_rad in 0.0..0.2,
    ) {
        let scene = with_goals(index, &[]);
        let exact = plan(&scene).unwrap();
        let tolerance = GoalTolerance { position_m, heading_rad };
        let tolerant = Scene { goal_tolerance: Some(tolerance), ..scene.clone() };
        let near = plan(&tolerant).unwrap();
        prop_assert!(cost(&near) <= cost(&exact) + 1e-9, "{} {}", cost(&near), cost(&exact));
        if let Some(end) = end(&near) {
            let apart = (scene.goal.distance(end), signed_angle(scene.goal.heading, end.heading));
            prop_assert!(apart.0 <= position_m + 2e-6 && apart.1.abs() <= heading_rad + 2e-6);
            let path = near.result.outcome.as_ref().unwrap();
            let file = PathFile::new(&tolerant, &near.problem.frame, path, "test");
            prop_assert!(oracle::check(&tolerant, &file).is_ok());
            // Who asks for the exact goal does not get it.
            let strict = oracle::check(&scene, &file);
            prop_assert_eq!(strict.is_ok(), apart.0 <= 1e-6 && apart.1.abs() <= 1e-6);
        }
    }

    #[test]
    fn no_tolerance_and_a_tolerance_of_nothing_are_the_same(index in 0_u64..300) {
        let scene = with_goals(index, &[]);
        let none = Scene { goal_tolerance: Some(GoalTolerance::default()), ..scene.clone() };
        prop_assert_eq!(plan(&scene).unwrap().result.outcome, plan(&none).unwrap().result.outcome);
    }

    /// One goal in a list is planned to like a goal.
    #[test]
    fn a_list_of_one_goal_is_that_goal(index in 0_u64..300) {
        let list = with_goals(index, &[]);
        let goal = list.with_goal(list.goal);
        let (one, two) = (plan(&list).unwrap(), plan(&goal).unwrap());
        prop_assert_eq!(one.result.outcome, two.result.outcome);
        prop_assert_eq!(one.result.expansions, two.result.expansions);
    }
}

#[test]
fn equal_goals_are_taken_by_their_index() {
    let scene = with_goals(3, &[]);
    let goals = vec![scene.goal; 3];
    assert_eq!(plan(&Scene { goals, ..scene }).unwrap().goal_index, 0);
}

#[test]
fn who_stands_within_the_tolerance_stays() {
    let scene = fixture("neighbour-over-the-line.json");
    let tolerance = scene.goal_tolerance.unwrap();
    let start = scene.goal.compose(Pose::new(0.06, 0.01 - tolerance.position_m / 2.0, -0.02));
    let scene = Scene { start, ..scene };
    let planned = plan(&scene).unwrap();
    assert!(planned.result.outcome.as_ref().unwrap().segments.is_empty(), "{planned:?}");
    assert_eq!(planned.result.expansions, 0, "nothing is searched for");
    let beyond = GoalTolerance { heading_rad: 0.01, ..tolerance };
    let planned = plan(&Scene { goal_tolerance: Some(beyond), ..scene }).unwrap();
    assert!(cost(&planned) > 0.0);
}

#[test]
fn a_goal_that_is_not_free_is_reached_within_its_tolerance() {
    let scene = fixture("neighbour-over-the-line.json");
    let exact = Scene { goal_tolerance: None, ..scene.clone() };
    assert!(matches!(plan(&exact), Err(ProblemError::GoalInCollision(..))));
    let planned = plan(&scene).unwrap();
    assert!(end(&planned).unwrap().distance(scene.goal) > 0.02);
}

/// Drives straight ahead, however far it is told, and never looks where.
struct Ahead(f64);

impl Planner for Ahead {
    fn name(&self) -> &str {
        "ahead"
    }

    fn plan(&mut self, problem: &Problem, _: Budget) -> PlanResult {
        let path = Path::new(problem.start, [Segment::straight(self.0)]);
        PlanResult::certified(problem, path, 1)
    }
}

#[test]
fn no_planner_ends_beyond_the_tolerance() {
    let tolerance = Some(GoalTolerance { position_m: 0.1, heading_rad: 0.0 });
    let open = Scene {
        start: Pose::default(),
        goal: Pose::new(5.0, 0.0, 0.0),
        obstacles: vec![],
        goal_tolerance: tolerance,
        parking_type: None,
        ..with_goals(0, &[]).with_goal(Pose::default())
    };
    let open = Scene { bounds: None, ..open };
    let plan = |metres, scene: &Scene| {
        goals::plan(&mut Ahead(metres), scene, Terms::default(), BUDGET).unwrap().result.outcome
    };
    for metres in [4.8, 5.2] {
        assert_eq!(plan(metres, &open), Err(NoPath::Uncertified));
    }
    // Within it a path is ended as soon as it may be.
    for metres in [4.91, 5.0, 5.09] {
        let length = plan(metres, &open).unwrap().length();
        assert!((length - 4.905).abs() < 0.01, "{metres}: {length}");
    }
    assert_eq!(
        plan(4.91, &Scene { goal_tolerance: None, ..open.clone() }),
        Err(NoPath::Uncertified)
    );
}

#[test]
fn scenes_with_goals_are_read_as_they_were_written() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["three-bays.json", "neighbour-over-the-line.json"] {
        let scene = fixture(name);
        scene.write(&dir.path().join(name)).unwrap();
        assert_eq!(Scene::read(&dir.path().join(name)).unwrap(), scene);
    }
}

/// `n3p-plan --method ha-rs` on the text of a scene.
fn n3p_plan(text: &str, args: &[&str]) -> assert_cmd::assert::Assert {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.json"), text).unwrap();
    let mut command = Command::cargo_bin("n3p-plan").expect("a binary of this crate");
    let command = command.current_dir(dir.path()).args(["--scene", "s.json", "--method", "ha-rs"]);
    command.args(args).assert()
}

const GOALS: &str = "[[8.1, -1.385, 1.5707963267948966], [0, -1.385, 1.5707963267948966], \
                     [-5.4, -1.385, 1.5707963267948966]]";

fn three_bays(goals: &str) -> String {
    let text = serde_json::to_string(&fixture("three-bays.json")).unwrap();
    let (begin, end) = (text.find("\"goals\"").unwrap(), text.find("\"parking_type\"").unwrap());
    format!("{}{goals}, {}", &text[..begin], &text[end..])
}

#[test]
fn the_goal_taken_is_named_and_drawn() {
    let text = three_bays(&format!("\"goals\": {GOALS}"));
    let run = n3p_plan(&text, &["--json"]).success().stderr(
        contains("goals[1], the cheapest of 3")
            .and(contains("goals[2] is left out").and(contains("into obstacles["))),
    );
    let json: serde_json::Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert_eq!((&json["goal_index"], &json["row"]["ok"]), (&1.into(), &true.into()));
    let last = json["path"]["poses"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(serde_json::from_value::<Pose>(last).unwrap(), fixture("three-bays.json").goals[1]);
    n3p_plan(&text, &[]).success().stdout(contains("goal              goals[1]"));
    let dir = tempfile::tempdir().unwrap();
    let svg = dir.path().join("out.svg");
    n3p_plan(&text, &["--svg", svg.to_str().unwrap()]).success();
    assert!(std::fs::read_to_string(svg).unwrap().contains("other goals"));
}

#[test]
fn a_scene_without_goals_to_choose_from_names_none() {
    let text = three_bays("\"goal\": [0, -1.385, 1.5707963267948966]");
    let run = n3p_plan(&text, &["--json"]).success();
    let json: serde_json::Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert!(json["goal_index"].is_null() && json["contact_m"].is_null());
}

#[test]
fn without_any_goal_to_drive_to_there_is_no_path() {
    let taken = |x: f64| format!("[{x}, -1.385, 1.5707963267948966]");
    let goals = format!("\"goals\": [{}, {}]", taken(-5.4), taken(2.7));
    n3p_plan(&three_bays(&goals), &[]).code(2).stderr(
        contains("no goal is free").and(contains("goals[0]: ")).and(contains("goals[1]: ")),
    );
    // Beyond the wall.
    let goals = format!("\"goals\": [{}, [0, 14, 0], [5, 14, 0]]", taken(-5.4));
    n3p_plan(&three_bays(&goals), &["--max-expansions", "5"])
        .code(3)
        .stderr(contains("goals[0] is left out").and(contains("goals[1] is left out: ")));
}

#[test]
fn what_are_no_goals_is_refused_by_field_and_value() {
    let pose = "[0, -1.385, 1.57]";
    let many = vec![pose; 257].join(",");
    for (field, parts) in [
        (String::new(), ["goal", "goals"]),
        (format!("\"goal\": {pose}, \"goals\": [{pose}]"), ["both goal and goals", "leave one"]),
        ("\"goals\": []".to_owned(), ["goals is []", "at least one pose"]),
        ("\"goals\": 7".to_owned(), ["goals is 7", "list of poses"]),
        (format!("\"goals\": {{\"a\": {pose}}}"), ["goals is {", "list of poses"]),
        (format!("\"goals\": [{pose}, [1, 2]]"), ["goals[1] is [1,2]", "3 finite numbers"]),
        (format!("\"goals\": [{pose}, \"x\"]"), ["goals[1] is \"x\"", "3 finite numbers"]),
        (format!("\"goals\": [{pose}, [NaN, 2, 3]]"), ["goals", "not a number"]),
        (format!("\"goals\": [{pose}, [1e12, 2, 3]]"), ["goals[1]", "too large"]),
        (format!("\"goals\": [{pose}, [3e4, 2, 3]]"), ["from goals[1]", "at most 10000 m"]),
        (format!("\"goals\": [{many}]"), ["goals has 257 poses", "at most 256"]),
    ] {
        let field = if field.is_empty() { "\"points\": []".to_owned() } else { field };
        let run = n3p_plan(&three_bays(&field), &[]).code(2);
        let stderr = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
        let parts = parts.iter().all(|part| stderr.contains(part));
        assert!(parts && stderr.contains("s.json"), "{field}: {stderr}");
        assert_eq!(stderr.trim().lines().count(), 1, "{stderr}");
    }
}

#[test]
fn what_is_no_tolerance_is_refused_by_field_and_value() {
    for (value, parts) in [
        ("7", ["goal_tolerance is 7", "position_m"]),
        ("true", ["goal_tolerance is true", "heading_rad"]),
        ("{\"position_m\": \"a\"}", ["goal_tolerance.position_m is \"a\"", "finite number"]),
        ("{\"position_m\": NaN}", ["position_m", "not a number"]),
        ("{\"position_m\": -0.1}", ["goal_tolerance.position_m is -0.1", "from 0 to 1 m"]),
        ("{\"position_m\": 1.5}", ["goal_tolerance.position_m is 1.5", "from 0 to 1 m"]),
        ("{\"heading_rad\": 2}", ["goal_tolerance.heading_rad is 2", "from 0 to 0.5 rad"]),
        ("{\"heading\": 0.1}", ["goal_tolerance.heading is unknown", "heading_rad"]),
    ] {
        let field = format!("\"goals\": {GOALS}, \"goal_tolerance\": {value}");
        let run = n3p_plan(&three_bays(&field), &[]).code(2);
        let stderr = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
        let parts = parts.iter().all(|part| stderr.contains(part));
        assert!(parts && stderr.contains("s.json"), "{value}: {stderr}");
        assert_eq!(stderr.trim().lines().count(), 1, "{stderr}");
    }
}

#[test]
fn an_evaluation_plans_to_the_cheapest_goal() {
    let scene = fixture("three-bays.json");
    let set = String::new();
    let case = Case { scene: scene.clone(), kind: scene.parking_type, level: None, set };
    let mut planner = HybridAStar::new(HybridAStarConfig::default());
    let config = EpisodeConfig::new(BUDGET);
    let episode = episode::run(&case, &mut planner, &config, &oracle::JUDGE).unwrap();
    assert!(episode.row.ok && episode.goal_index == 1, "{:?}", episode.row);
    // The whole scene accepts the path as well.
    assert!(oracle::check(&scene, &episode.path.unwrap()).is_ok());
    let dir = tempfile::tempdir().unwrap();
    scene.write(&dir.path().join("three-bays.json")).unwrap();
    let mut command = Command::cargo_bin("n3p-eval").expect("a binary of this crate");
    let command = command.args(["--methods", "ha-rs,mhha", "--scenes"]).arg(dir.path());
    command.arg("--json").assert().success().stdout(contains("\"ok\": true"));
}
