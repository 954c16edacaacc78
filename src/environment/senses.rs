//! What a policy is shown, and the curve that takes over from it.

use super::lidar::Lidar;
use super::motion::ActionMask;
use super::{Observation, TARGET};
use crate::curves::Segment;
use crate::geometry::{Pose, Vec2, signed_angle};
use crate::planners::hybrid_astar::GoalSet;
use crate::planners::{HybridAStar, HybridAStarConfig, Problem};
use crate::vehicle::Vehicle;

/// The senses of a car in the problem it has entered.
#[derive(Debug)]
pub struct Senses {
    curves: HybridAStar,
    vehicle: Vehicle,
    lidar: Lidar,
    mask: ActionMask,
    edges: Vec<(Vec2, Vec2)>,
    goal: GoalSet,
}

impl Senses {
    /// The senses of a car that parks in `problem`; `config` says which curves lead to the goal.
    pub fn new(problem: &Problem, config: &HybridAStarConfig) -> Self {
        let curves = HybridAStar::new(*config);
        Self {
            vehicle: problem.vehicle,
            lidar: Lidar::new(&problem.vehicle),
            mask: ActionMask::new(&problem.vehicle, problem.collision.footprint()),
            edges: problem.obstacles.edges().collect(),
            goal: curves.goal_set(problem),
            curves,
        }
    }

    /// Enters another problem; what depends on the car alone is kept.
    pub fn enter(&mut self, problem: &Problem) {
        if problem.vehicle != self.vehicle {
            *self = Self::new(problem, self.curves.config());
            return;
        }
        if problem.collision.footprint() != self.mask.footprint() {
            self.mask = ActionMask::new(&problem.vehicle, problem.collision.footprint());
        }
        self.edges.clear();
        self.edges.extend(problem.obstacles.edges());
        self.goal = self.curves.goal_set(problem);
    }

    /// What is seen from the free pose `pose`.
    pub fn observe(&self, problem: &Problem, pose: Pose, step: u32) -> Observation {
        Observation {
            step,
            lidar: self.lidar.scan(pose, &self.edges),
            target: target(pose, problem.goal),
            mask: self.mask.shares(problem, pose),
        }
    }

    /// The cheapest free Reeds-Shepp curve (and entry straight) from `pose` to the goal.
    pub fn curve_to_goal(&mut self, problem: &Problem, pose: Pose) -> Option<Vec<Segment>> {
        let found = self.curves.connect(problem, pose, &self.goal)?;
        Some(found.segments().collect())
    }
}

/// Where `goal` lies, seen from `pose`: see [`Observation::target`].
fn target(pose: Pose, goal: Pose) -> [f32; TARGET] {
    let seen = pose.relative(goal);
    let bearing = seen.y.atan2(seen.x);
    let turn = signed_angle(pose.heading, goal.heading);
    let distance = pose.distance(goal);
    [distance, bearing.cos(), bearing.sin(), turn.cos(), turn.sin()].map(|v| v as f32)
}
