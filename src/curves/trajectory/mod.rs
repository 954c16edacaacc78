//! A trajectory: a path in time, with speed and steering at every moment.
//!
//! A path is cut into *runs*, which the car drives from standstill to standstill: at each gear
//! change, and with [`TrajectoryLimits::stop_to_steer`] also wherever the steering angle jumps.
//! On a run the speed rises and falls within the limits of acceleration and jerk, and nowhere exceeds the
//! vehicle's speed in that gear, what the lateral acceleration allows on a curve, and what the front wheels
//! can follow on a clothoid. Before a run the wheels turn at standstill to where the run needs them, if they
//! are not there yet; before the first they stand as [`SmoothPath::begin`] says.
//!
//! Where two arcs meet, the curvature of a path jumps. To stay on the path and within the
//! steering rate a car has to stop there. Without `stop_to_steer` it drives on, and the
//! [`TrajectoryReport`] lists every jump. A path made smooth ([`mod@super::smoothing`]) has none.

mod limits;
mod phase;
mod profile;
mod report;

pub use limits::{LimitError, TrajectoryLimits};
pub use phase::Moment;
pub use report::{SteerJump, TrajectoryReport};

use phase::Phase;
use profile::{INSTANT, Interval, Rates, Stretch};

use super::{Clothoid, SmoothPath};
use crate::geometry::{Pose, wrap_angle};
use crate::vehicle::{Gear, Vehicle};

/// A path in time.
///
/// Made of phases: in each the jerk is constant and the curvature changes steadily with the distance, or the
/// car stands and the wheels turn steadily. So everything is known exactly at any time.
#[derive(Clone, Debug)]
pub struct Trajectory {
    vehicle: Vehicle,
    phases: Vec<Phase>,
    jumps: Vec<SteerJump>,
    /// When and where along the path the car comes to stand.
    halts: Vec<(f64, f64)>,
    end: Moment,
}

/// Lengths and angles below this are none, metres and radians.
const TINY: f64 = 1e-10;

impl Trajectory {
    /// Smaller jumps of the steering angle, radians, are driven over and not reported.
    pub const STEER_TOLERANCE: f64 = 1e-4;

    /// The shortest time between two sampled moments of one kind, seconds.
    pub const LEAST_STEP: f64 = 1e-4;

    /// Drives `path` with `vehicle` within `limits`.
    pub fn new(
        path: &SmoothPath,
        vehicle: &Vehicle,
        limits: &TrajectoryLimits,
    ) -> Result<Self, LimitError> {
        limits.validate()?;
        let legs: Vec<_> = path.legs().filter(|(_, c)| c.length.abs() > TINY).collect();
        let end = Moment {
            time: 0.0,
            pose: Pose { heading: wrap_angle(path.start.heading), ..path.start },
            speed: 0.0,
            acceleration: 0.0,
            steer: vehicle.steer(path.begin),
            curvature: path.begin,
            distance: 0.0,
            gear: Gear::Forward,
        };
        let mut made =
            Self { vehicle: *vehicle, phases: vec![], jumps: vec![], halts: vec![], end };
        let goes_on = |(_, a): &(Pose, Clothoid), (_, b): &(Pose, Clothoid)| {
            let jump = vehicle.steer(b.from) - vehicle.steer(a.to);
            let smooth = jump.abs() <= Self::STEER_TOLERANCE;
            a.gear() == b.gear() && (smooth || !limits.stop_to_steer)
        };
        for run in legs.chunk_by(goes_on) {
            made.turn_wheels(run[0], limits);
            made.drive(run, limits);
        }
        Ok(made)
    }

    /// Turns the wheels at standstill to where `leg` needs them.
    fn turn_wheels(&mut self, (from, motion): (Pose, Clothoid), limits: &TrajectoryLimits) {
        let turn = self.vehicle.steer(motion.from) - self.end.steer;
        if turn.abs() <= TINY {
            return;
        }
        let duration = turn.abs() / limits.steer_rate;
        self.phases.push(Phase {
            time: self.end.time,
            distance: self.end.distance,
            drive: Interval { duration, ..Interval::default() },
            standing: Some((self.end.steer, turn.signum() * limits.steer_rate)),
            motion,
            from,
            along: 0.0,
        });
        self.end.time += duration;
    }

    /// The fastest that `motion` may be driven, m/s.
    fn speed_limit(&self, motion: &Clothoid, limits: &TrajectoryLimits) -> f64 {
        let most = motion.max_abs_curvature();
        let on_a_curve =
            if most > 0.0 { (limits.lateral_acceleration / most).sqrt() } else { f64::INFINITY };
        let steering = limits.steer_rate / self.steering_per_metre(motion);
        self.vehicle.speed(motion.gear()).min(on_a_curve).min(steering)
    }

    /// How far the wheels turn at most on a metre of `motion`, radians: with δ = atan(L·κ), where they
    /// are straightest.
    fn steering_per_metre(&self, motion: &Clothoid) -> f64 {
        let wheelbase = self.vehicle.wheelbase;
        let Clothoid { from, to, .. } = *motion;
        let least = if from * to <= 0.0 { 0.0 } else { from.abs().min(to.abs()) };
        wheelbase * motion.sharpness() / (1.0 + (wheelbase * least).powi(2))
    }

    /// Drives `legs`, all in one gear, from standstill to standstill.
    fn drive(&mut self, legs: &[(Pose, Clothoid)], limits: &TrajectoryLimits) {
        let gear = legs[0].1.gear();
        let stretch = |(_, motion): &(Pose, Clothoid)| Stretch {
            length: motion.length.abs(),
            speed: self.speed_limit(motion, limits),
        };
        let stretches: Vec<Stretch> = legs.iter().map(stretch).collect();
        let rates = Rates { acceleration: limits.acceleration(gear), jerk: limits.jerk };
        let mut drive = rates.profile(&stretches).into_iter();
        let mut interval = drive.next();
        let mut begun = 0.0;
        let (mut time, mut distance) = (self.end.time, self.end.distance);
        for (i, &(from, motion)) in legs.iter().enumerate() {
            let steer = self.vehicle.steer(motion.from);
            let jump = SteerJump {
                time_s: time,
                distance_m: distance,
                from_rad: self.end.steer,
                to_rad: steer,
                dwell_s: (steer - self.end.steer).abs() / limits.steer_rate,
            };
            if i > 0 && jump.size() > Self::STEER_TOLERANCE {
                self.jumps.push(jump);
            }
            let length = motion.length.abs();
            let leg_begins = distance;
            let mut along = 0.0;
            // Part by part of the profile, to the end of the motion.
            while let Some(whole) = interval {
                let rest = Interval {
                    duration: whole.duration - begun,
                    speed: whole.speed_after(begun),
                    acceleration: whole
                        .acceleration_after(begun)
                        .clamp(-rates.acceleration, rates.acceleration),
                    ..whole
                };
                let is_last = i + 1 == legs.len();
                let ends_here = !is_last && along + rest.driven(rest.duration) >= length - TINY;
                let duration = if ends_here { rest.time_at(length - along) } else { rest.duration };
                if duration > INSTANT {
                    let drive = Interval { duration, ..rest };
                    self.phases.push(Phase {
                        time,
                        distance,
                        drive,
                        standing: None,
                        motion,
                        from,
                        along,
                    });
                    time += duration;
                }
                along += rest.driven(duration);
                distance = leg_begins + along;
                if ends_here {
                    begun += duration;
                    break;
                }
                (interval, begun) = (drive.next(), 0.0);
            }
            distance = leg_begins + length;
            self.end.steer = self.vehicle.steer(motion.to);
        }
        let (from, last) = legs[legs.len() - 1];
        let pose = last.end(from);
        self.halts.push((time, distance));
        self.end = Moment {
            time,
            pose: Pose::new(pose.x, pose.y, wrap_angle(pose.heading)),
            curvature: self.vehicle.curvature(self.end.steer),
            distance,
            gear,
            ..self.end
        };
    }

    /// When, seconds, and where along the path, metres, the car comes to stand, the end included.
    pub fn halts(&self) -> &[(f64, f64)] {
        &self.halts
    }

    /// The moment of arrival. For a path of no length it is the start.
    pub fn end(&self) -> Moment {
        self.end
    }

    /// The state `time` seconds after the start; before it and after the end the car stands.
    pub fn at(&self, time: f64) -> Moment {
        let time = time.max(0.0);
        let begun = self.phases.partition_point(|p| p.time <= time);
        match self.phases[..begun].last() {
            Some(phase) if time < self.end.time => phase.at(time, &self.vehicle),
            _ => Moment { time: time.max(self.end.time), ..self.end },
        }
    }

    /// Moments every `step` seconds, start and end, and every moment at which jerk or sharpness changes. So
    /// between two of them the jerk is constant, and the curvature changes steadily with the distance, or at
    /// standstill the wheels turn steadily.
    ///
    /// A multiple of `step` is left out where it would be nearer than 1 % of a step to another
    /// kind of moment; so moments are at most 102 % of a step apart.
    ///
    /// A step below [`Trajectory::LEAST_STEP`], or NaN, counts as that.
    pub fn sample(&self, step: f64) -> Vec<Moment> {
        let step = Self::LEAST_STEP.max(step);
        let changes: Vec<f64> = self.phases.iter().map(|p| p.time).chain([self.end.time]).collect();
        let is_apart = |time: f64| {
            let after = changes.partition_point(|&c| c <= time);
            changes[after.saturating_sub(1)..changes.len().min(after + 1)]
                .iter()
                .all(|c| (c - time).abs() >= 0.01 * step)
        };
        // Divided, not multiplied: the third moment at 0.05 s is 0.15, not 0.15000000000000002.
        let per_second = 1.0 / step;
        let grid = (1..).map(|i| f64::from(i) / per_second).take_while(|&t| t < self.end.time);
        let mut times: Vec<f64> = grid.filter(|&t| is_apart(t)).collect();
        times.extend(&changes);
        times.sort_unstable_by(f64::total_cmp);
        times.into_iter().map(|t| self.at(t)).collect()
    }

    /// Extremes and steering jumps.
    pub fn report(&self) -> TrajectoryReport {
        TrajectoryReport::of(self)
    }

    fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    fn phases_with_durations(&self) -> impl Iterator<Item = (&Phase, f64)> {
        let ends = self.phases.iter().skip(1).map(|p| p.time).chain([self.end.time]);
        self.phases.iter().zip(ends).map(|(phase, end)| (phase, end - phase.time))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::{Path, Segment};

    fn drive(segments: &[(f64, f64)], stop_to_steer: bool) -> Trajectory {
        let segments = segments.iter().map(|&(curvature, length)| Segment { curvature, length });
        let path = SmoothPath::of(&Path::new(Pose::new(1.0, 2.0, 0.3), segments));
        let limits = TrajectoryLimits { stop_to_steer, ..Default::default() };
        Trajectory::new(&path, &Vehicle::default(), &limits).unwrap()
    }

    #[test]
    fn one_straight_takes_the_time_of_the_textbook() {
        // 10 m at 2 m/s, v/a to change speeds, a/j for the jerk.
        let t = drive(&[(0.0, 10.0)], false);
        assert!((t.end().time - 7.5).abs() < 1e-9, "{:?}", t.end());
        let middle = t.at(3.75);
        assert!((middle.distance - 5.0).abs() < 1e-9 && middle.speed == 2.0, "{middle:?}");
        let back = drive(&[(0.0, -10.0)], false);
        assert!((back.end().time - 11.5).abs() < 1e-9, "{:?}", back.end());
        assert_eq!(back.at(5.5).speed, -1.0);
        assert!(back.at(0.5).acceleration < 0.0, "backward, speeding up lowers the speed");
    }

    #[test]
    fn a_path_of_no_length_is_one_moment() {
        let t = drive(&[], false);
        let moments = t.sample(0.05);
        assert_eq!(moments, [t.end()]);
        assert_eq!((moments[0].time, moments[0].pose), (0.0, Pose::new(1.0, 2.0, 0.3)));
        assert_eq!(t.report().duration_s, 0.0);
    }

    #[test]
    fn wheels_turn_at_standstill_and_jumps_are_reported() {
        let left = (0.2 * Vehicle::default().wheelbase).atan();
        let segments = [(0.2, 3.0), (-0.2, 3.0), (0.2, -2.0)];
        let t = drive(&segments, false);
        let r = t.report();
        assert_eq!((r.stops, r.steer_jumps.len(), r.steer_rate_kept), (1, 1, false));
        assert!((r.max_steer_jump_rad - 2.0 * left).abs() < 1e-12);
        assert!((r.steer_jump_dwell_s - 2.0 * left / 0.6).abs() < 1e-12);
        assert!((r.steer_jumps[0].distance_m - 3.0).abs() < 1e-12);
        // From straight to the left, and at the gear change from right to left.
        assert!((r.standing_s - 3.0 * left / 0.6).abs() < 1e-9);
        assert!((t.at(r.steer_jumps[0].time_s + 1e-9).steer + left).abs() < 1e-12);

        let stopping = drive(&segments, true).report();
        assert_eq!((stopping.stops, stopping.steer_jumps.len()), (2, 0));
        assert!(stopping.steer_rate_kept && stopping.duration_s > r.duration_s);
        assert!((stopping.standing_s - 5.0 * left / 0.6).abs() < 1e-9);
        assert_eq!(stopping.max_backward_speed_mps, 1.0);
        assert!(stopping.max_forward_speed_mps < 3.0_f64.sqrt());
    }

    #[test]
    fn gaps_between_samples_stay_within_two_per_cent_of_a_step() {
        // The wheels turn until 1.5 % before a multiple of the step; the car drives until 1.5 %
        // after the next one.
        let (step, rate) = (0.05, 0.6);
        let curvature = Vehicle::default().curvature(rate * (2.0 - 0.015) * step);
        let ramp = 1.03 * step;
        let path = Path::new(Pose::default(), [Segment { curvature, length: ramp * ramp }]);
        let path = SmoothPath::of(&path);
        let limits = TrajectoryLimits { steer_rate: rate, ..Default::default() };
        let t = Trajectory::new(&path, &Vehicle::default(), &limits).unwrap();
        let times: Vec<f64> = t.sample(step).iter().map(|m| m.time).collect();
        assert!(times.windows(2).all(|w| w[1] - w[0] <= 1.02 * step), "{times:?}");
    }

    #[test]
    fn any_step_gives_finitely_many_moments() {
        let t = drive(&[(0.0, 0.01)], false);
        let finest = t.sample(Trajectory::LEAST_STEP);
        for step in [0.0, -1.0, f64::NAN, 1e-300] {
            assert_eq!(t.sample(step), finest, "{step}");
        }
        assert_eq!(t.sample(f64::INFINITY).len(), t.phases.len() + 1);
    }

    #[test]
    fn differences_of_no_account_are_driven_over() {
        let t = drive(&[(0.1, 2.0), (0.1 + 1e-6, 2.0)], true);
        assert_eq!((t.report().stops, t.report().steer_jumps.len()), (0, 0));
    }
}
