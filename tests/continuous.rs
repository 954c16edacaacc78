//! Continuous steering: paths without jumps of the steering angle, and what drives them.

#![cfg(feature = "lab")]

#[path = "fixtures/narrow.rs"]
mod narrow;

use std::path::Path as FilePath;

use assert_cmd::Command;
use n3p::curves::smoothing::{Smoothing, StandstillSteering, smooth};
use n3p::curves::trajectory::Moment;
use n3p::curves::{Clothoid, Path, Segment, SmoothPath, Trajectory, TrajectoryLimits, reeds_shepp};
use n3p::episode::{self, Case, EpisodeConfig};
use n3p::geometry::{Pose, Vec2, signed_angle};
use n3p::lab::driving::{DriveConfig, drive};
use n3p::lab::evaluation::oracle;
use n3p::n3p::{Method, MethodSettings, Models};
use n3p::planners::goals::{self, Terms};
use n3p::planners::{Budget, NoPath, Shape};
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use n3p::world::clutter::clutter;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::lots::lot;
use n3p::world::{Level, ParkingType, Scene};
use predicates::str::contains;
use proptest::prelude::*;
use rand::RngExt;

const BUDGET: Budget = Budget::new(200_000);

fn home(count: u64) -> Vec<Scene> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let settings = ParkingType::ALL.into_iter().flat_map(|k| Level::ALL.map(|l| (k, l)));
    let of = |(k, l)| (0..count).map(move |i| generate(&config, &vehicle, k, l, 61, i));
    settings.flat_map(of).collect()
}

fn terms(standstill: StandstillSteering) -> Terms {
    Terms { standstill, ..Terms::default() }
}

fn case(scene: Scene) -> Case {
    Case { kind: scene.parking_type, level: None, set: String::new(), scene }
}

/// Plans every scene with continuous steering; the oracle refuses none, and few have no such path.
fn check(method: Method, scenes: Vec<Scene>, standstill: StandstillSteering, most_without: usize) {
    let config =
        EpisodeConfig { terms: terms(standstill), repeats: 0, ..EpisodeConfig::new(BUDGET) };
    let mut without = Vec::new();
    for scene in scenes {
        let name = scene.name.clone();
        let models = Models::usual(&[method], Some(&scene.vehicle)).unwrap();
        let mut planner = method.build(&models, &MethodSettings::default()).unwrap();
        let case = case(scene);
        let Ok(episode) = episode::run(&case, planner.as_mut(), &config, &oracle::JUDGE) else {
            continue;
        };
        match &episode.result.outcome {
            Ok(_) => {}
            Err(NoPath::NotSmooth) => {
                without.push(name);
                continue;
            }
            // There is none with arcs either.
            Err(_) => continue,
        }
        assert!(episode.row.ok, "{method} {name}: {}", episode.row.checked);
        let path = episode.result.smooth.expect("what was asked for");
        assert_eq!(path.jumps(), 0, "{name}");
        let [_, at_changes] = path.turns_at_standstill();
        assert!(standstill == StandstillSteering::AtChanges || !at_changes, "{name}");
        let file = episode.path.unwrap();
        assert!(path.is_arcs() || file.steer_from.is_some(), "{name}");
    }
    assert!(without.len() <= most_without, "{method} {standstill}: {without:?}");
}

#[test]
fn at_home_every_path_is_continuous_and_the_oracle_agrees() {
    check(Method::N3P, home(6), StandstillSteering::AtChanges, 0);
    check(Method::N3P, home(4), StandstillSteering::Never, 2);
    check(Method::HA_RS, home(1), StandstillSteering::AtChanges, 1);
    check(Method::MHHA, home(1), StandstillSteering::AtChanges, 1);
    check(Method::HA, home(1), StandstillSteering::AtChanges, 2);
}

#[test]
fn in_lots_and_clutter_too_with_vehicles_of_any_size() {
    let kinds = [ParkingType::Forward, ParkingType::Parallel, ParkingType::Reverse];
    let lots =
        kinds.into_iter().flat_map(|k| (0..6).map(move |i| lot(&Vehicle::default(), k, 3, i)));
    check(Method::N3P, lots.collect(), StandstillSteering::AtChanges, 1);
    check(
        Method::HA_RS,
        (0..40).map(|i| clutter(8, i)).collect(),
        StandstillSteering::AtChanges,
        4,
    );
}

/// Into a parallel spot of 1 m more than the car, no path of arcs that was found can be made smooth where the wheels
/// must turn all the time.
#[test]
fn where_no_path_can_be_made_smooth_one_is_searched_for_that_is() {
    let scene = narrow::narrow_spot(narrow::in_the_lane(-9.0), narrow::parked());
    check(Method::N3P, vec![scene], StandstillSteering::Never, 0);
}

/// Any motions with continuous curvature between changes of gear, of a vehicle of any size.
fn smooth_paths() -> impl Strategy<Value = (SmoothPath, Vehicle)> {
    let lock = Vehicle::default().max_curvature();
    let part = (-lock..lock, 0.05..4.0, 0.0..2.0, any::<bool>());
    let start = (-9.0..9.0, -9.0..9.0, -3.0..3.0).prop_map(|(x, y, h)| Pose::new(x, y, h));
    let size = prop_oneof![Just(1.0), 0.05..4.0];
    (start, prop::collection::vec(part, 1..7), size).prop_map(
        |(start, parts, size): (Pose, _, f64)| {
            let (mut from, mut motions) = (0.0, Vec::new());
            let v = Vehicle::default();
            for (to, ramp, arc, backward) in parts {
                let sign = if backward { -size } else { size };
                motions.push(Clothoid { from: from / size, to: to / size, length: sign * ramp });
                motions.push(Clothoid { from: to / size, to: to / size, length: sign * arc });
                from = to;
            }
            let vehicle = Vehicle {
                length: v.length * size,
                width: v.width * size,
                wheelbase: v.wheelbase * size,
                rear_overhang: v.rear_overhang * size,
                ..v
            };
            (SmoothPath { start, begin: 0.0, motions }, vehicle)
        },
    )
}

/// Footprint corners in the world.
fn corners(vehicle: &Vehicle, pose: Pose) -> [Vec2; 4] {
    vehicle.footprint(0.0).corners().map(|c| pose.point_to_parent(c))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// The bound by which clothoids are swept as arcs.
    #[test]
    fn no_corner_is_farther_from_the_arcs_than_promised(
        (path, vehicle) in smooth_paths(), share in 1e-5..2e-3
    ) {
        let deviation: f64 = share * vehicle.length;
        let arcs = path.arcs(deviation, &vehicle);
        prop_assert!((arcs.length() - path.length()).abs() < 1e-9 * path.length().max(1.0));
        let steps = 997;
        let at = |legs: &[(f64, Pose, Clothoid)], along: f64| {
            let i = legs.partition_point(|(begin, ..)| *begin <= along).max(1) - 1;
            let (begin, from, motion) = legs[i];
            motion.at(from, (along - begin).min(motion.length.abs()).copysign(motion.length))
        };
        let placed = |path: &SmoothPath| {
            let mut along = 0.0;
            path.legs().map(|(from, motion)| {
                let leg = (along, from, motion);
                along += motion.length.abs();
                leg
            }).collect::<Vec<_>>()
        };
        let (exact, swept) = (placed(&path), placed(&SmoothPath::of(&arcs)));
        for i in 0..=steps {
            let along = path.length() * f64::from(i) / f64::from(steps);
            let [a, b] = [at(&exact, along), at(&swept, along)].map(|p| corners(&vehicle, p));
            for (a, b) in a.iter().zip(b) {
                prop_assert!((a - b).norm() <= deviation * (1.0 + 1e-6), "{} at {along}", (a - b).norm());
            }
        }
    }

    /// Whoever integrates the bicycle with the speed and the steering angle of a trajectory gets to its end.
    #[test]
    fn an_integrated_trajectory_ends_at_the_goal((path, vehicle) in smooth_paths()) {
        // Turned at standstill only: continuous from the start on, straight wheels there.
        let limits = TrajectoryLimits::of(&vehicle);
        let trajectory = Trajectory::new(&path, &vehicle, &limits).unwrap();
        integrates(&trajectory, &path, &vehicle, &limits)?;
    }
}

/// Integrates by Runge and Kutta what a trajectory says of speed and steering, and checks the limits.
fn integrates(
    trajectory: &Trajectory,
    path: &SmoothPath,
    vehicle: &Vehicle,
    limits: &TrajectoryLimits,
) -> Result<(), TestCaseError> {
    let moments = trajectory.sample(0.01);
    let mut state = path.start;
    let rate = |m: &Moment, heading: f64| {
        let (sin, cos) = heading.sin_cos();
        [m.speed * cos, m.speed * sin, m.speed * m.steer.tan() / vehicle.wheelbase]
    };
    for pair in moments.windows(2) {
        let dt = pair[1].time - pair[0].time;
        let [begin, middle, end] =
            [0.0, 0.5, 1.0 - 1e-9].map(|part| trajectory.at(pair[0].time + part * dt));
        let k1 = rate(&begin, state.heading);
        let k2 = rate(&middle, state.heading + k1[2] * dt / 2.0);
        let k3 = rate(&middle, state.heading + k2[2] * dt / 2.0);
        let k4 = rate(&end, state.heading + k3[2] * dt);
        let step = |i: usize| dt * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0;
        state = Pose::new(state.x + step(0), state.y + step(1), state.heading + step(2));
        let m = &pair[0];
        let allowed = 1.0 + 1e-6;
        prop_assert!(m.speed.abs() <= vehicle.speed(m.gear) * allowed, "{m:?}");
        prop_assert!(m.acceleration.abs() <= limits.acceleration(m.gear) * allowed + 1e-9, "{m:?}");
        let sideways = m.speed * m.speed * m.curvature.abs();
        prop_assert!(sideways <= limits.lateral_acceleration * allowed, "{m:?}");
        let turned = (pair[1].steer - m.steer).abs();
        let jumps = m.speed == 0.0 || pair[1].speed == 0.0 || m.gear != pair[1].gear;
        prop_assert!(
            jumps || turned <= limits.steer_rate * dt * allowed + 1e-9,
            "{m:?} {turned} {dt}"
        );
        prop_assert!(m.steer.abs() <= vehicle.max_steer * allowed, "{m:?}");
    }
    let end = path.end();
    let off = state.distance(end) / vehicle.scale().max(1.0);
    prop_assert!(off < 1e-3, "{off} m off");
    prop_assert!(signed_angle(state.heading, end.heading).abs() < 1e-3);
    Ok(())
}

/// Curves of Reeds and Shepp between random poses, made smooth: exactly to the goal, without a jump, nowhere
/// beyond the limit of curvature, and the same in any unit of length.
#[test]
fn smoothed_curves_end_where_they_did() {
    let mut rng = rng(3, Stream::Start, 0);
    let (mut fitted, mut all) = (0, 0);
    for i in 0..4000 {
        let mut r = |a: f64| rng.random_range(-a..a);
        let scale = [1.0, 0.08, 3.5][i % 3];
        let radius = 4.0 * scale;
        let (from, to) = (
            Pose::new(r(9.0) * scale, r(9.0) * scale, r(3.0)),
            Pose::new(r(9.0) * scale, r(9.0) * scale, r(3.0)),
        );
        let mut words = Vec::new();
        reeds_shepp::words(from, to, radius, &mut words);
        let word = words.iter().min_by(|a, b| a.length().total_cmp(&b.length())).unwrap();
        let path = Path::new(from, word.segments().iter().copied());
        let sharpness = [8.0 / (radius * radius), 30.0 / (radius * radius)];
        for turned_at_changes in [true, false] {
            let smoothing = Smoothing {
                begin: 0.0,
                turned_at_start: false,
                turned_at_changes,
                sharpness: &sharpness,
                last_straight: None,
            };
            all += 1;
            let Some(smoothed) = smooth(&path, to, &smoothing) else { continue };
            fitted += 1;
            let end = smoothed.end();
            assert!(end.distance(to) < 1e-8 && signed_angle(end.heading, to.heading).abs() < 1e-8);
            assert_eq!(smoothed.jumps(), 0);
            assert!(!smoothed.turns_at_standstill()[0]);
            assert!(turned_at_changes || !smoothed.turns_at_standstill()[1]);
            for motion in &smoothed.motions {
                assert!(motion.max_abs_curvature() <= (1.0 + 1e-9) / radius, "{motion:?}");
                assert!(motion.sharpness() <= sharpness[1] * (1.0 + 1e-6), "{motion:?}");
            }
        }
    }
    assert!(fitted * 10 > all * 9, "{fitted} of {all}");
}

#[test]
fn straight_ahead_is_driven_as_it_is() {
    let path = Path::new(Pose::new(1.0, 2.0, 0.5), [Segment::straight(7.0)]);
    let smoothing = Smoothing {
        begin: 0.0,
        turned_at_start: false,
        turned_at_changes: true,
        sharpness: &[0.2],
        last_straight: None,
    };
    assert_eq!(smooth(&path, path.end(), &smoothing), Some(SmoothPath::of(&path)));
    let nothing = Path::new(Pose::default(), []);
    assert_eq!(smooth(&nothing, nothing.end(), &smoothing), Some(SmoothPath::of(&nothing)));
}

/// What a few paths of each kind ask for is kept whatever the errors: the same every time, and parked.
#[test]
fn continuous_paths_are_driven_into_their_spots() {
    let models = Models::usual(&[Method::N3P], Some(&Vehicle::default())).unwrap();
    let mut planner = Method::N3P.build(&models, &MethodSettings::default()).unwrap();
    let keeping = Terms { margin: 0.1, ..terms(StandstillSteering::AtChanges) };
    let config = EpisodeConfig { terms: keeping, repeats: 0, ..EpisodeConfig::new(BUDGET) };
    let noise = DriveConfig::default();
    let mut beside = Vec::new();
    for scene in home(1) {
        let case = case(scene);
        let episode = episode::run(&case, planner.as_mut(), &config, &oracle::JUDGE).unwrap();
        let driven = drive(&case, &episode, &noise).unwrap();
        assert_eq!(driven.row, drive(&case, &episode, &noise).unwrap().row);
        assert!(driven.row.is_parked(), "{:?}", driven.row);
        assert!(driven.row.time_s >= driven.row.planned_time_s);
        beside.push(driven.row.deviation_m);
        let other = drive(&case, &episode, &DriveConfig { seed: 2, ..noise }).unwrap();
        assert_ne!(other.row, driven.row, "errors are those of the seed");
    }
    assert!(beside.iter().all(|&b| b > 0.0 && b < 0.03), "{beside:?}");
}

#[test]
fn goals_with_a_tolerance_are_reached_smoothly_too() {
    let mut scene = generate(
        &GeneratorConfig::default(),
        &Vehicle::default(),
        ParkingType::Reverse,
        Level::Easy,
        61,
        3,
    );
    scene.goal_tolerance = Some(n3p::world::GoalTolerance { position_m: 0.2, heading_rad: 0.05 });
    let models = Models::usual(&[Method::N3P], Some(&scene.vehicle)).unwrap();
    let mut planner = Method::N3P.build(&models, &MethodSettings::default()).unwrap();
    let terms = terms(StandstillSteering::AtChanges);
    let planned = goals::plan(planner.as_mut(), &scene, terms, BUDGET).unwrap();
    let path = planned.result.smooth.unwrap();
    assert!(planned.problem.is_arrival(path.end()));
}

/// Moves between changes of gear, metres.
fn moves(path: &SmoothPath) -> Vec<f64> {
    let runs = path.motions.chunk_by(|a, b| a.gear() == b.gear());
    runs.map(|run| run.iter().map(|m| m.length.abs()).sum()).collect()
}

/// Where there is room, moves are as long and ends as straight as was asked for; where there is none, there
/// is still a path.
#[test]
fn moves_are_long_and_ends_are_straight_where_there_is_room() {
    let models = Models::usual(&[Method::N3P], Some(&Vehicle::default())).unwrap();
    let mut planner = Method::N3P.build(&models, &MethodSettings::default()).unwrap();
    let mut counts = [[0; 3]; 2];
    for scene in home(8) {
        for (i, shape) in [Shape::ANY, Shape::default()].into_iter().enumerate() {
            let terms = Terms { shape, ..terms(StandstillSteering::AtChanges) };
            let planned = goals::plan(planner.as_mut(), &scene, terms, BUDGET).unwrap();
            let Some(path) = planned.result.smooth else { continue };
            let last = path.motions.last().unwrap();
            let straight = if last.from == 0.0 && last.to == 0.0 { last.length.abs() } else { 0.0 };
            counts[i][0] += 1;
            counts[i][1] += usize::from(moves(&path).iter().any(|&m| m < 0.28));
            counts[i][2] += usize::from(straight >= 0.5 - 1e-9);
        }
    }
    let [[all, short, straight], [all_shaped, short_shaped, straight_shaped]] = counts;
    assert!(all >= 95 && all_shaped == all, "{counts:?}");
    assert!(short_shaped * 2 <= short, "{counts:?}");
    assert!(straight_shaped > 3 * straight && straight_shaped * 2 > all, "{counts:?}");
}

#[test]
fn preferences_are_kept_in_the_one_model_of_costs() {
    let dir = tempfile::tempdir().unwrap();
    let changes = |weight: &str| {
        let out = plan(dir.path(), &["--method", "ha-rs", "--json", "--cost", weight]).assert();
        let json: serde_json::Value = serde_json::from_slice(&out.get_output().stdout).unwrap();
        json["row"]["direction_changes"].as_u64().unwrap()
    };
    assert!(changes("gear_change=30") <= changes("gear_change=0"));
    for (weight, why) in [
        ("gear_change", "WEIGHT=NUMBER"),
        ("gear_change=x", "WEIGHT=NUMBER"),
        ("gears=1", "unknown field `gears`"),
        ("gear_change=-1", "cost.gear_change is -1"),
        ("gear_change=NaN", "--cost"),
    ] {
        plan(dir.path(), &["--cost", weight]).assert().code(2).stderr(contains(why));
    }
    for length in ["-1", "NaN", "9"] {
        for flag in ["--least-move", "--last-straight"] {
            plan(dir.path(), &[flag, length]).assert().code(2).stderr(contains("0 and 5 metres"));
        }
    }
}

fn plan(dir: &FilePath, args: &[&str]) -> Command {
    let scene = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/parallel.json");
    let mut command = Command::cargo_bin("n3p-plan").expect("a binary of this crate");
    command.current_dir(dir).arg("--scene").arg(scene).args(args);
    command
}

fn json(file: &FilePath) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

#[test]
fn the_command_line_asks_for_it_and_trajectories_have_it_by_default() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| dir.path().join(name);
    plan(dir.path(), &["--out", "arcs.json"]).assert().success();
    assert!(json(&file("arcs.json")).get("steer_from").is_none(), "paths are arcs by default");
    for asked in ["never", "at-changes"] {
        plan(dir.path(), &["--out", "p.json", "--standstill-steering", asked]).assert().success();
        let path = json(&file("p.json"));
        let column =
            |name: &str| -> Vec<f64> { serde_json::from_value(path[name].clone()).unwrap() };
        let (from, to, gears) = (column("steer_from"), column("steer_to"), column("gears"));
        assert_eq!(from.len(), path["poses"].as_array().unwrap().len());
        for i in 1..from.len() {
            let goes_on = gears[i] == gears[i - 1] || asked == "never";
            assert!(!goes_on || (to[i - 1] - from[i]).abs() < 1e-6, "{asked}: a jump at {i}");
        }
    }
    plan(dir.path(), &["--trajectory", "t.json", "--out", "p.json"]).assert().success();
    assert!(json(&file("p.json")).get("steer_from").is_some());
    let report = &json(&file("t.json"))["report"];
    assert_eq!(report["steer_rate_kept"], true);
    assert!(report["max_steer_rate_radps"].as_f64().unwrap() <= 0.6 + 1e-9, "{report}");
    let bad = plan(dir.path(), &["--standstill-steering", "sometimes"]).assert();
    bad.code(2).stderr(contains("never, at-changes or anywhere"));
}
