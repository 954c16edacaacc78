//! Episodes of parking → a policy.
//!
//! Several environments are driven side by side, in lockstep; what they meet goes into the
//! replay memory, and the agent learns from it as [`crate::lab::rl::sac`] says. Every few hundred
//! episodes the policy parks validation problems: the best one so far is stored, and a
//! checkpoint is left from which an interrupted training goes on to the same end.
//!
//! Everything random comes from [`crate::rng`] by purpose and count, so that the same settings
//! give the same curve on the same kind of processor, interrupted or not.

mod card;
mod checkpoint;
mod config;
mod curve;
mod log;
mod strata;
mod trainer;

pub use checkpoint::checkpoint_path;
pub use config::RlConfig;
pub use log::{Point, RlLog};
pub use trainer::{Begin, train};
