//! What nearness to obstacles costs along a path.
//!
//! The last term of the cost model: metres driven with something nearer than is comfortable.
//! A footprint grown by that distance is swept like the car's own; where it touches, the motion
//! is halved until the pieces are short. Around start and goal nothing is charged: there the
//! distance is given.

use crate::curves::{Path, Segment};
use crate::geometry::{Aabb, Pose};
use crate::world::collision::{BodyFrame, Sweep};

use super::Problem;
use super::cost::CostModel;

/// Pieces that are not halved any more, metres (for the default vehicle).
const PIECE: f64 = 0.5;
/// Nothing is charged within so many vehicle lengths of the start and of the goal.
const AROUND_START: f64 = 0.2;
const AROUND_GOAL: f64 = 0.4;
/// Farther from the goal than so many vehicle lengths the car is on its way.
const ON_THE_WAY: f64 = 2.0;

/// Prices nearness in one problem.
pub(super) struct Nearness<'a> {
    problem: &'a Problem,
    footprint: Aabb,
    distance: f64,
    /// Per metre; 0 where nothing is charged at all.
    weight: f64,
    piece: f64,
}

impl<'a> Nearness<'a> {
    /// For paths of `problem`; `model` is that of its vehicle.
    pub fn new(problem: &'a Problem, model: &CostModel) -> Self {
        let vehicle = &problem.vehicle;
        let scale = vehicle.scale();
        let distance = model.near;
        let weight = if vehicle.footprint(distance).max.x > problem.collision.footprint().max.x {
            model.clearance
        } else {
            0.0
        };
        let footprint = vehicle.footprint(distance);
        Self { problem, footprint, distance, weight, piece: PIECE * scale }
    }

    /// What is near, metres.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// What a whole path costs more for being near.
    pub fn of_path(&self, path: &Path) -> f64 {
        if self.weight == 0.0 {
            return 0.0;
        }
        path.legs().map(|(from, segment)| self.of_motion(from, segment)).sum()
    }

    /// Whether something is near where the car has left the start and is not yet at the spot.
    pub fn is_met_on_the_way(&self, path: &Path) -> bool {
        let collision = &self.problem.collision;
        let is_near = |(from, s): (Pose, Segment)| {
            // From the middle on: the first motion begins at the start.
            let half = Segment { length: s.length / 2.0, ..s };
            let middle = half.end(from);
            self.is_on_the_way(middle)
                && !(self.is_clear(middle)
                    && collision
                        .is_swept_free(&BodyFrame::new(middle), &Sweep::new(&self.footprint, half)))
        };
        self.weight > 0.0 && path.legs().any(is_near)
    }

    /// Whether the car has left the start and is not yet at the spot.
    pub fn is_on_the_way(&self, pose: Pose) -> bool {
        let Problem { start, goal, vehicle, .. } = self.problem;
        pose.distance(*start) > AROUND_START * vehicle.length
            && pose.distance(*goal) > ON_THE_WAY * vehicle.length
    }

    /// What motions from `from` cost more for being near.
    pub fn of_motions(&self, mut from: Pose, segments: &[Segment]) -> f64 {
        let mut total = 0.0;
        for &s in segments {
            total += self.of_motion(from, s);
            from = s.end(from);
        }
        total
    }

    /// What one motion costs more for being near.
    pub fn of_motion(&self, from: Pose, segment: Segment) -> f64 {
        if self.weight == 0.0 {
            return 0.0;
        }
        self.weight * self.near_metres(from, self.is_clear(from), segment)
    }

    fn is_clear(&self, at: Pose) -> bool {
        self.problem.collision.is_free_of(&self.footprint, at)
    }

    /// Metres of a motion with something near; `is_clear`: whether nothing is where it begins.
    fn near_metres(&self, from: Pose, is_clear: bool, segment: Segment) -> f64 {
        let world = &self.problem.collision;
        let length = segment.length.abs();
        let is_free = is_clear
            && world.is_swept_free(&BodyFrame::new(from), &Sweep::new(&self.footprint, segment));
        if is_free {
            return 0.0;
        }
        if length <= self.piece {
            let middle = segment.at(from, segment.length / 2.0);
            return if self.is_given(middle) { 0.0 } else { length };
        }
        let half = Segment { length: segment.length / 2.0, ..segment };
        let middle = half.end(from);
        self.near_metres(from, is_clear, half)
            + self.near_metres(middle, self.is_clear(middle), half)
    }

    /// Whether a pose is so close to start or goal that its distances are theirs.
    fn is_given(&self, pose: Pose) -> bool {
        let Problem { start, goal, vehicle, .. } = self.problem;
        pose.distance(*start) < AROUND_START * vehicle.length
            || pose.distance(*goal) < AROUND_GOAL * vehicle.length
    }
}
