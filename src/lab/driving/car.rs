//! The car that is driven: a kinematic bicycle whose wheels and speed follow their commands with a lag.

use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;

/// What is asked of the actuators.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Command {
    /// Angle of the front wheels, radians.
    pub steer: f64,
    /// Signed speed, m/s.
    pub speed: f64,
}

/// How the actuators follow: by first-order actuators, and the wheels no faster than the vehicle's steering rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Actuators {
    /// Of the steering, seconds.
    pub steering: f64,
    /// Of the speed, seconds.
    pub speed: f64,
    /// How much farther than the vehicle's steering limit the wheels turn, as a share of it.
    pub reserve: f64,
}

/// Where the car is and what it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Car {
    pub pose: Pose,
    /// Signed, m/s.
    pub speed: f64,
    pub steer: f64,
}

/// Of a difference, what a lag of a time constant makes up for within `dt`.
fn share(dt: f64, lag: f64) -> f64 {
    if lag > dt { dt / lag } else { 1.0 }
}

impl Car {
    /// A car that stands with straight wheels.
    pub fn standing(pose: Pose) -> Self {
        Self { pose, speed: 0.0, steer: 0.0 }
    }

    /// The motion of the next `dt` seconds, and the car after it.
    pub fn step(
        &mut self,
        command: Command,
        actuators: Actuators,
        vehicle: &Vehicle,
        dt: f64,
    ) -> Segment {
        let (speed, steer) = (self.speed, self.steer);
        let most = vehicle.steer_rate * dt;
        let lock = (1.0 + actuators.reserve) * vehicle.max_steer;
        let wanted = command.steer.clamp(-lock, lock);
        self.steer += ((wanted - steer) * share(dt, actuators.steering)).clamp(-most, most);
        self.speed += (command.speed - speed) * share(dt, actuators.speed);
        let motion = Segment {
            curvature: vehicle.curvature(f64::midpoint(steer, self.steer)),
            length: f64::midpoint(speed, self.speed) * dt,
        };
        self.pose = motion.end(self.pose);
        motion
    }
}
