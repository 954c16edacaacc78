//! How a car leaves a parallel spot: alternating full-lock arcs, each driven until it would
//! touch.
//!
//! Spot frame: the car stands at the goal with heading 0, the lane is at +y. Forward with
//! full left lock and backward with full right lock both turn the nose into the lane; in
//! the spot each goes as far as it is free (found by bisection over the exact swept
//! check). From the end of each forward arc the car may leave: directly, or by a right
//! arc that lines it up with the lane. Driven in reverse, an exit is the end of a parking
//! manoeuvre.

use std::f64::consts::FRAC_PI_2;

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
/// Shares of the last left arc after which the car is lined up with the lane.
const SHARES: [f64; 5] = [1.0, 0.85, 0.7, 0.55, 0.4];

/// A pose outside (or on the way out of) the spot, and the motions from there to the goal.
#[derive(Clone, Debug)]
pub(super) struct Exit {
    /// Where the exit leads.
    pub pose: Pose,
    /// The motions from `pose` to the goal, in driving order.
    pub way_in: Vec<Segment>,
}

/// Exits from the goal of `problem`, the fewest arcs first. Every `way_in` is free.
pub(super) fn exits(problem: &Problem) -> Vec<Exit> {
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

struct Manoeuvre<'a> {
    problem: &'a Problem,
    pose: Pose,
    /// Driven so far, outward.
    driven: Vec<Segment>,
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

    /// Adds the exits of this manoeuvre: one after each forward arc, and those lined up
    /// with the lane after the first arc that allows any.
    fn run(mut self, exits: &mut Vec<Exit>) {
        let full_lock = self.problem.vehicle.max_curvature();
        for _ in 0..ARCS / 2 {
            let begin = self.pose.heading;
            let room = (FRAC_PI_2 - begin) / full_lock;
            let left = self.longest(full_lock, Gear::Forward, room);
            let lined_up = self.lined_up(left, exits);
            self.drive(left);
            exits.push(self.exit([]));
            if lined_up {
                return;
            }
            let room = (FRAC_PI_2 - self.pose.heading) / full_lock;
            let back = self.longest(-full_lock, Gear::Backward, room);
            self.drive(back);
            if self.pose.heading - begin < STUCK {
                return;
            }
        }
    }

    /// Adds the exits that end parallel to the lane after some share of the arc `left`.
    fn lined_up(&self, left: Segment, exits: &mut Vec<Exit>) -> bool {
        let before = exits.len();
        for share in SHARES {
            let left = Segment { length: left.length * share, ..left };
            let pose = left.end(self.pose);
            let right =
                Segment { curvature: -left.curvature, length: pose.heading / left.curvature };
            if right.length > 0.0 && self.problem.collision.segment_is_free(pose, right) {
                exits.push(self.exit([left]));
                exits.push(self.exit([left, right]));
            }
        }
        exits.len() > before
    }

    /// The exit reached by driving `more` from here.
    fn exit<const N: usize>(&self, more: [Segment; N]) -> Exit {
        let pose = more.iter().fold(self.pose, |pose, s| s.end(pose));
        let driven = self.driven.iter().chain(&more).rev();
        Exit { pose, way_in: driven.map(|s| s.reversed()).collect() }
    }

    fn drive(&mut self, segment: Segment) {
        if segment.length != 0.0 {
            self.pose = segment.end(self.pose);
            self.driven.push(segment);
        }
    }

    /// The longest free motion from here of at most `limit` metres.
    fn longest(&self, curvature: f64, gear: Gear, limit: f64) -> Segment {
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
