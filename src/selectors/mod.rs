//! Preparatory poses: learnt selectors and their files.
//!
//! A [`PoseSelector`] ranks preparatory poses for [`Features`]; [`knn`] and [`mlp`] are
//! the two of the paper, [`fleet`] is one for any vehicle; [`by_kind`] joins two of
//! different parking types. [`foresight`] says what a library's manoeuvres are worth in a scene. [`artefact`] reads and checks their files,
//! [`model`] tells them apart, [`shipped`] has those compiled in. Read next: [`knn_file`] and
//! [`network`] for what the files hold, [`nearest`] for how neighbours are found, [`mod@crate::n3p`] for the planner that uses a selector.

pub mod artefact;
pub mod by_kind;
mod features;
pub mod fleet;
pub mod foresight;
pub mod knn;
pub mod knn_file;
pub mod mlp;
pub mod model;
pub mod nearest;
pub mod network;
mod normaliser;
pub mod shipped;
pub mod tensor_file;

pub use features::{Features, UNIT_COUNT, UNIT_NAMES};
pub use normaliser::Normaliser;

use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::cell::Grid;
use crate::world::{ParkingType, Stance};

/// Ranks preparatory poses. Implementations are immutable and shared between threads.
pub trait PoseSelector: Send + Sync {
    /// Appends up to `k` preparatory poses of `vehicle` (rear axle, spot frame) for `features`,
    /// best first. Appends none where the model knows nothing, such as an infeasible cell.
    fn select(&self, features: &Features, vehicle: &Vehicle, k: usize, out: &mut Vec<Pose>);

    /// The manoeuvres it knows for cars that stand so: motions in driving order that end at the
    /// parked pose, drivable by `vehicle`. None by default.
    fn manoeuvres(&self, _stance: Stance, _vehicle: &Vehicle) -> Vec<Vec<Segment>> {
        Vec::new()
    }

    /// The grid of cells the model was trained on for a parking type.
    fn grid(&self, kind: ParkingType) -> &Grid;

    /// The parking types the model was trained for.
    fn kinds(&self) -> Vec<ParkingType>;
}
