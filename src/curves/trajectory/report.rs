//! What a trajectory asks of the car.

use serde::Serialize;

use super::Trajectory;
use crate::vehicle::Gear;

/// Where the steering angle jumps while the car moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SteerJump {
    /// When, seconds since the start.
    pub time_s: f64,
    /// Distance driven until then, metres.
    pub distance_m: f64,
    /// Steering angle before, radians.
    pub from_rad: f64,
    /// Steering angle after, radians.
    pub to_rad: f64,
    /// How long the wheels would turn for it at the steering rate, seconds.
    pub dwell_s: f64,
}

impl SteerJump {
    /// How far the angle jumps, radians.
    pub fn size(&self) -> f64 {
        (self.to_rad - self.from_rad).abs()
    }
}

/// The extremes of a trajectory, and every steering jump that is left in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrajectoryReport {
    /// The whole time, seconds.
    pub duration_s: f64,
    /// Distance driven, metres.
    pub distance_m: f64,
    /// Stops between start and end.
    pub stops: usize,
    /// Time at standstill, while the wheels turn, seconds.
    pub standing_s: f64,
    /// Fastest forward, m/s.
    pub max_forward_speed_mps: f64,
    /// Fastest backward, m/s (a positive number).
    pub max_backward_speed_mps: f64,
    /// Strongest acceleration or braking, m/s².
    pub max_acceleration_mps2: f64,
    /// Largest v²·|κ| at the rear axle, m/s²: the fastest of each phase by its largest curvature.
    pub max_lateral_acceleration_mps2: f64,
    /// Fastest change of the acceleration, m/s³.
    pub max_jerk_mps3: f64,
    /// How fast the wheels turn at most, jumps aside, rad/s.
    pub max_steer_rate_radps: f64,
    /// Largest steering angle, to either side, radians.
    pub max_abs_steer_rad: f64,
    /// Whether the wheels never turn faster than the limit: there are no jumps.
    pub steer_rate_kept: bool,
    /// The largest jump, radians.
    pub max_steer_jump_rad: f64,
    /// How long the wheels would turn for all jumps at the steering rate, seconds.
    pub steer_jump_dwell_s: f64,
    /// All jumps, in driving order.
    pub steer_jumps: Vec<SteerJump>,
}

impl TrajectoryReport {
    pub(super) fn of(trajectory: &Trajectory) -> Self {
        let end = trajectory.end();
        let mut report = Self {
            duration_s: end.time,
            distance_m: end.distance,
            stops: trajectory.halts.len().saturating_sub(1),
            standing_s: 0.0,
            max_forward_speed_mps: 0.0,
            max_backward_speed_mps: 0.0,
            max_acceleration_mps2: 0.0,
            max_lateral_acceleration_mps2: 0.0,
            max_jerk_mps3: 0.0,
            max_steer_rate_radps: 0.0,
            max_abs_steer_rad: 0.0,
            steer_rate_kept: trajectory.jumps.is_empty(),
            max_steer_jump_rad: trajectory.jumps.iter().map(SteerJump::size).fold(0.0, f64::max),
            steer_jump_dwell_s: trajectory.jumps.iter().fold(0.0, |sum, j| sum + j.dwell_s),
            steer_jumps: trajectory.jumps.clone(),
        };
        let raise = |extreme: &mut f64, value: f64| *extreme = extreme.max(value);
        for (phase, duration) in trajectory.phases_with_durations() {
            if let Some((steer, rate)) = phase.standing {
                raise(
                    &mut report.max_abs_steer_rad,
                    steer.abs().max((steer + rate * duration).abs()),
                );
                raise(&mut report.max_steer_rate_radps, rate.abs());
                report.standing_s += duration;
                continue;
            }
            let speed = phase.fastest(duration);
            let ends = [0.0, duration].map(|t| phase.at(phase.time + t, trajectory.vehicle()));
            let curvature = ends[0].curvature.abs().max(ends[1].curvature.abs());
            let fastest = match phase.motion.gear() {
                Gear::Forward => &mut report.max_forward_speed_mps,
                Gear::Backward => &mut report.max_backward_speed_mps,
            };
            raise(fastest, speed);
            // It rises and falls steadily, and where it is largest another phase begins.
            raise(&mut report.max_acceleration_mps2, ends[0].acceleration.abs());
            raise(&mut report.max_jerk_mps3, phase.drive.jerk.abs());
            raise(&mut report.max_lateral_acceleration_mps2, speed * speed * curvature);
            raise(&mut report.max_abs_steer_rad, ends[0].steer.abs().max(ends[1].steer.abs()));
            let rate = speed * trajectory.steering_per_metre(&phase.motion);
            raise(&mut report.max_steer_rate_radps, rate);
        }
        report
    }
}
