//! The cost of driving, the same for every method of a table.
//!
//! The paper gives the terms (λ_f or λ_b per metre, gear changes, |δ|, |Δδ|) and no
//! weights; ours are below.

use serde::{Deserialize, Serialize};

use crate::curves::{Path, Segment};
use crate::vehicle::{Gear, Vehicle};

use super::Problem;
use super::nearness::Nearness;

/// Weights of the cost terms, those of changes for the default vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CostModel {
    /// λ_f, per metre driven forward.
    pub forward: f64,
    /// λ_b, per metre driven backward.
    pub backward: f64,
    /// Per change of gear.
    pub gear_change: f64,
    /// Per radian of |δ| and metre.
    pub steer: f64,
    /// Per radian of |Δδ| between segments.
    pub steer_change: f64,
    /// Per metre driven nearer to an obstacle than `near`.
    ///
    /// This and `near` are left out of files where they are as usual: data sets are collected
    /// without them, and keep their checksums.
    #[serde(skip_serializing_if = "CostModel::is_usual_clearance")]
    pub clearance: f64,
    /// What is near, metres.
    #[serde(skip_serializing_if = "CostModel::is_usual_near")]
    pub near: f64,
}

impl Default for CostModel {
    fn default() -> Self {
        Self {
            forward: 1.0,
            backward: 1.2,
            gear_change: 3.0,
            steer: 0.05,
            steer_change: 0.2,
            clearance: 0.4,
            near: 0.2,
        }
    }
}

/// What the cost of the next segment depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveState {
    /// The gear driven last; `None` at the start, where either gear is free.
    pub gear: Option<Gear>,
    /// The steering angle driven last, radians.
    pub steer: f64,
}

impl DriveState {
    /// Standing still with straight wheels.
    pub const PARKED: DriveState = DriveState { gear: None, steer: 0.0 };
}

impl CostModel {
    fn is_usual_clearance(clearance: &f64) -> bool {
        *clearance == Self::default().clearance
    }

    fn is_usual_near(near: &f64) -> bool {
        *near == Self::default().near
    }

    /// Checks every field: finite, not negative, and metres not free.
    pub fn validate(&self) -> Result<(), String> {
        for (field, v, min) in [
            ("forward", self.forward, 1e-3),
            ("backward", self.backward, 1e-3),
            ("gear_change", self.gear_change, 0.0),
            ("steer", self.steer, 0.0),
            ("steer_change", self.steer_change, 0.0),
            ("clearance", self.clearance, 0.0),
            ("near", self.near, 0.0),
        ] {
            if !(v.is_finite() && v >= min && v <= 1e6) {
                return Err(format!("cost.{field} is {v}; expected a number from {min} to 1e6"));
            }
        }
        Ok(())
    }

    /// The weights for a vehicle `scale` times as long as the default one: what a change is
    /// worth is counted in metres, too.
    pub fn scaled(&self, scale: f64) -> Self {
        let (gear_change, steer_change) = (self.gear_change * scale, self.steer_change * scale);
        Self { gear_change, steer_change, near: self.near * scale, ..*self }
    }

    /// Cost per metre in `gear`, without steering.
    pub fn per_metre(&self, gear: Gear) -> f64 {
        match gear {
            Gear::Forward => self.forward,
            Gear::Backward => self.backward,
        }
    }

    /// Motions shorter than this are not worth driving, metres: what costs less than that is to be
    /// reached otherwise where it can be.
    pub fn shortest_motion(vehicle: &Vehicle) -> f64 {
        0.01 * vehicle.scale()
    }

    /// Cost of changing gear and steering between two motions.
    pub fn change(&self, before: DriveState, after: DriveState) -> f64 {
        match (before.gear, after.gear) {
            (Some(a), Some(b)) => {
                let gear = if a == b { 0.0 } else { self.gear_change };
                gear + self.steer_change * (after.steer - before.steer).abs()
            }
            // Standing before the first motion or after the last: wheels only.
            (None, Some(_)) => self.steer_change * after.steer.abs(),
            (_, None) => 0.0,
        }
    }

    /// Cost of one segment driven with steering angle `steer`, and the state after it.
    pub fn segment(&self, before: DriveState, length: f64, steer: f64) -> (f64, DriveState) {
        let gear = Gear::of(length);
        let after = DriveState { gear: Some(gear), steer };
        let driven = length.abs() * (self.per_metre(gear) + self.steer * steer.abs());
        (driven + self.change(before, after), after)
    }

    /// Cost of driving `segments` from standstill.
    pub fn path(&self, vehicle: &Vehicle, segments: &[Segment]) -> f64 {
        let mut state = DriveState::PARKED;
        let mut total = 0.0;
        for s in segments {
            let (cost, next) = self.segment(state, s.length, vehicle.steer(s.curvature));
            total += cost;
            state = next;
        }
        total
    }

    /// Cost of a whole path of `problem`, nearness to its obstacles included: what planners compare.
    pub fn of_plan(&self, problem: &Problem, path: &Path) -> f64 {
        let model = self.scaled(problem.vehicle.scale());
        let nearness = Nearness::new(problem, &model).of_path(path);
        model.path(&problem.vehicle, &path.segments) + nearness
    }
}
