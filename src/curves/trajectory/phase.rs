//! One moment of a trajectory, and the phases that know them all.

use crate::curves::Segment;
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
    /// Rate of change of the signed speed from now on, m/s².
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

/// A part of a trajectory with constant acceleration and steering angle on one segment, or one at
/// standstill in which the wheels turn steadily.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phase {
    /// When it begins.
    pub time: f64,
    /// Distance driven until then.
    pub distance: f64,
    /// Speed then, and its rate of change: positive speeds up in either gear.
    pub speed: f64,
    pub acceleration: f64,
    /// Steering angle then, and its rate of change: zero while driving.
    pub steer: f64,
    pub steer_rate: f64,
    /// The segment driven (or, at standstill, to be driven next), where it begins, and how much
    /// of it has been driven.
    pub segment: Segment,
    pub from: Pose,
    pub along: f64,
}

impl Phase {
    pub fn stands(&self) -> bool {
        self.steer_rate != 0.0
    }

    pub fn at(&self, time: f64, vehicle: &Vehicle) -> Moment {
        let t = time - self.time;
        let gear = self.segment.gear();
        let sign = gear.sign();
        let driven = self.speed * t + 0.5 * self.acceleration * t * t;
        let along = (self.along + driven).min(self.segment.length.abs());
        let pose = self.segment.at(self.from, sign * along);
        let steer = self.steer + self.steer_rate * t;
        Moment {
            time,
            pose: Pose::new(pose.x, pose.y, wrap_angle(pose.heading)),
            // Adding zero makes a negative zero a plain one.
            speed: sign * (self.speed + self.acceleration * t).max(0.0) + 0.0,
            acceleration: sign * self.acceleration + 0.0,
            steer,
            curvature: vehicle.curvature(steer),
            distance: self.distance + driven,
            gear,
        }
    }
}
