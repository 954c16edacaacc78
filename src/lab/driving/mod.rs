//! Driven, not only planned: what becomes of a plan in a car with lags and errors.
//!
//! A plan's trajectory is driven in closed loop by an ordinary controller (`controller`) in a car whose
//! wheels and speed lag behind their commands (`car`). The car knows where it is only by a localisation with
//! errors, smoothed with its odometry, and the obstacles stand a little elsewhere than where they were seen.
//! [`drive`] says where the car ended, how far it was from its path, and whether it touched anything.

mod car;
mod controller;

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::curves::{SmoothPath, Trajectory, TrajectoryLimits};
use crate::episode::{Case, Episode, clearance};
use crate::geometry::{Pose, signed_angle};
use crate::output::PathFile;
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;
use crate::world::{Level, ParkingType, Scene};
use car::{Actuators, Car};
use controller::Controller;

/// What a car that is driven has to put up with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DriveConfig {
    /// Standard deviation of each measured position, to either side, metres.
    pub position_noise_m: f64,
    /// Of each measured heading, radians.
    pub heading_noise_rad: f64,
    /// Of where each obstacle stands, against where it was seen, metres.
    pub obstacle_noise_m: f64,
    /// Time constant of the steering, seconds.
    pub steering_lag_s: f64,
    /// Time constant of the speed, seconds.
    pub speed_lag_s: f64,
    /// Share of the vehicle's steering rate that trajectories use; the rest is the controller's.
    pub steer_rate_share: f64,
    /// How much farther than the vehicle's steering limit, by which paths are planned, the wheels turn, as a share
    /// of it. Without that a car beside its path on full lock cannot come back to it.
    pub steer_reserve: f64,
    /// Seed of all errors.
    pub seed: u64,
}

impl Default for DriveConfig {
    fn default() -> Self {
        Self {
            position_noise_m: 0.02,
            heading_noise_rad: 0.005,
            obstacle_noise_m: 0.02,
            steering_lag_s: 0.2,
            speed_lag_s: 0.2,
            steer_rate_share: 0.8,
            steer_reserve: 0.05,
            seed: 1,
        }
    }
}

/// What became of one plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveRow {
    /// Name of the scene.
    pub scene: String,
    /// The set it belongs to.
    pub set: String,
    /// Parking type, where known.
    #[serde(rename = "type")]
    pub kind: Option<ParkingType>,
    /// Difficulty, for generated scenes.
    pub level: Option<Level>,
    /// The method that planned.
    pub method: String,
    /// Where the car ended: distance from where it was to park, metres.
    pub off_m: f64,
    /// And how far it is turned there, radians.
    pub off_rad: f64,
    /// The largest distance of the rear axle from its path on the way, metres.
    pub deviation_m: f64,
    /// The smallest distance between car and obstacles, metres; 0 on contact.
    pub clearance_m: Option<f64>,
    /// Whether it touched anything.
    pub contact: bool,
    /// Driving time, seconds.
    pub time_s: f64,
    /// That of the trajectory, seconds.
    pub planned_time_s: f64,
    /// Part of it at standstill while the wheels turn, seconds.
    pub standing_s: f64,
}

impl DriveRow {
    /// Parked: at most so far off, metres and radians.
    pub const PARKED: (f64, f64) = (0.05, std::f64::consts::PI / 180.0);

    /// Whether the car parked without touching anything.
    pub fn is_parked(&self) -> bool {
        self.off_m <= Self::PARKED.0 && self.off_rad <= Self::PARKED.1 && !self.contact
    }
}

/// A plan as it was driven.
#[derive(Clone, Debug)]
pub struct Drive {
    /// What became of it.
    pub row: DriveRow,
    /// Where the car was, every [`Drive::STEP`] seconds, in the scene's frame.
    pub poses: Vec<Pose>,
}

impl Drive {
    /// Seconds between poses.
    pub const STEP: f64 = 0.05;
}

/// Of the difference between where the car measures itself and where its odometry says it is, so much is
/// believed each time.
const BELIEVED: f64 = 0.05;
/// Seconds between measurements and commands, and between steps of the car.
const CONTROL: f64 = 0.02;
const STEP: f64 = 0.01;

/// Drives the path of an episode; `None` where there is none, or it was refused.
pub fn drive(case: &Case, episode: &Episode, config: &DriveConfig) -> Option<Drive> {
    let vehicle = &case.scene.vehicle;
    let path = episode.result.driven().filter(|_| episode.row.ok)?;
    let path = path.to_world(&episode.problem.frame);
    let usual = TrajectoryLimits::of(vehicle);
    let limits =
        TrajectoryLimits { steer_rate: usual.steer_rate * config.steer_rate_share, ..usual };
    let trajectory = Trajectory::new(&path, vehicle, &limits).ok()?;
    let mut noise = rng(config.seed, Stream::Drive, name_number(&case.scene.name));
    let scene = displaced(&case.scene, config.obstacle_noise_m, &mut noise);
    let driven = follow(vehicle, &path, &trajectory, config, &mut noise);
    let file = PathFile {
        poses: driven.poses.iter().map(|&pose| pose.into()).collect(),
        ..PathFile::default()
    };
    let clearance = clearance::of(&scene, &file).least;
    let (end, goal) = (driven.end, path.end());
    let report = trajectory.report();
    let row = DriveRow {
        scene: case.scene.name.clone(),
        set: case.set.clone(),
        kind: case.kind,
        level: case.level,
        method: episode.row.method.clone(),
        off_m: end.distance(goal),
        off_rad: signed_angle(goal.heading, end.heading).abs(),
        deviation_m: driven.deviation,
        clearance_m: clearance.is_finite().then_some(clearance),
        contact: clearance <= 0.0,
        time_s: driven.time,
        planned_time_s: report.duration_s,
        standing_s: report.standing_s,
    };
    Some(Drive { row, poses: driven.poses })
}

/// How a trajectory was followed.
struct Followed {
    poses: Vec<Pose>,
    end: Pose,
    time: f64,
    deviation: f64,
}

fn follow(
    vehicle: &Vehicle,
    path: &SmoothPath,
    trajectory: &Trajectory,
    config: &DriveConfig,
    noise: &mut impl Rng,
) -> Followed {
    let actuators = Actuators {
        steering: config.steering_lag_s,
        speed: config.speed_lag_s,
        reserve: config.steer_reserve,
    };
    let mut controller = Controller::new(vehicle, path, trajectory, actuators);
    let mut car = Car::standing(path.start);
    let mut believed = car.pose;
    let (mut poses, mut deviation) = (vec![car.pose], 0.0_f64);
    let most = 4.0 * trajectory.end().time + 60.0;
    let mut steps = 0_u32;
    let every = (Drive::STEP / CONTROL).round().max(1.0) as u32;
    while !controller.is_done() && f64::from(steps) * CONTROL < most {
        let mut error = |deviation: f64| -> f64 {
            let unit: f64 = StandardNormal.sample(noise);
            deviation * unit
        };
        let p = config.position_noise_m;
        let measured = Pose::new(car.pose.x + error(p), car.pose.y + error(p), 0.0);
        let heading = car.pose.heading + error(config.heading_noise_rad);
        let turn = signed_angle(believed.heading, heading);
        believed = Pose::new(
            believed.x + BELIEVED * (measured.x - believed.x),
            believed.y + BELIEVED * (measured.y - believed.y),
            believed.heading + BELIEVED * turn,
        );
        let command = controller.command(believed, car.speed, CONTROL);
        for _ in 0..(CONTROL / STEP).round() as u32 {
            let motion = car.step(command, actuators, vehicle, STEP);
            believed = motion.end(believed);
        }
        deviation = deviation.max(controller.beside(car.pose));
        steps += 1;
        if steps.is_multiple_of(every) {
            poses.push(car.pose);
        }
    }
    poses.push(car.pose);
    Followed { poses, end: car.pose, time: f64::from(steps) * CONTROL, deviation }
}

/// The scene with every obstacle elsewhere by an error of standard deviation `deviation` along each axis.
fn displaced(scene: &Scene, deviation: f64, noise: &mut impl Rng) -> Scene {
    let mut error = || -> f64 {
        let unit: f64 = StandardNormal.sample(noise);
        deviation * unit
    };
    let mut moved = scene.clone();
    for outline in &mut moved.obstacles {
        let by = [error(), error()];
        outline.iter_mut().for_each(|[x, y]| (*x, *y) = (*x + by[0], *y + by[1]));
    }
    for [x, y] in &mut moved.points {
        (*x, *y) = (*x + error(), *y + error());
    }
    moved
}

/// A number of a scene's name, so that all methods meet the same errors in it: FNV-1a.
fn name_number(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
