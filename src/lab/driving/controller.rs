//! An ordinary tracking controller for both gears.
//!
//! Along the path the wheels are turned as the path asks for where the car will be once they have turned,
//! and by feedback of what it is beside and askew. With s the distance driven, g = ±1 the gear, e the
//! offset to the left and φ that of the heading, `de/ds = g sin φ` and `dφ/ds = g (κ − κ_path)`; so
//! `κ = κ_path − ω² e − 2ζω g φ` makes e an oscillator of ω per metre with damping ζ. The speed follows
//! that of the trajectory and makes up for what the car is ahead or behind. C. Samson, "Control of chained
//! systems: application to path following and time-varying point-stabilization of mobile robots", 1995.

use super::car::{Actuators, Command};
use crate::curves::trajectory::Moment;
use crate::curves::{Clothoid, SmoothPath, Trajectory};
use crate::geometry::{Pose, signed_angle};
use crate::vehicle::Vehicle;

/// Damping ζ.
const DAMPING: f64 = 0.9;
/// ω at most, per metre for the default vehicle, and with the delay of steering, as an angle of phase.
const STIFFEST: f64 = 2.0;
const PHASE: f64 = 0.4;
/// Speed for each metre behind, 1/s.
const CATCH_UP: f64 = 1.0;
/// A car that is nearer to where it is to stop, metres, and slower, m/s, has arrived there.
const ARRIVED: f64 = 0.004;
const STANDS: f64 = 0.005;
/// How long it may take to get there after the trajectory does, seconds.
const PATIENCE: f64 = 4.0;
/// The slowest that a car can creep, m/s.
const CREEP: f64 = 0.02;

/// Drives along a trajectory; the path must be that of the trajectory.
pub(super) struct Controller<'a> {
    vehicle: &'a Vehicle,
    trajectory: &'a Trajectory,
    /// Each leg of the path: where it begins, and how far along.
    legs: Vec<(f64, Pose, Clothoid)>,
    actuators: Actuators,
    /// Where in the trajectory the car should be, seconds.
    clock: f64,
    /// The next of its halts, and how long the car has been late there.
    halt: usize,
    late: f64,
}

impl<'a> Controller<'a> {
    pub fn new(
        vehicle: &'a Vehicle,
        path: &SmoothPath,
        trajectory: &'a Trajectory,
        actuators: Actuators,
    ) -> Self {
        let mut along = 0.0;
        let legs = path.legs().map(|(from, motion)| {
            let leg = (along, from, motion);
            along += motion.length.abs();
            leg
        });
        let legs = legs.collect();
        Self { vehicle, trajectory, legs, actuators, clock: 0.0, halt: 0, late: 0.0 }
    }

    /// Whether the trajectory is driven to its end.
    pub fn is_done(&self) -> bool {
        self.halt >= self.trajectory.halts().len()
    }

    /// Pose and curvature of the path at `distance` along it.
    fn on_path(&self, distance: f64) -> (Pose, f64) {
        let at = self.legs.partition_point(|(begin, ..)| *begin <= distance).max(1) - 1;
        let Some(&(begin, from, motion)) = self.legs.get(at) else {
            return (self.trajectory.end().pose, 0.0);
        };
        let s = (distance - begin).clamp(0.0, motion.length.abs()).copysign(motion.length);
        (motion.at(from, s), motion.curvature(s))
    }

    /// What to do for the next `dt` seconds, for a car believed to be at `pose` with signed `speed`.
    pub fn command(&mut self, pose: Pose, speed: f64, dt: f64) -> Command {
        let halts = self.trajectory.halts();
        let Some(&(stop, end)) = halts.get(self.halt) else {
            return Command::default();
        };
        let begin = self.halt.checked_sub(1).map_or(0.0, |before| halts[before].1);
        let due = self.trajectory.at((self.clock + self.actuators.speed).min(stop));
        let now = self.trajectory.at(self.clock.min(stop));
        let sign = self.sign(begin, end);
        // How far along: as far as the trajectory, and what the car is ahead.
        let ahead = |m: &Moment| m.pose.relative(pose).x * sign;
        let mut along = (now.distance + ahead(&now)).clamp(begin, end);
        for _ in 0..2 {
            let (on_path, _) = self.on_path(along);
            along = (along + on_path.relative(pose).x * sign).clamp(begin, end);
        }
        let (on_path, _) = self.on_path(along);
        let beside = on_path.relative(pose).y;
        let askew = signed_angle(on_path.heading, pose.heading);
        // Where the wheels will have turned to what they are told now.
        let reach = along + speed.abs() * self.actuators.steering;
        let (_, curvature) = self.on_path(reach.clamp(begin + 1e-6, end - 1e-6));
        let stiffness = (PHASE / (speed.abs() * self.actuators.steering + 0.1)).min(STIFFEST)
            / self.vehicle.scale();
        let feedback = stiffness * stiffness * beside + 2.0 * DAMPING * stiffness * sign * askew;
        let steer = self.vehicle.steer(curvature - feedback);

        let (left, behind) = (end - along, due.distance.min(end) - along);
        let wanted = due.speed.abs() + CATCH_UP * (behind - speed.abs() * self.actuators.speed);
        let is_at_halt = self.clock >= stop;
        let arrived = left < ARRIVED && speed.abs() < STANDS;
        let stands = now.speed == 0.0 && !is_at_halt;
        let speed_limit = self.vehicle.speed(now.gear);
        let wanted = if left < ARRIVED || stands {
            0.0
        } else {
            // Never faster than what still stops in time.
            wanted.max(CREEP).min(speed_limit).min(CREEP + left * 1.5)
        };
        self.clock = (self.clock + dt).min(stop);
        if is_at_halt {
            self.late += dt;
            if arrived || self.late > PATIENCE {
                (self.halt, self.late) = (self.halt + 1, 0.0);
            }
        }
        Command { steer, speed: sign * wanted }
    }

    /// How far `pose` is from the part of the path that is driven just now, metres.
    pub fn beside(&self, pose: Pose) -> f64 {
        let halts = self.trajectory.halts();
        let Some(&(stop, end)) = halts.get(self.halt) else { return 0.0 };
        let begin = self.halt.checked_sub(1).map_or(0.0, |before| halts[before].1);
        let sign = self.sign(begin, end);
        let now = self.trajectory.at(self.clock.min(stop));
        let mut along = (now.distance + now.pose.relative(pose).x * sign).clamp(begin, end);
        for _ in 0..3 {
            let (on_path, _) = self.on_path(along);
            along = (along + on_path.relative(pose).x * sign).clamp(begin, end);
        }
        self.on_path(along).0.relative(pose).y.abs()
    }

    /// +1 where the path leads forward between these distances.
    fn sign(&self, begin: f64, end: f64) -> f64 {
        let middle = f64::midpoint(begin, end);
        let at = self.legs.partition_point(|(from, ..)| *from <= middle).max(1) - 1;
        self.legs.get(at).map_or(1.0, |(_, _, motion)| motion.gear().sign())
    }
}
