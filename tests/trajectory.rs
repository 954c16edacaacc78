//! Trajectories: the laws they keep, and the files that `n3p-plan` writes.

#![cfg(feature = "lab")]

use std::path::Path as FilePath;

use assert_cmd::Command;
use n3p::curves::trajectory::Moment;
use n3p::curves::{Clothoid, SmoothPath, Trajectory, TrajectoryLimits};
use n3p::geometry::{Pose, signed_angle};
use n3p::vehicle::{Gear, Vehicle};
use n3p::world::Scene;
use predicates::prelude::*;
use predicates::str::contains;
use proptest::prelude::*;

/// What rounding may add up to, in any unit.
const ROUNDING: f64 = 1e-9;

fn vehicles() -> impl Strategy<Value = Vehicle> {
    (0.1..5.0, 0.1..5.0).prop_map(|(forward_speed, backward_speed)| Vehicle {
        forward_speed,
        backward_speed,
        ..Vehicle::default()
    })
}

fn limits() -> impl Strategy<Value = TrajectoryLimits> {
    let accelerations = (0.1..5.0, 0.1..5.0, 0.2..5.0);
    let limits = (accelerations, 0.2..20.0, 0.1..2.0, any::<bool>());
    limits.prop_map(|((forward, backward, lateral), jerk, rate, stop)| TrajectoryLimits {
        forward_acceleration: forward,
        backward_acceleration: backward,
        lateral_acceleration: lateral,
        jerk,
        steer_rate: rate,
        stop_to_steer: stop,
    })
}

/// Paths with straights, full locks, clothoids and anything between, some motions a millimetre long.
fn paths() -> impl Strategy<Value = SmoothPath> {
    let lock = Vehicle::default().max_curvature();
    let curvature = move || prop_oneof![Just(0.0), Just(lock), Just(-lock), -lock..lock];
    let length = (prop_oneof![Just(1e-3), 0.01..8.0], any::<bool>())
        .prop_map(|(length, backward)| if backward { -length } else { length });
    let motion = (curvature(), prop::option::of(curvature()), length);
    // No wheel turns from lock to lock within a centimetre.
    let motion = motion.prop_map(|(from, to, length): (f64, Option<f64>, f64)| {
        let to = to.filter(|_| length.abs() > 0.02).unwrap_or(from);
        Clothoid { from, to, length }
    });
    let start = (-9.0..9.0, -9.0..9.0, -3.0..3.0).prop_map(|(x, y, h)| Pose::new(x, y, h));
    let paths = (start, prop::collection::vec(motion, 1..9));
    paths.prop_map(|(start, motions)| SmoothPath { start, begin: 0.0, motions })
}

/// The pose after `distance` metres of `path`.
fn on_path(path: &SmoothPath, distance: f64) -> Pose {
    let mut left = distance;
    for (from, motion) in path.legs() {
        if left <= motion.length.abs() {
            return motion.at(from, left.copysign(motion.length));
        }
        left -= motion.length.abs();
    }
    path.end()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_trajectory_drives_its_path_within_the_limits(
        path in paths(), vehicle in vehicles(), limits in limits()
    ) {
        let trajectory = Trajectory::new(&path, &vehicle, &limits).unwrap();
        let moments = trajectory.sample(0.05);
        let (first, last) = (moments[0], moments[moments.len() - 1]);
        prop_assert!(first.time == 0.0 && last.time == trajectory.end().time && last.time > 0.0);
        prop_assert!(first.speed == 0.0 && last.speed == 0.0 && last.acceleration == 0.0);
        prop_assert!((last.distance - path.length()).abs() < ROUNDING);
        for m in &moments {
            let speed = m.speed * m.gear.sign();
            prop_assert!((0.0..=vehicle.speed(m.gear) + ROUNDING).contains(&speed), "{m:?}");
            let limit = limits.acceleration(m.gear);
            prop_assert!(m.acceleration.abs() <= limit + ROUNDING, "{m:?}");
            let sideways = m.speed * m.speed * m.curvature.abs();
            prop_assert!(sideways <= limits.lateral_acceleration + ROUNDING, "{m:?}");
            let expected = on_path(&path, m.distance);
            prop_assert!(m.pose.distance(expected) < ROUNDING, "{m:?} instead of {expected:?}");
            let turn = signed_angle(m.pose.heading, expected.heading).abs();
            prop_assert!(turn < ROUNDING, "{m:?} instead of {expected:?}");
            prop_assert!((vehicle.steer(m.curvature) - m.steer).abs() < ROUNDING);
        }
        for pair in moments.windows(2) {
            lawful(pair[0], pair[1], &limits)?;
        }
    }

    #[test]
    fn a_report_says_what_the_samples_show(
        path in paths(), vehicle in vehicles(), limits in limits()
    ) {
        let trajectory = Trajectory::new(&path, &vehicle, &limits).unwrap();
        let moments = trajectory.sample(0.01);
        let report = trajectory.report();
        let largest = |value: fn(&Moment) -> f64| moments.iter().map(value).fold(0.0, f64::max);
        for (reported, sampled) in [
            (report.duration_s, largest(|m| m.time)),
            (report.distance_m, largest(|m| m.distance)),
            (report.max_forward_speed_mps, largest(|m| m.speed)),
            (report.max_backward_speed_mps, largest(|m| -m.speed)),
            (report.max_acceleration_mps2, largest(|m| m.acceleration.abs())),
        ] {
            prop_assert!((reported - sampled).abs() < ROUNDING, "{reported}, {sampled}");
        }
        // Before a jump the old angle still counts: the samples show no more than the report.
        let sideways = largest(|m| m.speed * m.speed * m.curvature.abs());
        prop_assert!(report.max_lateral_acceleration_mps2 >= sideways - ROUNDING);
        prop_assert!(report.max_lateral_acceleration_mps2 <= limits.lateral_acceleration + ROUNDING);
        prop_assert!(report.max_abs_steer_rad >= largest(|m| m.steer.abs()) - ROUNDING);
        prop_assert!(report.max_jerk_mps3 <= limits.jerk + ROUNDING);
        prop_assert!(report.max_steer_rate_radps <= limits.steer_rate + ROUNDING);
        let stands = |w: &&[Moment]| w[0].distance == w[1].distance;
        let standing: f64 =
            moments.windows(2).filter(stands).map(|w| w[1].time - w[0].time).sum();
        prop_assert!((report.standing_s - standing).abs() < 1e-6);
        prop_assert!(report.stops >= path.direction_changes());
        prop_assert_eq!(report.steer_rate_kept, report.steer_jumps.is_empty());
        for jump in &report.steer_jumps {
            let after = trajectory.at(jump.time_s);
            prop_assert!((after.steer - jump.to_rad).abs() < ROUNDING);
            prop_assert!((after.distance - jump.distance_m).abs() < ROUNDING);
            prop_assert!(after.speed != 0.0, "a jump at standstill: {jump:?}");
        }
    }

    #[test]
    fn stopping_to_steer_takes_longer_and_leaves_no_jump(
        path in paths(), vehicle in vehicles(), limits in limits()
    ) {
        let of = |stop_to_steer| {
            let limits = TrajectoryLimits { stop_to_steer, ..limits };
            Trajectory::new(&path, &vehicle, &limits).unwrap().report()
        };
        let (driving, stopping) = (of(false), of(true));
        prop_assert!(stopping.steer_rate_kept);
        prop_assert_eq!(driving.stops, path.direction_changes());
        prop_assert_eq!(stopping.stops, driving.stops + driving.steer_jumps.len());
        let longer = driving.duration_s + driving.steer_jump_dwell_s;
        prop_assert!(stopping.duration_s >= longer - ROUNDING);
    }
}

/// What holds from one sample to the next.
fn lawful(a: Moment, b: Moment, limits: &TrajectoryLimits) -> Result<(), TestCaseError> {
    let dt = b.time - a.time;
    prop_assert!(dt > 0.0 && dt <= 0.05 * 1.02 + ROUNDING, "{a:?} {b:?}");
    prop_assert!(b.distance >= a.distance - ROUNDING, "{a:?} {b:?}");
    // With a jerk that is constant, and within its limit, speed and distance follow. What takes less than a
    // tenth of a nanosecond is left out, so that moments may be off by that.
    const INSTANT: f64 = 1e-9;
    let jerk = 2.0 * (b.speed - a.speed - a.acceleration * dt) / (dt * dt);
    prop_assert!(
        (jerk * dt).abs() <= limits.jerk * (dt + INSTANT) + ROUNDING,
        "{jerk} {a:?} {b:?}"
    );
    let driven = dt * (a.speed + dt * (a.acceleration / 2.0 + dt * jerk / 6.0));
    prop_assert!((a.distance + driven.abs() - b.distance).abs() < 1e-7, "{a:?} {b:?}");
    if a.gear != b.gear {
        prop_assert!(b.speed.abs() < 1e-6, "the gear changes while the car moves: {a:?} {b:?}");
    }
    // The wheels turn at their rate at most, but where the angle jumps and the car drives on.
    let turn = (b.steer - a.steer).abs();
    if limits.stop_to_steer {
        let most = limits.steer_rate * dt + Trajectory::STEER_TOLERANCE;
        prop_assert!(turn <= most + ROUNDING, "{a:?} {b:?}");
    }
    Ok(())
}

fn plan(dir: &FilePath, args: &[&str]) -> Command {
    let scene = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/parallel.json");
    let mut command = Command::cargo_bin("n3p-plan").expect("a binary of this crate");
    command.current_dir(dir).arg("--scene").arg(scene).args(["--method", "ha-rs"]).args(args);
    command
}

fn scene() -> Scene {
    Scene::read(&FilePath::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/parallel.json"))
        .unwrap()
}

#[test]
fn csv_and_json_hold_the_same_columns_from_start_to_goal() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["t.csv", "t.json"] {
        plan(dir.path(), &["--trajectory", file])
            .assert()
            .success()
            .stdout(contains("driving time").and(contains("steering jumps    none")));
    }
    let csv = std::fs::read_to_string(dir.path().join("t.csv")).unwrap();
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(
        names.join(" "),
        "time_s x_m y_m heading_rad speed_mps acceleration_mps2 steer_rad curvature_per_m \
         distance_m gear"
    );
    let rows: Vec<Vec<f64>> =
        lines.map(|l| l.split(',').map(|n| n.parse().unwrap()).collect()).collect();
    let json = std::fs::read(dir.path().join("t.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    for (i, name) in names.iter().enumerate() {
        let column: Vec<f64> = serde_json::from_value(json["columns"][name].clone()).unwrap();
        assert!(rows.iter().map(|row| row[i]).eq(column), "{name}");
    }
    let scene = scene();
    let [first, last] = [&rows[0], &rows[rows.len() - 1]];
    assert_eq!(first[..5], [0.0, scene.start.x, scene.start.y, scene.start.heading, 0.0]);
    assert_eq!(last[1..5], [scene.goal.x, scene.goal.y, scene.goal.heading, 0.0]);
    assert_eq!(json["report"]["duration_s"], last[0]);
    assert_eq!(json["method"], "ha-rs");
    assert_eq!(json["vehicle"]["forward_speed"], scene.vehicle.speed(Gear::Forward));
    assert_eq!(json["limits"]["steer_rate"], 0.6);
}

#[test]
fn limits_are_taken_and_kept() {
    let dir = tempfile::tempdir().unwrap();
    let limits = ["--acceleration", "0.5", "--backward-acceleration", "0.25", "--stop-to-steer"];
    let output = plan(dir.path(), &["--trajectory", "t.CSV", "--json"]).args(limits).assert();
    let json: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(json["row"]["ok"], true);
    assert_eq!(json["trajectory"]["steer_rate_kept"], true);
    let csv = std::fs::read_to_string(dir.path().join("t.CSV")).unwrap();
    for line in csv.lines().skip(1) {
        let row: Vec<f64> = line.split(',').map(|n| n.parse().unwrap()).collect();
        let limit = if row[9] > 0.0 { 0.5 } else { 0.25 };
        assert!(row[5].abs() <= limit, "{line}");
    }
}

#[test]
fn what_cannot_be_is_refused_before_planning() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |args: &[&str], parts: &[&str]| {
        let assert = plan(dir.path(), args).assert().code(2).stdout("");
        let stderr = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        for part in parts {
            assert!(stderr.contains(part), "\"{part}\" not in: {stderr}");
        }
        assert!(stderr.trim().lines().count() <= 2, "more than two lines: {stderr}");
    };
    refused(
        &["--trajectory", "t.txt"],
        &["t.txt", "--trajectory", ".csv, .json, .geojson or .mcap"],
    );
    refused(&["--trajectory", "csv"], &["csv", ".csv, .json, .geojson or .mcap"]);
    for value in ["0", "-1", "NaN", "inf", "fast"] {
        for (flag, unit) in [
            ("--acceleration", "m/s²"),
            ("--backward-acceleration", "m/s²"),
            ("--steer-rate", "rad/s"),
            ("--lateral-acceleration", "m/s²"),
            ("--jerk", "m/s³"),
        ] {
            refused(&["--trajectory", "t.csv", flag, value], &[flag, value, "between", unit]);
        }
    }
    refused(&["--stop-to-steer"], &["--trajectory"]);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "something was written");
    std::fs::write(dir.path().join("file"), "").unwrap();
    refused(&["--trajectory", "file/t.csv"], &["file/t.csv", "cannot be written"]);
    std::fs::create_dir(dir.path().join("folder.csv")).unwrap();
    refused(&["--trajectory", "folder.csv"], &["folder.csv", "it is a folder"]);
}

#[test]
fn where_there_is_no_path_there_is_no_trajectory() {
    let dir = tempfile::tempdir().unwrap();
    plan(dir.path(), &["--trajectory", "t.csv", "--max-expansions", "0"]).assert().code(3);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}
