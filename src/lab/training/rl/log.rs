//! What a training leaves beside its policy.

use serde::{Deserialize, Serialize};

use super::RlConfig;
use crate::environment::courses::{Course, Stratum};
use crate::lab::rl::sac::Losses;
use crate::world::ParkingType;

/// The training's log, written as JSON beside the policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RlLog {
    /// Where it learnt.
    pub course: Course,
    /// The settings.
    pub config: RlConfig,
    /// The curve.
    pub points: Vec<Point>,
    /// Which point's policy is stored.
    pub best: usize,
}

impl RlLog {
    /// The point whose policy is stored. Panics before there is any.
    pub fn best(&self) -> &Point {
        &self.points[self.best]
    }
}

/// A point of the curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Episodes until then.
    pub episodes: usize,
    /// Steps until then, random ones and those along curves included.
    pub steps: u64,
    /// Updates until then.
    pub updates: u64,
    /// Episodes parked and finished in each stratum since the point before.
    pub parked: [[u32; 2]; Stratum::COUNT],
    /// Their mean return, scaled.
    pub mean_return: f64,
    /// Their mean steps.
    pub mean_steps: f64,
    /// The last update.
    pub losses: Losses,
    /// Validation by drawn actions.
    pub sampled: Validation,
    /// Validation by the mean action within the mask.
    pub mean: Validation,
}

/// How one way of acting does on the validation problems.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// Problems of each stratum that were parked.
    pub parked: [u32; Stratum::COUNT],
    /// Mean steps of all of them.
    pub mean_steps: f64,
}

impl Validation {
    /// Problems parked.
    pub fn total(&self) -> u32 {
        self.parked.iter().sum()
    }

    /// Share of a type's problems that were parked, of `count` in each stratum.
    pub fn share(&self, kind: ParkingType, count: usize) -> f64 {
        let of_kind = |(i, _): &(usize, &u32)| Stratum::nth(*i).kind == kind;
        let levels = self.parked.iter().enumerate().filter(of_kind);
        let (problems, parked) = levels.fold((0, 0), |(n, p), (_, parked)| (n + count, p + parked));
        f64::from(parked) / problems.max(1) as f64
    }

    /// Whether it parks more problems, or as many in fewer steps.
    fn is_better_than(&self, other: &Validation) -> bool {
        let fewer = self.mean_steps < other.mean_steps;
        self.total() > other.total() || self.total() == other.total() && fewer
    }
}

impl Point {
    /// Share of the episodes since the point before that parked.
    pub fn success(&self) -> f64 {
        let sum = |i: usize| self.parked.iter().map(|p| f64::from(p[i])).sum::<f64>();
        sum(0) / sum(1).max(1.0)
    }

    /// Validation by whichever way of acting does better.
    pub fn validated(&self) -> &Validation {
        if self.sampled.is_better_than(&self.mean) { &self.sampled } else { &self.mean }
    }

    /// Whether its policy validates better than that of another point.
    pub fn is_better_than(&self, other: &Point) -> bool {
        self.validated().is_better_than(other.validated())
    }
}
