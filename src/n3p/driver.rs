//! Methods that drive step by step: what the planner's layer knows of them.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::MethodSettings;
use crate::planners::Planner;
use crate::vehicle::Vehicle;

/// A policy that can be driven with: makes planners around itself, one for each thread.
pub trait Driver: Send + Sync {
    /// The planner called `name`; the error says why it cannot be had.
    fn planner(
        &self,
        name: &'static str,
        settings: &MethodSettings,
    ) -> Result<Box<dyn Planner + Send>, String>;
}

/// A trained policy, as read from its file.
pub struct TrainedPolicy {
    /// Where it learnt, the name after `rl-`.
    pub course: &'static str,
    /// The vehicle it drove.
    pub vehicle: Vehicle,
    /// What drives.
    pub driver: Arc<dyn Driver>,
}

/// Rules of a rollout.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RolloutConfig {
    /// How a trained actor's Gaussian becomes an action; other policies decide themselves.
    pub choice: Choice,
    /// Steps after which a policy has failed.
    pub horizon: u32,
    /// Curves to the goal are tried from poses nearer to it than this, metres.
    pub curve_distance: f64,
}

impl Default for RolloutConfig {
    fn default() -> Self {
        Self { choice: Choice::default(), horizon: 400, curve_distance: 10.0 }
    }
}

impl RolloutConfig {
    /// Checks every setting.
    pub fn validate(&self) -> Result<(), String> {
        let within = |field: &str, v: f64, low: f64, high: f64| {
            if (low..=high).contains(&v) {
                return Ok(());
            }
            Err(format!("{field} is {v}; expected a number from {low} to {high}"))
        };
        within("horizon", f64::from(self.horizon), 1.0, 1e6)?;
        within("curve_distance", self.curve_distance, 0.0, 1000.0)
    }
}

/// How an actor's Gaussian becomes an action.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Choice {
    /// Drawn, as HOPE does in evaluation too.
    #[default]
    Sampled,
    /// The mean, as far as the mask admits it.
    Mean,
}
