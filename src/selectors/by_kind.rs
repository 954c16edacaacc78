//! Selectors of different parking types in one.

use std::sync::Arc;

use super::{Features, PoseSelector};
use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::cell::Grid;
use crate::world::{ParkingType, Stance};

/// Two selectors for one vehicle; what the first does not know is asked of the second.
pub struct ByKind(pub Arc<dyn PoseSelector>, pub Arc<dyn PoseSelector>);

impl ByKind {
    fn of(&self, kind: ParkingType) -> &dyn PoseSelector {
        let Self(first, second) = self;
        if second.kinds().contains(&kind) && !first.kinds().contains(&kind) {
            &**second
        } else {
            &**first
        }
    }
}

impl PoseSelector for ByKind {
    fn select(&self, features: &Features, vehicle: &Vehicle, k: usize, out: &mut Vec<Pose>) {
        self.of(features.cell.kind()).select(features, vehicle, k, out);
    }

    fn manoeuvres(&self, stance: Stance, vehicle: &Vehicle) -> Vec<Vec<Segment>> {
        self.of(stance.kind()).manoeuvres(stance, vehicle)
    }

    fn grid(&self, kind: ParkingType) -> &Grid {
        self.of(kind).grid(kind)
    }

    fn kinds(&self) -> Vec<ParkingType> {
        let known = |kind: &ParkingType| self.of(*kind).kinds().contains(kind);
        ParkingType::ALL.into_iter().filter(known).collect()
    }
}
