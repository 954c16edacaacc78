//! The parking environment: steps, rewards, and the curve that takes over.
//!
//! Differences from HOPE, all said in docs/design-notes.md: contact is found exactly, the bay's goal
//! is the set that every method here has, and time running out is no failure to learn from.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::motion::drive;
use super::senses::Senses;
use super::{Action, Observation};
use crate::geometry::{Aabb, Pose};
use crate::planners::{HybridAStarConfig, Problem};

/// Rules of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnvConfig {
    /// Steps after which an episode ends.
    pub horizon: u32,
    /// Share of the parked footprint that must be covered to count as parked.
    pub parked_overlap: f64,
    /// Curves to the goal are tried from poses nearer to it than this, metres.
    pub curve_distance: f64,
    /// The rear axle stays in the box around start and goal grown by this, metres.
    pub reach: f64,
    /// Factor of every reward.
    pub reward_scale: f64,
}

impl Default for EnvConfig {
    fn default() -> Self {
        Self {
            horizon: 200,
            parked_overlap: 0.9,
            curve_distance: 10.0,
            reach: 10.0,
            reward_scale: 0.1,
        }
    }
}

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The car stands in its spot.
    Parked,
    /// The rear axle left the region it should stay in.
    OutOfBounds,
    /// The steps ran out. What would have followed still counts: learning looks beyond this end.
    OutOfTime,
}

/// One step of an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// What was done: the action given, or the next one of the curve that took over.
    pub action: Action,
    /// The reward, scaled.
    pub reward: f64,
    /// Whether, and how, the episode ended.
    pub end: Option<End>,
}

/// Where an episode stands: all that is needed to go on with it later.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Steps so far.
    pub step: u32,
    /// The car now.
    pub pose: Pose,
    /// Whether the last step moved the car.
    pub moved: bool,
    /// The best intersection over union of the car and its parked footprint so far.
    best_iou: f64,
    /// The rest of the curve that took over.
    script: VecDeque<Action>,
}

/// One car in one problem.
#[derive(Debug)]
pub struct ParkingEnv {
    config: EnvConfig,
    problem: Problem,
    senses: Senses,
    region: Aabb,
    progress: Progress,
}

impl ParkingEnv {
    /// An episode that begins at the problem's start.
    pub fn new(problem: Problem, config: EnvConfig) -> Self {
        let senses = Senses::new(&problem, &HybridAStarConfig::default());
        let progress = Progress::at(&problem);
        let region = region(&problem, &config);
        Self { config, problem, senses, region, progress }
    }

    /// Begins an episode in another problem.
    pub fn enter(&mut self, problem: Problem) {
        self.senses.enter(&problem);
        self.progress = Progress::at(&problem);
        self.region = region(&problem, &self.config);
        self.problem = problem;
    }

    /// Goes on where an episode in this problem was left.
    pub fn resume(&mut self, progress: Progress) {
        self.progress = progress;
    }

    /// Where the episode stands.
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// The problem.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// What the car sees now.
    pub fn observe(&self) -> Observation {
        self.senses.observe(&self.problem, self.progress.pose, self.progress.step)
    }

    /// Whether a curve drives: the next action will not be asked for.
    pub fn is_scripted(&self) -> bool {
        !self.progress.script.is_empty()
    }

    /// Drives one step: the next action of a curve that took over, else `action`.
    pub fn step(&mut self, action: Action) -> Step {
        let Self { config, problem, progress, .. } = self;
        let action = progress.script.pop_front().unwrap_or(action);
        let before = progress.pose;
        let driven = drive(problem, before, action.motion(&problem.vehicle));
        progress.moved = driven.length != 0.0;
        progress.pose = driven.end(before);
        progress.step += 1;
        let overlap = problem.vehicle.overlap(progress.pose, problem.goal);
        let end = if overlap >= config.parked_overlap {
            Some(End::Parked)
        } else if !self.region.contains(progress.pose.position()) {
            Some(End::OutOfBounds)
        } else {
            (progress.step >= config.horizon).then_some(End::OutOfTime)
        };
        let reward = match end {
            Some(End::Parked) => 50.0,
            Some(End::OutOfBounds) => -50.0,
            Some(End::OutOfTime) | None => self.shaped_reward(before, overlap),
        };
        if end.is_none() && self.progress.script.is_empty() {
            self.try_curve();
        }
        Step { action, reward: self.config.reward_scale * reward, end }
    }

    /// Lets a free curve to the goal take over, if there is one from here.
    fn try_curve(&mut self) {
        let Self { config, problem, senses, progress, .. } = self;
        if progress.pose.distance(problem.goal) < config.curve_distance
            && let Some(curve) = senses.curve_to_goal(problem, progress.pose)
        {
            let actions = curve.iter().flat_map(|&s| Action::along(s, &problem.vehicle));
            progress.script = actions.collect();
        }
    }

    /// Time, way toward the goal, and more of the spot covered than ever before.
    fn shaped_reward(&mut self, before: Pose, overlap: f64) -> f64 {
        let Self { problem, progress, .. } = self;
        let iou = overlap / (2.0 - overlap);
        let covered = (iou - progress.best_iou).max(0.0);
        progress.best_iou += covered;
        let nearer = before.distance(problem.goal) - progress.pose.distance(problem.goal);
        let far = problem.start.distance(problem.goal).max(10.0);
        let time = (f64::from(progress.step) / 2000.0).tanh();
        5.0 * nearer / far + 10.0 * covered - time
    }
}

impl Progress {
    fn at(problem: &Problem) -> Self {
        let overlap = problem.vehicle.overlap(problem.start, problem.goal);
        let best_iou = overlap / (2.0 - overlap);
        let script = VecDeque::new();
        Self { step: 0, pose: problem.start, moved: true, best_iou, script }
    }
}

fn region(problem: &Problem, config: &EnvConfig) -> Aabb {
    Aabb::around([problem.start.position(), problem.goal.position()]).inflated(config.reach)
}
