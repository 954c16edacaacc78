//! Reinforcement learning: policies, and the one trained here.
//!
//! A [`Policy`] sees an [`Observation`] and answers with an [`Action`]
//! ([`mod@crate::environment`]). Policies from elsewhere are an ONNX file ([`onnx`]) or any program
//! ([`process`]); [`rollout`] makes a policy a planner.
//!
//! Source: M. Jiang et al., "HOPE: A Reinforcement Learning-based Hybrid Policy Path Planner for
//! Diverse Parking Scenarios", which the paper compares with.

pub mod actor;
pub(crate) mod drivers;
pub mod encoding;
pub mod network;
pub mod onnx;
mod onnx_file;
pub mod policy_file;
pub mod process;
pub mod replay;
pub mod rollout;
pub mod sac;
pub mod source;

use rand_chacha::ChaCha8Rng;

use crate::environment::{Action, Observation};

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
