//! Where a path may end: any of several goals, and near one of them where the scene allows it.
//!
//! A tolerance is a disc of positions and an interval of headings about a goal. A disc looks the
//! same from every frame, so that who reads a scene need not know where a goal's sides lie.

use serde::{Deserialize, Serialize};

use super::Scene;
use super::scene::InvalidField;
use crate::geometry::{Pose, Vec2, signed_angle};

/// How far from its goal a path may end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GoalTolerance {
    /// Distance of the rear axle from the goal's, metres.
    pub position_m: f64,
    /// Difference of heading to either side, radians.
    pub heading_rad: f64,
}

impl GoalTolerance {
    /// The largest `position_m`, metres.
    pub const MAX_POSITION: f64 = 1.0;
    /// The largest `heading_rad`, radians.
    pub const MAX_HEADING: f64 = 0.5;

    /// Checks both numbers.
    pub fn validate(&self) -> Result<(), InvalidField> {
        let fields = [
            ("position_m", self.position_m, Self::MAX_POSITION, "m"),
            ("heading_rad", self.heading_rad, Self::MAX_HEADING, "rad"),
        ];
        for (name, value, most, unit) in fields {
            if !(0.0..=most).contains(&value) {
                let field = format!("goal_tolerance.{name}");
                let message = format!("is {value}; expected a number from 0 to {most} {unit}");
                return Err(InvalidField { field, message });
            }
        }
        Ok(())
    }

    /// Whether `pose` is within the tolerance of `goal`, give or take `rounding` metres and radians.
    pub fn holds(&self, goal: Pose, pose: Pose, rounding: f64) -> bool {
        let turn = signed_angle(goal.heading, pose.heading).abs();
        goal.distance(pose) <= self.position_m + rounding && turn <= self.heading_rad + rounding
    }

    /// The poses that stand for all within the tolerance of `goal`: the goal itself, then the ends
    /// of its axes (along and across the car, turned), then those of two at once.
    pub fn poses(&self, goal: Pose) -> Vec<Pose> {
        let Self { position_m: r, heading_rad: turn } = *self;
        let still = Vec2::zeros();
        let moves = [Vec2::new(r, 0.0), Vec2::new(-r, 0.0), Vec2::new(0.0, r), Vec2::new(0.0, -r)];
        let turns = [turn, -turn];
        let mut poses = vec![goal];
        let mut add = |by: Vec2, turn: f64| {
            let p = goal.point_to_parent(by);
            poses.push(Pose::new(p.x, p.y, goal.heading + turn));
        };
        if r > 0.0 {
            moves.iter().for_each(|&by| add(by, 0.0));
        }
        if turn > 0.0 {
            turns.iter().for_each(|&turn| add(still, turn));
        }
        if r > 0.0 && turn > 0.0 {
            moves.iter().for_each(|&by| turns.iter().for_each(|&turn| add(by, turn)));
        }
        poses
    }
}

impl Scene {
    /// The poses to park at, of which any will do; at least one.
    pub fn all_goals(&self) -> &[Pose] {
        if self.goals.is_empty() { std::slice::from_ref(&self.goal) } else { &self.goals }
    }

    /// The field of the goal with this index.
    pub fn goal_field(&self, index: usize) -> String {
        if self.goals.is_empty() { "goal".to_owned() } else { format!("goals[{index}]") }
    }

    /// The same scene with `goal` as its only goal.
    pub fn with_goal(&self, goal: Pose) -> Scene {
        Scene { goal, goals: Vec::new(), ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pose_tried_is_within_the_tolerance() {
        let goal = Pose::new(3.0, -2.0, 1.0);
        for (position_m, heading_rad, count) in
            [(0.0, 0.0, 1), (0.1, 0.0, 5), (0.0, 0.05, 3), (0.1, 0.05, 15)]
        {
            let tolerance = GoalTolerance { position_m, heading_rad };
            let poses = tolerance.poses(goal);
            assert_eq!((poses[0], poses.len()), (goal, count));
            assert!(poses.iter().all(|&p| tolerance.holds(goal, p, 1e-12)), "{tolerance:?}");
        }
    }
}
