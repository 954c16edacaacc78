//! Planning again and again on the way: the wheels as they stand, and the path that the car follows already.

use n3p::curves::TrajectoryLimits;
use n3p::curves::smoothing::StandstillSteering;
use n3p::geometry::Pose;
use n3p::lab::evaluation::oracle;
use n3p::planners::Route;
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{GoalTolerance, Level, ParkingType, PreviousPath, Scene};
use n3p::{Parker, Plan};

fn scenes(count: u64) -> Vec<Scene> {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let kinds = [ParkingType::Forward, ParkingType::Reverse, ParkingType::Parallel];
    let each = kinds.iter().flat_map(|&kind| (0..count).map(move |i| (kind, i)));
    each.map(|(kind, i)| generate(&config, &vehicle, kind, Level::Complex, 20_261_127, i)).collect()
}

fn parker() -> Parker {
    Parker::new(Vehicle::default()).unwrap()
}

/// Some number between −1 and 1, the same for the same `i`.
fn noise(i: usize) -> f64 {
    let bits = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1_u64 << 52) as f64
        - 1.0
}

/// Drives a scene 25 cm at a time with errors of up to 1 cm and 0.3°, planning anew each time; how often the car was told
/// to go the other way than before, and how often it planned.
fn drive(parker: &Parker, scene: &Scene, keeps: bool) -> [usize; 2] {
    let goal_tolerance = Some(GoalTolerance { position_m: 0.05, heading_rad: 0.02 });
    let scene = &Scene { goal_tolerance, ..scene.clone() };
    let mut plan = parker.plan_scene(scene).unwrap();
    let (mut flips, mut cycles) = (0, 0);
    // A plan that always begins anew would never arrive.
    while cycles < 200 {
        let path = plan.poses();
        let Some(next) = path.poses.get(5).filter(|_| path.poses.len() > 12) else { break };
        cycles += 1;
        let error = |k: usize| noise(3 * cycles + k);
        let start = Pose::new(
            next[0] + 0.01 * error(0),
            next[1] + 0.01 * error(1),
            next[2] + 0.005 * error(2),
        );
        let previous = keeps.then(|| plan.previous());
        let again = Scene { start, previous, ..scene.clone() };
        let Ok(new) = parker.plan_scene(&again) else { break };
        oracle::check(&again, &new.poses()).unwrap();
        flips += usize::from(new.poses().gears[0] != path.gears[5]);
        plan = new;
    }
    [flips, cycles]
}

#[test]
fn a_car_that_replans_does_not_go_back_and_forth() {
    let parker = parker();
    let scenes = scenes(12);
    let total = |keeps: bool| {
        let each = scenes.iter().map(|scene| drive(&parker, scene, keeps));
        each.fold([0, 0], |[f, c], [flips, cycles]| [f + flips, c + cycles])
    };
    let ([kept, cycles], [flips, others]) = (total(true), total(false));
    let per_100 = |n: usize, of: usize| 100.0 * n as f64 / of as f64;
    let [kept, flips] = [per_100(kept, cycles), per_100(flips, others)];
    println!("flips per 100 cycles: {kept:.2} keeping the previous path, {flips:.2} without");
    assert!(cycles > 500 && 2.5 * kept < flips, "{kept} in {cycles} cycles, {flips} without");
}

#[test]
fn the_previous_path_is_kept_until_something_stands_on_it() {
    let parker = parker();
    for scene in scenes(3) {
        let plan = parker.plan_scene(&scene).unwrap();
        let again = Scene { previous: Some(plan.previous()), ..scene.clone() };
        let kept = parker.plan_scene(&again).unwrap();
        assert!((kept.length() - plan.length()).abs() < 0.02 * plan.length());
        // A post in the middle of the way.
        let poses = &kept.poses().poses;
        let [x, y, _] = poses[poses.len() / 2];
        let blocked = Scene { points: vec![[x, y]], ..again };
        if let Ok(other) = parker.plan_scene(&blocked) {
            oracle::check(&blocked, &other.poses()).unwrap();
            assert_ne!(other.route(), Some(Route::Kept));
        }
    }
}

#[test]
fn a_continuous_path_is_kept_as_such() {
    let parker = parker().standstill_steering(StandstillSteering::AtChanges);
    let mut kept = 0;
    for scene in scenes(4) {
        let plan = parker.plan_scene(&scene).unwrap();
        let previous = plan.previous();
        let [x, y, heading] = previous.poses[8];
        let start_steer = previous.steer_from.as_ref().map_or(0.0, |s| s[8]);
        let start = Pose::new(x + 0.01, y, heading);
        let again = Scene { start, start_steer, previous: Some(previous), ..scene };
        let Ok(new) = parker.plan_scene(&again) else { continue };
        oracle::check(&again, &new.poses()).unwrap();
        kept += usize::from(new.route() == Some(Route::Kept));
        assert_eq!(new.smooth_path().jumps(), 0);
    }
    assert!(kept >= 9, "{kept} of 12");
}

#[test]
fn a_path_begins_with_the_wheels_as_they_stand() {
    let never = parker().standstill_steering(StandstillSteering::Never);
    let vehicle = Vehicle::default();
    let (mut begun, mut all) = (0, 0);
    for scene in scenes(5) {
        for start_steer in [0.3, -0.3] {
            let turned = Scene { start_steer, ..scene.clone() };
            all += 1;
            let Ok(plan) = never.plan_scene(&turned) else { continue };
            begun += 1;
            let begin = plan.smooth_path().motions[0].from;
            assert!((vehicle.steer(begin) - start_steer).abs() < 1e-9, "{begin}");
            oracle::check(&turned, &plan.poses()).unwrap();
            let first = first_moment(&plan);
            assert!((first - start_steer).abs() < 1e-9, "{first}");
        }
    }
    assert!(10 * begun >= 9 * all, "{begun} of {all}");
    // Arcs: the wheels turn at standstill from where they stand.
    let turned = Scene { start_steer: 0.3, ..scenes(1).remove(0) };
    let first = first_moment(&parker().plan_scene(&turned).unwrap());
    assert!((first - 0.3).abs() < 1e-9, "{first}");
}

fn first_moment(plan: &Plan) -> f64 {
    plan.trajectory(&TrajectoryLimits::default()).unwrap().moments[0].steer
}

#[test]
fn what_is_wrong_with_a_previous_path_is_named() {
    let scene = scenes(1).remove(0);
    let parker = parker();
    let good = parker.plan_scene(&scene).unwrap().previous();
    let told = |previous: PreviousPath| {
        let scene = Scene { previous: Some(previous), ..scene.clone() };
        parker.plan_scene(&scene).unwrap_err().to_string()
    };
    let short = PreviousPath { gears: vec![1], ..good.clone() };
    assert!(told(short).contains("previous.gears has 1 values"));
    let mut wrong = good.clone();
    wrong.gears[2] = 0;
    assert!(told(wrong).contains("previous.gears[2] is 0; expected 1 or -1"));
    let mut wrong = good.clone();
    wrong.poses[1][0] = f64::NAN;
    assert!(told(wrong).contains("previous.poses[1]"));
    let mut wrong = good;
    wrong.steer[0] = 90.0;
    assert!(told(wrong).contains("previous.steer[0] is 90"));
    // A path of nothing and one from elsewhere are of no use, and no fault.
    let elsewhere = PreviousPath {
        poses: vec![[900.0, 0.0, 0.0]],
        gears: vec![1],
        steer: vec![0.0],
        ..Default::default()
    };
    for previous in [PreviousPath::default(), elsewhere] {
        let scene = Scene { previous: Some(previous), ..scene.clone() };
        assert!(parker.plan_scene(&scene).is_ok());
    }
}
