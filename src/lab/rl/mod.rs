//! Reinforcement learning: policies, the environment they park in, and the one trained here.
//!
//! A [`Policy`] sees an [`Observation`] and answers with an [`Action`]. Policies from elsewhere are
//! an ONNX file (`onnx`) or any program (`process`).
//!
//! `senses` makes observations with the [`lidar`] and the mask of [`motion`]; [`parking_env`] is what
//! agents learn in, on problems of [`courses`].
//!
//! Source: M. Jiang et al., "HOPE: A Reinforcement Learning-based Hybrid Policy Path Planner for
//! Diverse Parking Scenarios", which the paper compares with.

#[cfg(feature = "lab")]
pub mod actor;
pub mod courses;
#[cfg(feature = "lab")]
pub(crate) mod drivers;
#[cfg(feature = "lab")]
pub mod encoding;
pub mod lidar;
pub mod motion;
#[cfg(feature = "lab")]
pub mod network;
#[cfg(feature = "lab")]
pub mod onnx;
#[cfg(feature = "lab")]
mod onnx_file;
pub mod parking_env;
#[cfg(feature = "lab")]
pub mod policy_file;
#[cfg(feature = "lab")]
pub mod process;
#[cfg(feature = "lab")]
pub mod replay;
#[cfg(feature = "lab")]
pub mod rollout;
#[cfg(feature = "lab")]
pub mod sac;
mod senses;
#[cfg(feature = "lab")]
pub mod source;

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Beams of the lidar: beam `i` points at `3 i` degrees counter-clockwise from the heading.
pub const BEAMS: usize = 120;
/// Numbers that say where the goal lies.
pub const TARGET: usize = 5;
/// Steering values of the action mask, per gear.
pub const MASK_STEERS: usize = 21;
/// Entries of the action mask: forward first, then backward.
pub const MASK: usize = 2 * MASK_STEERS;

/// What a policy sees of the world before each step. Everything is seen from the car: the rear
/// axle is the origin, the heading is +x. Where the spot lies on the driver's left the whole
/// scene is mirrored, so that it always lies on the right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Steps of this episode so far; 0 begins a new episode.
    pub step: u32,
    /// Free distance beyond the car's own outline along each beam, metres: from 0 (contact) up to
    /// 10 less the outline.
    pub lidar: [f32; BEAMS],
    /// Distance between the rear axles now and at the goal, metres; cosine and sine of the
    /// bearing of the goal's rear axle; cosine and sine of its heading relative to the car's.
    pub target: [f32; TARGET],
    /// For each of [`MASK_STEERS`] steering values from full left (+1) to full right (−1), forward
    /// first, then backward: the share of a full step that is free of contact, in tenths.
    pub mask: [f32; MASK],
}

/// What a policy does for one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Action {
    /// Steering angle over the steering limit, −1 (full right) to 1 (full left).
    pub steer: f64,
    /// Speed over the largest of its direction, −1 (full speed backward) to 1 (full speed
    /// forward).
    pub speed: f64,
}

/// Anything that drives step by step.
///
/// Results must depend on the observations of the episode and on `rng` alone.
pub trait Policy {
    /// The action for what is seen. `observation.step` is 0 when an episode begins.
    fn act(
        &mut self,
        observation: &Observation,
        rng: &mut ChaCha8Rng,
    ) -> Result<Action, PolicyFault>;
}

impl<P: Policy + ?Sized> Policy for Box<P> {
    fn act(
        &mut self,
        observation: &Observation,
        rng: &mut ChaCha8Rng,
    ) -> Result<Action, PolicyFault> {
        (**self).act(observation, rng)
    }
}

/// Why a policy gave no action. The scene counts as failed, and the next one begins anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.reason())]
pub enum PolicyFault {
    /// Its process ended.
    Ended,
    /// It took longer than its limit.
    TimedOut,
    /// Its answer is not an action.
    NoAction,
    /// Its answer holds NaN or infinity.
    NotFinite,
}

impl PolicyFault {
    /// The reason in rows.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Ended => "policy: its process ended",
            Self::TimedOut => "policy: no answer within its time limit",
            Self::NoAction => "policy: the answer is no action",
            Self::NotFinite => "policy: the answer is not finite",
        }
    }
}
