//! Manoeuvres for any vehicle: one model across vehicles.
//!
//! A manoeuvre of full-lock arcs and straights keeps its shape when a car is scaled: in units of
//! the turning radius it is the same for every car of the same proportions, and nearly so for
//! others. This model holds manoeuvres in these units, condensed from the samples of many
//! vehicles; for the vehicle at hand they are scaled to its turning radius. Whether one is free
//! is asked in the scene, with the vehicle's own footprint, as for any library
//! ([`crate::planners::library`]), so a vehicle that was never seen is as safe as any other.
//!
//! The file (`fleet.safetensors`): per parking type `TYPE.segments` `[segments, 2]`, curvature and
//! signed length in these units, and `TYPE.counts` `[manoeuvres]`, the segments of each, all in
//! single precision; a [`FleetHeader`] as [`super::tensor_file`] says.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::artefact::{ArtefactError, Fault};
use super::tensor_file::{self, NamedTensor};
use super::{Features, PoseSelector};
use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;
use crate::world::cell::Grid;

/// The format version written and read by this program.
pub const VERSION: u32 = 1;

/// What the file says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FleetHeader {
    /// [`VERSION`] at training.
    pub format_version: u32,
    /// The vehicles it learnt from.
    pub fleet: Vec<Vehicle>,
    /// SHA-256 of their data sets.
    pub data_sha256: Vec<String>,
    /// The parking types, and the manoeuvres and segments of each.
    pub kinds: Vec<(ParkingType, usize, usize)>,
    /// Version of this crate at training.
    pub crate_version: String,
}

/// Manoeuvres of a parking type, lengths in turning radii, each in driving order.
pub type UnitManoeuvres = Vec<Vec<Segment>>;

/// The manoeuvres of every type, ready to be scaled.
#[derive(Clone, Debug)]
pub struct FleetSelector {
    path: PathBuf,
    header: FleetHeader,
    manoeuvres: Vec<UnitManoeuvres>,
    grid: Grid,
}

/// The bytes of a file; `manoeuvres` of the header's types in their order.
pub fn encode(header: &FleetHeader, manoeuvres: &[UnitManoeuvres]) -> Vec<u8> {
    let mut tensors = Vec::new();
    for ((kind, ..), of_kind) in header.kinds.iter().zip(manoeuvres) {
        let segments: Vec<f32> =
            of_kind.iter().flatten().flat_map(|s| [s.curvature as f32, s.length as f32]).collect();
        let counts: Vec<f32> = of_kind.iter().map(|m| m.len() as f32).collect();
        let shape = vec![segments.len() / 2, 2];
        tensors.push(NamedTensor::f32(format!("{kind}.segments"), shape, &segments));
        tensors.push(NamedTensor::f32(format!("{kind}.counts"), vec![counts.len()], &counts));
    }
    tensor_file::encode(&serde_json::to_string(header).expect("plain data"), tensors)
}

impl FleetSelector {
    /// Reads and checks the bytes of the file at `path`.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ArtefactError> {
        Self::decode(path, bytes).map_err(|fault| fault.of(path))
    }

    fn decode(path: &Path, bytes: &[u8]) -> Result<Self, Fault> {
        let (json, tensors) = tensor_file::decode(bytes, VERSION)?;
        let damaged = |e: String| Fault::Header(e);
        let header: FleetHeader =
            serde_json::from_str(&json).map_err(|e| damaged(e.to_string()))?;
        let mut manoeuvres = Vec::new();
        for &(kind, count, segments) in &header.kinds {
            let values = tensor_file::f32s(&tensors, &format!("{kind}.segments"), &[segments, 2])?;
            let counts = tensor_file::f32s(&tensors, &format!("{kind}.counts"), &[count])?;
            let (pairs, _) = values.as_chunks::<2>();
            let within = |[curvature, _]: &[f32; 2]| curvature.abs() <= 1.0 + 1e-6;
            if !pairs.iter().all(within) || counts.iter().any(|c| *c < 1.0 || c.fract() != 0.0) {
                return Err(damaged(format!("{kind}: values out of range")));
            }
            if counts.iter().sum::<f32>() != segments as f32 {
                return Err(damaged(format!("{kind}: the counts do not add up to {segments}")));
            }
            let mut rest = pairs.iter().map(|&[curvature, length]| Segment {
                curvature: curvature.into(),
                length: length.into(),
            });
            let each = counts.iter().map(|&c| rest.by_ref().take(c as usize).collect());
            manoeuvres.push(each.collect());
        }
        Ok(Self { path: path.to_owned(), header, manoeuvres, grid: Grid::default() })
    }

    /// The file it was loaded from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The header.
    pub fn header(&self) -> &FleetHeader {
        &self.header
    }
}

/// A manoeuvre `factor` times as large.
pub(crate) fn scaled(manoeuvre: &[Segment], factor: f64) -> Vec<Segment> {
    let scale =
        |s: &Segment| Segment { curvature: s.curvature / factor, length: s.length * factor };
    manoeuvre.iter().map(scale).collect()
}

impl PoseSelector for FleetSelector {
    /// It knows manoeuvres alone.
    fn select(&self, _features: &Features, _k: usize, _out: &mut Vec<Pose>) {}

    fn manoeuvres(&self, kind: ParkingType, vehicle: &Vehicle) -> Vec<Vec<Segment>> {
        let known = self.header.kinds.iter().position(|(k, ..)| *k == kind);
        let of_kind = known.map_or(&[][..], |at| &self.manoeuvres[at]);
        of_kind.iter().map(|m| scaled(m, vehicle.turning_radius())).collect()
    }

    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn kinds(&self) -> Vec<ParkingType> {
        self.header.kinds.iter().map(|(kind, ..)| *kind).collect()
    }
}
