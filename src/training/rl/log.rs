//! What a training leaves beside its policy.

use serde::{Deserialize, Serialize};

use super::RlConfig;
use crate::rl::courses::{Course, Stratum};
use crate::rl::sac::Losses;
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
    /// Validation problems of each stratum parked by drawn actions.
    pub validation_sampled: [u32; Stratum::COUNT],
    /// Validation problems of each stratum parked by the mean action within the mask.
    pub validation_mean: [u32; Stratum::COUNT],
}

impl Point {
    /// Share of the episodes since the point before that parked.
    pub fn success(&self) -> f64 {
        let sum = |i: usize| self.parked.iter().map(|p| f64::from(p[i])).sum::<f64>();
        sum(0) / sum(1).max(1.0)
    }

    /// Validation problems parked by whichever way of acting parks more.
    pub fn validated(&self) -> u32 {
        let sum = |parked: &[u32]| parked.iter().sum::<u32>();
        sum(&self.validation_sampled).max(sum(&self.validation_mean))
    }
}

/// Share of a type's validation problems that were parked.
pub fn share(parked: &[u32; Stratum::COUNT], kind: ParkingType, count: usize) -> f64 {
    let of_kind = |(i, _): &(usize, &u32)| Stratum::nth(*i).kind == kind;
    let levels = parked.iter().enumerate().filter(of_kind);
    let (problems, parked) = levels.fold((0, 0), |(n, p), (_, parked)| (n + count, p + parked));
    f64::from(parked) / problems.max(1) as f64
}
