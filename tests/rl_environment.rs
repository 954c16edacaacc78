//! Laws of what policies see and do, held against the exact swept check and parry2d.

#![cfg(feature = "lab")]

use n3p::environment::courses::{Course, Stratum};
use n3p::environment::motion::{self, ActionMask, PARTS, admitted, drive};
use n3p::environment::parking_env::{End, EnvConfig, ParkingEnv};
use n3p::environment::{Action, MASK, Observation};
use n3p::geometry::{Pose, Vec2};
use n3p::planners::Problem;
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use parry2d_f64::math::{Pose2, Vector2};
use parry2d_f64::query::intersection_test;
use parry2d_f64::shape::{Cuboid, Segment as Edge};
use proptest::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

fn problem(course: Course, index: u64) -> Problem {
    let stratum = Stratum::nth(index as usize % Stratum::COUNT);
    course.problem(&Vehicle::default(), stratum, 606, index)
}

fn random_action(rng: &mut ChaCha8Rng) -> Action {
    Action { steer: rng.random_range(-1.0..=1.0), speed: rng.random_range(-1.0..=1.0) }
}

/// A free pose some random steps away from the start.
fn wander(problem: &Problem, steps: u32, rng: &mut ChaCha8Rng) -> Pose {
    (0..steps).fold(problem.start, |pose, _| {
        drive(problem, pose, random_action(rng).motion(&problem.vehicle)).end(pose)
    })
}

fn mask_of(problem: &Problem, pose: Pose) -> [f32; MASK] {
    ActionMask::new(&problem.vehicle, problem.collision.footprint()).shares(problem, pose)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn the_mask_admits_all_that_is_free_and_nothing_else(index in 0..500u64, steps in 0..60u32, simple: bool) {
        let problem = problem(if simple { Course::Simple } else { Course::Eval }, index);
        let mut rng = rng(1, Stream::Policy, index);
        let pose = wander(&problem, steps, &mut rng);
        let mask = mask_of(&problem, pose);
        let free = |entry: usize, parts: u32| {
            let mut motion = motion::action(entry).motion(&problem.vehicle);
            motion.length *= f64::from(parts) / f64::from(PARTS);
            problem.collision.segment_is_free(pose, motion)
        };
        for (entry, share) in mask.into_iter().enumerate() {
            let parts = (share * PARTS as f32).round() as u32;
            prop_assert!((share - parts as f32 / PARTS as f32).abs() < 1e-6);
            prop_assert!(parts == 0 || free(entry, parts), "entry {entry}, {parts} parts");
            prop_assert!(parts == PARTS || !free(entry, parts + 1), "entry {entry}, {parts} parts");
        }
        // Whatever a policy asks for, what the mask admits of it is free.
        for _ in 0..50 {
            let action = admitted(random_action(&mut rng), &mask);
            let motion = action.motion(&problem.vehicle);
            prop_assert!(problem.collision.segment_is_free(pose, motion), "{action:?}");
            prop_assert!((drive(&problem, pose, motion).length - motion.length).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_driven_is_free_and_as_far_as_it_goes(index in 0..500u64, steps in 0..60u32) {
        let problem = problem(Course::Eval, index);
        let mut rng = rng(2, Stream::Policy, index);
        let pose = wander(&problem, steps, &mut rng);
        for _ in 0..50 {
            let wanted = random_action(&mut rng).motion(&problem.vehicle);
            let driven = drive(&problem, pose, wanted);
            prop_assert!(driven.length == 0.0 || problem.collision.segment_is_free(pose, driven));
            prop_assert!(problem.collision.pose_is_free(driven.end(pose)));
            let mut more = driven;
            more.length += wanted.length / f64::from(PARTS);
            let all = (driven.length - wanted.length).abs() < 1e-12;
            prop_assert!(all || !problem.collision.segment_is_free(pose, more));
        }
    }
}

/// Whether the footprint, without any margin, touches an edge: parry2d's word.
fn parry_touches(problem: &Problem, edges: &[(Vec2, Vec2)], pose: Pose) -> bool {
    let (vehicle, center) = (&problem.vehicle, problem.vehicle.body_center(pose));
    let body = Cuboid::new(Vector2::new(vehicle.length / 2.0, vehicle.width / 2.0));
    let at = Pose2::new(Vector2::new(center.x, center.y), center.heading);
    edges.iter().any(|(a, b)| {
        let edge = Edge::new(Vector2::new(a.x, a.y), Vector2::new(b.x, b.y));
        intersection_test(&at, &body, &Pose2::IDENTITY, &edge).unwrap().intersecting
    })
}

#[test]
fn a_random_policy_under_the_mask_never_collides_in_100_000_steps() {
    const STEPS: usize = 100_000;
    let mut rng = rng(3, Stream::Policy, 0);
    let (mut steps, mut moved, mut index) = (0, 0, 0);
    while steps < STEPS {
        let course = if index % 2 == 0 { Course::Eval } else { Course::Simple };
        let problem = problem(course, index);
        index += 1;
        let edges: Vec<_> = problem.obstacles.edges().collect();
        let mask = ActionMask::new(&problem.vehicle, problem.collision.footprint());
        let mut pose = problem.start;
        for _ in 0..200 {
            let shares = mask.shares(&problem, pose);
            let entry = rng.random_range(0..MASK);
            let action = admitted(motion::action(entry), &shares);
            let motion = action.motion(&problem.vehicle);
            assert!(
                problem.collision.segment_is_free(pose, motion),
                "{index}: {pose:?} {action:?}"
            );
            for part in 1..=4 {
                let there = motion.at(pose, motion.length * f64::from(part) / 4.0);
                assert!(!parry_touches(&problem, &edges, there), "{index}: {pose:?} {action:?}");
            }
            pose = motion.end(pose);
            assert!(problem.collision.pose_is_free(pose));
            moved += usize::from(motion.length != 0.0);
            steps += 1;
        }
    }
    assert!(moved > STEPS / 2, "only {moved} steps moved");
}

/// The observations and rewards of an episode driven at random.
fn episode(index: u64, config: EnvConfig) -> (Vec<Observation>, Vec<f64>, End, ParkingEnv) {
    let mut env = ParkingEnv::new(problem(Course::Eval, index), config);
    let mut rng = rng(4, Stream::Policy, index);
    let (mut seen, mut rewards) = (vec![env.observe()], Vec::new());
    loop {
        let step = env.step(random_action(&mut rng));
        seen.push(env.observe());
        rewards.push(step.reward);
        if let Some(end) = step.end {
            return (seen, rewards, end, env);
        }
    }
}

#[test]
fn episodes_repeat_and_end_with_their_reward() {
    let mut ends = std::collections::BTreeMap::new();
    for index in 0..90 {
        let (seen, rewards, end, env) = episode(index, EnvConfig::default());
        let again = episode(index, EnvConfig::default());
        assert_eq!((&seen, &rewards, end), (&again.0, &again.1, again.2));
        *ends.entry(format!("{end:?}")).or_insert(0) += 1;
        let last = *rewards.last().unwrap();
        let (pose, problem) = (env.progress().pose, env.problem());
        match end {
            End::Parked => {
                assert_eq!(last, 5.0);
                assert!(problem.vehicle.overlap(pose, problem.goal) >= 0.9);
            }
            End::OutOfBounds => assert_eq!(last, -5.0),
            End::OutOfTime => assert_eq!(rewards.len(), 200),
        }
        for (step, o) in seen.iter().enumerate() {
            assert_eq!(o.step as usize, step);
            assert!(o.lidar.iter().all(|v| (0.0..=10.0).contains(v)));
            let [distance, cos, sin, turn_cos, turn_sin] = o.target;
            assert!(distance >= 0.0 && (cos.hypot(sin) - 1.0).abs() < 1e-5);
            assert!((turn_cos.hypot(turn_sin) - 1.0).abs() < 1e-5);
        }
    }
    assert!(ends["Parked"] > 30 && ends["OutOfTime"] > 5, "{ends:?}");
}

#[test]
fn an_episode_left_and_resumed_goes_on_as_if_it_had_not_been() {
    let mut env = ParkingEnv::new(problem(Course::Eval, 7), EnvConfig::default());
    let mut other = ParkingEnv::new(problem(Course::Eval, 7), EnvConfig::default());
    let mut rng = rng(5, Stream::Policy, 7);
    for _ in 0..150 {
        // Through JSON, as a checkpoint does.
        let json = serde_json::to_string(env.progress()).unwrap();
        other.resume(serde_json::from_str(&json).unwrap());
        let action = random_action(&mut rng);
        let step = env.step(action);
        assert_eq!(other.step(action), step);
        assert_eq!((other.observe(), other.progress()), (env.observe(), env.progress()));
        if step.end.is_some() {
            break;
        }
    }
}

#[test]
fn a_curve_that_takes_over_ends_parked_whatever_is_asked() {
    let mut taken = 0;
    for index in 0..60 {
        let mut env = ParkingEnv::new(problem(Course::Eval, index), EnvConfig::default());
        let mut rng = rng(6, Stream::Policy, index);
        while !env.is_scripted() && env.progress().step < 100 {
            if env.step(random_action(&mut rng)).end.is_some() {
                break;
            }
        }
        if env.is_scripted() {
            taken += 1;
            let mut last = None;
            while env.is_scripted() && last.is_none() {
                last = env.step(random_action(&mut rng)).end;
            }
            assert_eq!(last, Some(End::Parked), "problem {index}");
        }
    }
    assert!(taken > 30, "{taken}");
}
