//! Preparatory poses: learnt selectors, their artefacts, and N3P itself.
//!
//! A [`PoseSelector`] ranks preparatory poses for [`Features`]; [`knn`] and [`mlp`] are
//! the two of the paper, [`artefact`] reads and checks their files, and [`guided`] is
//! N3P: a planner that uses a selector. Read next: [`knn_file`] and [`network`] for what
//! the files hold.

pub mod artefact;
mod features;
pub mod guided;
pub mod knn;
pub mod knn_file;
pub mod mlp;
pub mod network;
mod normaliser;

pub use features::Features;
pub use normaliser::Normaliser;

use crate::curves::Segment;
use crate::geometry::Pose;
use crate::world::ParkingType;
use crate::world::cell::Grid;

/// Where to drive first, and what to do from there.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// The preparatory pose (rear axle, spot frame), for a curve to finish from.
    pub pose: Pose,
    /// Motions that end at the parked pose, where the selector knows any: driven back from
    /// there they begin at a preparatory pose of their own, for scenes too tight for one
    /// curve. Empty otherwise.
    pub manoeuvre: Vec<Segment>,
}

/// Ranks preparatory poses. Implementations are immutable and shared between threads.
pub trait PoseSelector: Send + Sync {
    /// Appends up to `k` proposals for `features`, best first. Appends none where the model
    /// knows nothing, such as an infeasible cell.
    fn select(&self, features: &Features, k: usize, out: &mut Vec<Proposal>);

    /// The grid of cells the model was trained on.
    fn grid(&self) -> &Grid;

    /// The parking types the model was trained for.
    fn kinds(&self) -> Vec<ParkingType>;
}
