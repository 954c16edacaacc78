//! Actions as motions, and how much of a motion is free.
//!
//! A step lasts half a second at constant speed and steering. It is driven in ten parts and
//! ends before the first part that would touch something: contact is never entered.

use super::{Action, MASK, MASK_STEERS};
use crate::curves::Segment;
use crate::geometry::{Aabb, Pose};
use crate::planners::Problem;
use crate::vehicle::{Gear, Vehicle};
use crate::world::collision::{BodyFrame, Sweep};

/// Duration of a step, seconds.
pub const STEP_S: f64 = 0.5;

/// Parts that a step is driven in.
pub const PARTS: u32 = 10;

/// Length of a full step in `gear`, metres (1 m and 0.5 m at the paper's speeds).
pub fn full_step(vehicle: &Vehicle, gear: Gear) -> f64 {
    vehicle.speed(gear) * STEP_S
}

impl Action {
    /// The motion asked for. Values beyond ±1 count as ±1.
    pub fn motion(self, vehicle: &Vehicle) -> Segment {
        let speed = self.speed.clamp(-1.0, 1.0);
        let steer = self.steer.clamp(-1.0, 1.0) * vehicle.max_steer;
        let curvature = if self.steer.abs() >= 1.0 {
            // Exactly that of Reeds-Shepp curves.
            self.steer.signum() / vehicle.turning_radius()
        } else {
            steer.tan() / vehicle.wheelbase
        };
        Segment { curvature, length: speed * full_step(vehicle, Gear::of(speed)) }
    }

    /// The actions that drive `segment`, whose curvature is 0 or the largest: full steps and
    /// what remains.
    pub fn along(segment: Segment, vehicle: &Vehicle) -> impl Iterator<Item = Action> {
        /// Remainders below this share of a step are rounding.
        const LEAST: f64 = 1e-9;
        let full = full_step(vehicle, segment.gear());
        let steer = (segment.curvature * vehicle.turning_radius()).round();
        let steps = segment.length.abs() / full;
        let (whole, rest) = ((steps + LEAST).floor(), steps.fract());
        let rest = Some(rest).filter(|r| (LEAST..1.0 - LEAST).contains(r));
        let speeds = std::iter::repeat_n(1.0, whole as usize).chain(rest);
        speeds.map(move |speed| Action { steer, speed: speed * segment.gear().sign() })
    }

    /// Whether both components are numbers.
    pub fn is_finite(self) -> bool {
        self.steer.is_finite() && self.speed.is_finite()
    }
}

/// What is driven of `motion` from the free pose `from`: all of it, or the parts before the one
/// that would touch something.
pub fn drive(problem: &Problem, from: Pose, motion: Segment) -> Segment {
    let frame = BodyFrame::new(from);
    let parts = free_parts(|k| {
        let sweep = Sweep::new(problem.collision.footprint(), part(motion, k));
        problem.collision.sweep_is_free(&frame, &sweep)
    });
    part(motion, parts)
}

/// The first `parts` parts of a motion.
fn part(motion: Segment, parts: u32) -> Segment {
    Segment { length: motion.length * f64::from(parts) / f64::from(PARTS), ..motion }
}

/// How many parts of a motion are free, where `free` says whether the first `k` are.
fn free_parts(mut free: impl FnMut(u32) -> bool) -> u32 {
    if free(PARTS) {
        return PARTS;
    }
    let (mut known, mut touching) = (0, PARTS);
    while touching - known > 1 {
        let middle = known.midpoint(touching);
        *(if free(middle) { &mut known } else { &mut touching }) = middle;
    }
    known
}

/// The action mask: how much of each of [`MASK`] full steps is free.
#[derive(Clone, Debug)]
pub struct ActionMask {
    footprint: Aabb,
    /// The sweeps of the first 1, 2, … [`PARTS`] parts of each action.
    sweeps: Vec<[Sweep; PARTS as usize]>,
}

impl ActionMask {
    /// The mask of a car with `footprint`, its margin included.
    pub fn new(vehicle: &Vehicle, footprint: &Aabb) -> Self {
        let sweeps = (0..MASK).map(|i| {
            let motion = action(i).motion(vehicle);
            std::array::from_fn(|k| Sweep::new(footprint, part(motion, k as u32 + 1)))
        });
        Self { footprint: *footprint, sweeps: sweeps.collect() }
    }

    /// The footprint it was made for.
    pub fn footprint(&self) -> &Aabb {
        &self.footprint
    }

    /// The free share of each action from `pose`, in tenths: exact, by swept checks. Driving
    /// that share of an action never touches anything.
    pub fn shares(&self, problem: &Problem, pose: Pose) -> [f32; MASK] {
        let frame = BodyFrame::new(pose);
        let collision = &problem.collision;
        // What one action touches, its neighbours mostly touch too.
        let mut suspect = None;
        std::array::from_fn(|i| {
            let sweep = |k: u32| &self.sweeps[i][k as usize - 1];
            let free = |k| collision.sweep_is_free_of(&mut suspect, &frame, sweep(k));
            free_parts(free) as f32 / PARTS as f32
        })
    }
}

/// The action of a mask's entry: full speed, steering evenly from full left to full right.
pub fn action(entry: usize) -> Action {
    let (gear, steer) = (entry / MASK_STEERS, entry % MASK_STEERS);
    let middle = (MASK_STEERS / 2) as f64;
    let speed = if gear == 0 { 1.0 } else { -1.0 };
    Action { steer: (middle - steer as f64) / middle, speed }
}

/// `action` as far as `mask` admits it: steered as the nearest entry of its gear, and no farther
/// than that one is free.
pub fn admitted(wanted: Action, mask: &[f32; MASK]) -> Action {
    let middle = (MASK_STEERS / 2) as f64;
    let column = (middle - wanted.steer.clamp(-1.0, 1.0) * middle).round() as usize;
    let row = if wanted.speed < 0.0 { MASK_STEERS } else { 0 };
    let entry = row + column.min(MASK_STEERS - 1);
    // Tenths again: single precision may lie above them.
    let parts = f64::from(PARTS);
    let limit = (f64::from(mask[entry]) * parts).round() / parts;
    Action { speed: wanted.speed.clamp(-limit, limit), ..action(entry) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_lock_is_the_curvature_of_reeds_shepp_curves() {
        let v = Vehicle::default();
        let motion = Action { steer: 1.7, speed: -3.0 }.motion(&v);
        assert_eq!(motion, Segment { curvature: 1.0 / v.turning_radius(), length: -0.5 });
        let middle = Action { steer: -0.5, speed: 0.5 }.motion(&v);
        assert!((v.steer(middle.curvature) + v.max_steer / 2.0).abs() < 1e-12);
        assert_eq!(middle.length, 0.5);
    }

    #[test]
    fn steps_along_a_segment_are_the_segment() {
        let v = Vehicle::default();
        for length in [0.3, -0.5, 1.0, 2.0, 3.37, -1.2, 1e-12, -4.0 + 1e-13] {
            for curvature in [0.0, v.max_curvature(), -v.max_curvature()] {
                let segment = Segment { curvature, length };
                let steps: Vec<_> = Action::along(segment, &v).collect();
                let pose = Pose::new(1.0, 2.0, 0.4);
                let end = steps.iter().fold(pose, |p, a| a.motion(&v).end(p));
                assert!(end.distance(segment.end(pose)) < 1e-8, "{segment:?} {steps:?}");
                assert_eq!(
                    steps.len() as f64,
                    (length.abs() / full_step(&v, segment.gear()) - 1e-9).ceil().max(0.0)
                );
            }
        }
    }

    #[test]
    fn entries_go_from_left_to_right_and_are_admitted_as_they_are() {
        assert_eq!(action(0), Action { steer: 1.0, speed: 1.0 });
        assert_eq!(action(10), Action { steer: 0.0, speed: 1.0 });
        assert_eq!(action(MASK - 1), Action { steer: -1.0, speed: -1.0 });
        for entry in 0..MASK {
            let mut mask = [0.0; MASK];
            mask[entry] = 0.5;
            let a = admitted(action(entry), &mask);
            assert_eq!(a, Action { speed: 0.5 * action(entry).speed, ..action(entry) });
        }
        let a = admitted(Action { steer: 0.26, speed: 0.4 }, &[1.0; MASK]);
        assert_eq!(a, Action { steer: 0.3, speed: 0.4 });
    }

    #[test]
    fn bisection_counts_as_one_by_one() {
        for free in 0..=PARTS {
            assert_eq!(free_parts(|k| k <= free), free);
        }
    }
}
