//! One model across vehicles: manoeuvres and preparatory poses for any of them.
//!
//! A manoeuvre of full-lock arcs and straights keeps its shape when a car is scaled: in units of
//! the turning radius it is the same for every car of the same proportions, and nearly so for
//! others. This model holds manoeuvres in these units, condensed from the samples of many
//! vehicles; for the vehicle at hand they are scaled to its turning radius. Whether one is free
//! is asked in the scene, with the vehicle's own footprint, as for any library
//! ([`crate::planners::library`]), so a vehicle that was never seen is as safe as any other.
//!
//! Preparatory poses come from a network per parking type that sees cell, start and the shape of
//! the vehicle in the same units ([`super::UNIT_NAMES`]).
//!
//! The file (`fleet.safetensors`): per parking type `TYPE.segments` `[segments, 2]`, curvature and
//! signed length in these units, `TYPE.counts` `[manoeuvres]`, the segments of each, and the
//! network as `TYPE.layers.N.weight` and `TYPE.layers.N.bias`, all in single precision; a
//! [`FleetHeader`] as [`super::tensor_file`] says.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::artefact::{ArtefactError, Fault};
use super::network::{self, LayerWeights, Network, OUTPUTS, pose_from_outputs};
use super::tensor_file::{self, NamedTensor};
use super::{Features, Normaliser, PoseSelector, UNIT_COUNT, UNIT_NAMES};
use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::cell::Grid;
use crate::world::{ParkingType, Stance};

/// The format version written and read by this program.
pub const VERSION: u32 = 2;

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
    /// The grid of cells of all data sets.
    pub grid: Grid,
    /// Names of the networks' inputs, [`UNIT_NAMES`].
    pub features: Vec<String>,
    /// Scaling of each type's network.
    pub scaling: Vec<Scaling>,
    /// Settings of the networks' training, for the record.
    pub training: serde_json::Value,
    /// Version of this crate at training.
    pub crate_version: String,
}

/// How a network's inputs and outputs are scaled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scaling {
    /// Of the inputs.
    pub input: Normaliser,
    /// Of the outputs `(x, y, cos θ, sin θ)`, lengths in turning radii.
    pub output: Normaliser,
}

/// Manoeuvres of a parking type, lengths in turning radii, each in driving order.
pub type UnitManoeuvres = Vec<Vec<Segment>>;

/// What is known of a parking type.
#[derive(Clone, Debug)]
struct OfKind {
    manoeuvres: UnitManoeuvres,
    network: Network,
}

/// Manoeuvres and networks of every type, ready to be scaled.
#[derive(Clone, Debug)]
pub struct FleetSelector {
    path: PathBuf,
    header: FleetHeader,
    /// In the order of the header's types.
    kinds: Vec<OfKind>,
}

/// Widths of the networks' layers.
pub const UNIT_LAYERS: [usize; 6] = network::layers(UNIT_COUNT);

/// The bytes of a file; manoeuvres and network weights of the header's types in their order.
#[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
pub fn encode(
    header: &FleetHeader,
    manoeuvres: &[UnitManoeuvres],
    networks: &[Vec<LayerWeights>],
) -> Vec<u8> {
    let mut tensors = Vec::new();
    for (((kind, ..), of_kind), network) in header.kinds.iter().zip(manoeuvres).zip(networks) {
        let prefix = format!("{kind}.");
        tensors.extend(tensor_file::layer_tensors(&prefix, &UNIT_LAYERS, network));
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
        header.grid.validate().map_err(|e| damaged(e.to_string()))?;
        if header.features != UNIT_NAMES {
            let found = &header.features;
            return Err(damaged(format!("features: expected {UNIT_NAMES:?}, got {found:?}")));
        }
        if header.scaling.len() != header.kinds.len() {
            return Err(damaged("scaling: expected one for each type".to_owned()));
        }
        for Scaling { input, output } in &header.scaling {
            input.check(UNIT_COUNT).map_err(|e| damaged(format!("input {e}")))?;
            output.check(OUTPUTS).map_err(|e| damaged(format!("output {e}")))?;
        }
        let mut kinds = Vec::new();
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
            let weights = tensor_file::layers(&tensors, &format!("{kind}."), &UNIT_LAYERS)?;
            let network = Network::new(&UNIT_LAYERS, &weights);
            kinds.push(OfKind { manoeuvres: each.collect(), network });
        }
        Ok(Self { path: path.to_owned(), header, kinds })
    }

    /// The file it was loaded from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The header.
    pub fn header(&self) -> &FleetHeader {
        &self.header
    }

    /// The predicted preparatory pose of `vehicle` (rear axle, spot frame); `None` for a parking
    /// type that it does not know.
    pub fn predict(&self, features: &Features, vehicle: &Vehicle) -> Option<Pose> {
        let at = self.position(features.cell.kind())?;
        let Scaling { input, output } = &self.header.scaling[at];
        let input = input.normalise(features.unit_values(&self.header.grid, vehicle));
        let pose = pose_from_outputs(output.restore(self.kinds[at].network.forward(&input)));
        Some(in_metres(pose, vehicle))
    }

    fn position(&self, kind: ParkingType) -> Option<usize> {
        self.header.kinds.iter().position(|(k, ..)| *k == kind)
    }
}

/// A pose given in turning radii of `vehicle`.
pub(crate) fn in_metres(pose: Pose, vehicle: &Vehicle) -> Pose {
    let unit = vehicle.turning_radius();
    Pose { x: pose.x * unit, y: pose.y * unit, ..pose }
}

/// A manoeuvre `factor` times as large.
pub(crate) fn scaled(manoeuvre: &[Segment], factor: f64) -> Vec<Segment> {
    let scale =
        |s: &Segment| Segment { curvature: s.curvature / factor, length: s.length * factor };
    manoeuvre.iter().map(scale).collect()
}

impl PoseSelector for FleetSelector {
    fn select(&self, features: &Features, vehicle: &Vehicle, k: usize, out: &mut Vec<Pose>) {
        if k > 0 {
            out.extend(self.predict(features, vehicle).filter(|pose| pose.is_finite()));
        }
    }

    fn manoeuvres(&self, stance: Stance, vehicle: &Vehicle) -> Vec<Vec<Segment>> {
        let of_kind = self.position(stance.kind()).map_or(&[][..], |at| &self.kinds[at].manoeuvres);
        of_kind.iter().map(|m| scaled(m, vehicle.turning_radius())).collect()
    }

    fn grid(&self, _kind: ParkingType) -> &Grid {
        &self.header.grid
    }

    fn kinds(&self) -> Vec<ParkingType> {
        self.header.kinds.iter().map(|(kind, ..)| *kind).collect()
    }
}
