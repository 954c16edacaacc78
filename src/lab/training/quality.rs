//! How good proposed poses are, before any scene is planned with them.
//!
//! [`Errors`] says how far they lie from the poses wanted; [`Reach`], what they are worth to a
//! planner. The two may differ much: a start often has several good preparatory poses, metres
//! apart.

use serde::{Deserialize, Serialize};

use super::targets::{CellWorld, Example};
use crate::geometry::{Pose, signed_angle};
use crate::lab::dataset::Metadata;
use crate::planners::HybridAStar;

/// How far proposed poses lie from the preparatory poses wanted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean distance, metres.
    pub position_mean_m: f64,
    /// Median distance, metres.
    pub position_median_m: f64,
    /// 95th percentile of the distance, metres.
    pub position_p95_m: f64,
    /// Mean difference of the headings, radians.
    pub heading_mean_rad: f64,
    /// Median difference of the headings, radians.
    pub heading_median_rad: f64,
    /// 95th percentile of the difference of the headings, radians.
    pub heading_p95_rad: f64,
}

/// The errors of `proposed`, the poses for `examples`, of which there is at least one.
pub(super) fn errors(proposed: &[Pose], examples: &[Example]) -> Errors {
    let pairs = || proposed.iter().zip(examples);
    let mut positions: Vec<f64> = pairs().map(|(p, e)| p.distance(e.target)).collect();
    let mut headings: Vec<f64> =
        pairs().map(|(p, e)| signed_angle(p.heading, e.target.heading).abs()).collect();
    positions.sort_by(f64::total_cmp);
    headings.sort_by(f64::total_cmp);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let quantile = |v: &[f64], q: f64| v[((v.len() - 1) as f64 * q).round() as usize];
    Errors {
        position_mean_m: mean(&positions),
        position_median_m: quantile(&positions, 0.5),
        position_p95_m: quantile(&positions, 0.95),
        heading_mean_rad: mean(&headings),
        heading_median_rad: quantile(&headings, 0.5),
        heading_p95_rad: quantile(&headings, 0.95),
    }
}

/// Shares of proposed poses that spare a search, in their cells and the lane behind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// Poses looked at.
    pub rows: usize,
    /// One free curve (and a straight) leads from the pose into the spot.
    pub to_goal: f64,
    /// And one leads from the start to the pose: two curves are the whole plan.
    pub direct: f64,
    /// `to_goal` where the wanted pose is taken instead of the proposed one.
    pub wanted_to_goal: f64,
    /// `direct` where the wanted pose is taken instead of the proposed one.
    pub wanted_direct: f64,
}

impl Reach {
    /// Of all that the `parts` looked at.
    pub(super) fn mean(parts: &[Self]) -> Self {
        let rows = parts.iter().map(|p| p.rows).sum::<usize>();
        let mean = |share: fn(&Self) -> f64| {
            let found: f64 = parts.iter().map(|p| share(p) * p.rows as f64).sum();
            found / rows.max(1) as f64
        };
        Self {
            rows,
            to_goal: mean(|p| p.to_goal),
            direct: mean(|p| p.direct),
            wanted_to_goal: mean(|p| p.wanted_to_goal),
            wanted_direct: mean(|p| p.wanted_direct),
        }
    }
}

/// Judges `proposed`, the poses for `examples`; of many rows some, evenly spread.
pub(super) fn reach(metadata: &Metadata, examples: &[Example], proposed: &[Pose]) -> Reach {
    const MOST: usize = 1000;
    let mut planner = HybridAStar::new(metadata.planner);
    let mut counts = [0_usize; 4];
    let rows = examples.len().min(MOST);
    for i in (0..rows).map(|i| i * examples.len() / rows) {
        let (e, proposed) = (&examples[i], proposed[i]);
        let back = (-metadata.grid.back - e.start.x).max(0.0);
        let Some(world) = CellWorld::new(metadata, &e.cell, back) else { continue };
        let mut judge = |pose: Pose| {
            let finish = pose.is_finite() && world.finish(&mut planner, pose).is_some();
            [finish, finish && world.approach_is_direct(&mut planner, e.start, pose)]
        };
        let verdicts = [judge(proposed), judge(e.target)];
        for (count, yes) in counts.iter_mut().zip(verdicts.into_iter().flatten()) {
            *count += usize::from(yes);
        }
    }
    let [to_goal, direct, wanted_to_goal, wanted_direct] =
        counts.map(|c| c as f64 / rows.max(1) as f64);
    Reach { rows, to_goal, direct, wanted_to_goal, wanted_direct }
}
