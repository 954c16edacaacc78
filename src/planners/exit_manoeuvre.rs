//! How a car leaves a parallel spot: alternating full-lock arcs, each driven until it would
//! touch.
//!
//! Spot frame: the car stands at the goal with heading 0, the lane is at +y. Forward with
//! full left lock and backward with full right lock both turn the nose into the lane; in
//! the spot each goes as far as it is free (found by bisection over the exact swept
//! check). From the end of each forward arc the car may leave: directly, or by a right
//! arc that lines it up with the lane. Driven in reverse, an exit is the end of a parking
//! manoeuvre.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3};

use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::Gear;

use super::Problem;

/// Arcs of one manoeuvre inside the spot, at most.
const ARCS: usize = 24;
/// A manoeuvre that turns the car by less than this in two arcs is stuck, radians.
const STUCK: f64 = 0.01;
/// Bisection ends at this length, metres.
const PRECISION: f64 = 0.005;
/// The nose turns no further from the lane's direction, radians.
pub(super) const STEEPEST: f64 = FRAC_PI_2;
/// A car turned so far has left the spot, radians.
const STEEP: f64 = FRAC_PI_3;
/// Shares of the left arc that leaves the spot after which it may end.
const SHARES: [f64; 5] = [1.0, 0.85, 0.7, 0.55, 0.4];

/// A pose outside (or on the way out of) the spot, and the motions from there to the goal.
#[derive(Clone, Debug)]
pub(crate) struct Exit {
    /// Where the exit leads.
    pub pose: Pose,
    /// The motions from `pose` to the goal, in driving order.
    pub way_in: Vec<Segment>,
}

/// Exits from the goal of `problem`: those of the manoeuvre that begins right there, then
/// those after a straight back. Every `way_in` is free. The goal must lie in a parallel
/// spot.
pub(crate) fn exits(problem: &Problem) -> Vec<Exit> {
    let mut exits = Vec::new();
    for settle in [Settle::Here, Settle::Back] {
        Manoeuvre::new(problem, settle).run(&mut exits);
    }
    exits
}

/// What comes before the first left arc.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Settle {
    /// Nothing.
    Here,
    /// A straight back as far as it is free, which gives the first arc the most room.
    Back,
}

/// Motions out of the spot, and where they lead.
pub(super) struct Manoeuvre<'a> {
    pub problem: &'a Problem,
    pub pose: Pose,
    /// Driven so far, outward.
    pub driven: Vec<Segment>,
}

impl<'a> Manoeuvre<'a> {
    fn new(problem: &'a Problem, settle: Settle) -> Self {
        let mut manoeuvre = Self { problem, pose: problem.goal, driven: Vec::new() };
        if settle == Settle::Back {
            let back = manoeuvre.longest(0.0, Gear::Backward, problem.vehicle.length);
            manoeuvre.drive(back);
        }
        manoeuvre
    }

    /// Adds the exits of this manoeuvre: the end of each forward arc inside the spot, then
    /// several along the first arc that leaves it.
    fn run(mut self, exits: &mut Vec<Exit>) {
        let full_lock = self.problem.vehicle.max_curvature();
        for _ in 0..ARCS / 2 {
            let begin = self.pose.heading;
            let left = self.longest(full_lock, Gear::Forward, (STEEPEST - begin) / full_lock);
            let leaves = self.leave(left, exits);
            self.drive(left);
            if leaves || self.pose.heading >= STEEPEST - 1e-6 {
                return;
            }
            exits.push(self.exit(&[]));
            let room = (STEEPEST - self.pose.heading) / full_lock;
            let back = self.longest(-full_lock, Gear::Backward, room);
            self.drive(back);
            if self.pose.heading - begin < STUCK {
                return;
            }
        }
    }

    /// Adds the exits along an arc forward on full left lock, if it leaves the spot.
    pub fn leave_if_free(&self, exits: &mut Vec<Exit>) -> bool {
        let full_lock = self.problem.vehicle.max_curvature();
        let room = (STEEPEST - self.pose.heading) / full_lock;
        self.leave(self.longest(full_lock, Gear::Forward, room), exits)
    }

    /// Adds the exits along the arc `left`, if it leaves the spot: the arc ends at some share
    /// of it, and where there is room another lines the car up with the lane.
    fn leave(&self, left: Segment, exits: &mut Vec<Exit>) -> bool {
        let (goal, vehicle) = (self.problem.goal, &self.problem.vehicle);
        let before = exits.len();
        let mut leaves = left.end(self.pose).heading >= STEEP;
        for share in SHARES {
            let left = Segment { length: left.length * share, ..left };
            let pose = left.end(self.pose);
            exits.push(self.exit(&[left]));
            let right =
                Segment { curvature: -left.curvature, length: pose.heading / left.curvature };
            // Lined up, the car stands beside the parked one.
            let out = right.end(pose).y - goal.y >= vehicle.width;
            if out && self.problem.collision.segment_is_free(pose, right) {
                exits.push(self.exit(&[left, right]));
                leaves = true;
            }
        }
        if !leaves {
            exits.truncate(before);
        }
        leaves
    }

    /// The exit reached by driving `more` from here.
    pub fn exit(&self, more: &[Segment]) -> Exit {
        let pose = more.iter().fold(self.pose, |pose, s| s.end(pose));
        let driven = self.driven.iter().chain(more).rev();
        Exit { pose, way_in: driven.map(|s| s.reversed()).collect() }
    }

    fn drive(&mut self, segment: Segment) {
        if segment.length != 0.0 {
            self.pose = segment.end(self.pose);
            self.driven.push(segment);
        }
    }

    /// The longest free motion from here of at most `limit` metres.
    pub fn longest(&self, curvature: f64, gear: Gear, limit: f64) -> Segment {
        let motion = |length: f64| Segment { curvature, length: gear.sign() * length };
        let free = |length| self.problem.collision.segment_is_free(self.pose, motion(length));
        let (mut low, mut high) = (0.0, limit.max(0.0));
        if free(high) {
            return motion(high);
        }
        while high - low > PRECISION {
            let middle = (low + high) / 2.0;
            if free(middle) { low = middle } else { high = middle }
        }
        motion(low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::Path;
    use crate::vehicle::Vehicle;
    use crate::world::generate::{GeneratorConfig, generate};
    use crate::world::{Level, ParkingType};

    #[test]
    fn every_exit_is_free_and_leads_to_the_goal() {
        let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
        for level in Level::ALL {
            for i in 0..50 {
                let scene = generate(&config, &vehicle, ParkingType::Parallel, level, 78, i);
                let problem = Problem::new(&scene).unwrap();
                let exits = exits(&problem);
                let out = exits.iter().any(|e| e.pose.y - problem.goal.y >= vehicle.width / 2.0);
                assert!(out, "{}: no exit leaves the spot", scene.name);
                for Exit { pose, way_in } in exits {
                    let path = Path::new(pose, way_in);
                    assert!(problem.collision.path_is_free(&path), "{} {pose:?}", scene.name);
                    assert!(path.end().distance(problem.goal) < 1e-9, "{} {pose:?}", scene.name);
                    assert!((path.end().heading - problem.goal.heading).abs() < 1e-9);
                    assert!(path.max_abs_curvature() <= vehicle.max_curvature() + 1e-12);
                }
            }
        }
    }

    #[test]
    fn the_bisected_motion_ends_just_before_contact() {
        let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
        let scene = generate(&config, &vehicle, ParkingType::Parallel, Level::Extreme, 78, 0);
        let problem = Problem::new(&scene).unwrap();
        let at_goal = Manoeuvre::new(&problem, Settle::Here);
        let back = at_goal.longest(0.0, Gear::Backward, 5.0);
        let further = Segment::straight(back.length - 2.0 * PRECISION);
        assert!(back.length < 0.0 && problem.collision.segment_is_free(problem.goal, back));
        assert!(!problem.collision.segment_is_free(problem.goal, further));
    }
}
