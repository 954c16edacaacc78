//! One moment of a trajectory, and the phases that know them all.

use super::profile::Interval;
use crate::curves::Clothoid;
use crate::geometry::{Pose, wrap_angle};
use crate::vehicle::{Gear, Vehicle};

/// One moment of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Since the start, seconds.
    pub time: f64,
    /// The pose; heading in (−π, π].
    pub pose: Pose,
    /// Signed speed, m/s; negative backward.
    pub speed: f64,
    /// Rate of change of the signed speed, m/s²; where it jumps, the new one.
    pub acceleration: f64,
    /// Angle of the front wheels, radians, positive to the left; where it jumps, the new one.
    pub steer: f64,
    /// Curvature of an arc driven with this steering angle, 1/m.
    pub curvature: f64,
    /// Distance driven, metres.
    pub distance: f64,
    /// Gear of the motion that follows (at the end: that led there).
    pub gear: Gear,
}

/// A part of a trajectory with constant jerk on one motion, or one at standstill in which the wheels turn
/// steadily.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phase {
    /// When it begins.
    pub time: f64,
    /// Distance driven until then.
    pub distance: f64,
    /// Speed then, and how it changes: positive speeds up in either gear.
    pub drive: Interval,
    /// Steering angle then, and its rate of change, while the car stands.
    pub standing: Option<(f64, f64)>,
    /// The motion driven (or, at standstill, to be driven next), where it begins, and how much
    /// of it has been driven.
    pub motion: Clothoid,
    pub from: Pose,
    pub along: f64,
}

impl Phase {
    pub fn at(&self, time: f64, vehicle: &Vehicle) -> Moment {
        let t = time - self.time;
        let gear = self.motion.gear();
        let sign = gear.sign();
        let driven = self.drive.driven(t).max(0.0);
        let along = (self.along + driven).min(self.motion.length.abs());
        let pose = self.motion.at(self.from, sign * along);
        let steer = match self.standing {
            Some((steer, rate)) => steer + rate * t,
            None => vehicle.steer(self.motion.curvature(sign * along)),
        };
        Moment {
            time,
            pose: Pose::new(pose.x, pose.y, wrap_angle(pose.heading)),
            // Adding zero makes a negative zero a plain one.
            speed: sign * self.drive.speed_after(t).max(0.0) + 0.0,
            acceleration: sign * self.drive.acceleration_after(t) + 0.0,
            steer,
            curvature: vehicle.curvature(steer),
            distance: self.distance + driven,
            gear,
        }
    }

    /// The fastest it gets within `duration`, m/s: the speed may peak on the way.
    pub fn fastest(&self, duration: f64) -> f64 {
        let Interval { acceleration, jerk, .. } = self.drive;
        let peak = if jerk == 0.0 { 0.0 } else { (-acceleration / jerk).clamp(0.0, duration) };
        [0.0, peak, duration].map(|t| self.drive.speed_after(t)).into_iter().fold(0.0, f64::max)
    }
}
