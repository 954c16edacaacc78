//! The parking environment: what policies see, do and learn in.
//!
//! `senses` makes an [`Observation`] with the [`lidar`] and the mask of [`motion`], which also drives
//! an [`Action`]; [`parking_env`] is what agents learn in, on problems of [`courses`].
//!
//! Source: M. Jiang et al., "HOPE: A Reinforcement Learning-based Hybrid Policy Path Planner for
//! Diverse Parking Scenarios", which the paper compares with.

pub mod courses;
pub mod lidar;
pub mod motion;
pub mod parking_env;
pub(crate) mod senses;

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
