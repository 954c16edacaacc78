//! Preparatory poses predicted by the paper's network, one network per parking type.
//!
//! A network is one safetensors file `mlp-TYPE.safetensors`: `layers.N.weight`
//! (`[outputs, inputs]`) and `layers.N.bias` (`[outputs]`) in single precision, N = 0…4, with an
//! [`MlpHeader`] as [`super::tensor_file`] says.
//!
//! Read next: [`super::network`] for the evaluation.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::artefact::{self, ArtefactError, Fault};
use super::network::{self, LayerWeights, Network, OUTPUTS};
use super::tensor_file::{self, Content};
use super::{Features, Normaliser, PoseSelector};
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;
use crate::world::cell::Grid;

/// The format version written and read by this program.
pub const VERSION: u32 = 1;

/// What a network's file says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MlpHeader {
    /// [`VERSION`] at training.
    pub format_version: u32,
    /// The parking type it was trained for.
    pub kind: ParkingType,
    /// The vehicle the samples were driven with.
    pub vehicle: Vehicle,
    /// The grid of cells.
    pub grid: Grid,
    /// Names of the inputs, [`Features::names`] of the type.
    pub features: Vec<String>,
    /// Widths of the layers, [`layers_for`] the type.
    pub layers: Vec<usize>,
    /// Scaling of the inputs.
    pub input: Normaliser,
    /// Scaling of the outputs `(x, y, cos θ, sin θ)`.
    pub output: Normaliser,
    /// SHA-256 of the data set, lower-case hexadecimal.
    pub data_sha256: String,
    /// Seed of the training.
    pub seed: u64,
    /// Settings of the training, for the record.
    pub training: serde_json::Value,
    /// Version of this crate at training.
    pub crate_version: String,
}

/// Widths of the layers for a parking type, the paper's: networks for angled bays see the slant, too.
pub fn layers_for(kind: ParkingType) -> [usize; 6] {
    network::layers(Features::names(kind).len())
}

/// The bytes of a file: the same input gives the same bytes.
///
/// # Panics
///
/// When `weights` are not those of [`layers_for`] the type.
pub fn encode(header: &MlpHeader, weights: &[LayerWeights]) -> Vec<u8> {
    let tensors = tensor_file::layer_tensors("", &layers_for(header.kind), weights);
    let header = serde_json::to_string(header).expect("a header is plain data");
    tensor_file::encode(&header, tensors)
}

/// A network with its scaling and provenance.
#[derive(Clone, Debug)]
struct Trained {
    path: PathBuf,
    header: MlpHeader,
    network: Network,
}

/// Up to one network per parking type.
#[derive(Clone, Debug)]
pub struct MlpSelector {
    /// Never empty; the first one's vehicle is everyone's.
    networks: Vec<Trained>,
}

impl MlpSelector {
    /// Reads and checks one network.
    pub fn load(path: &Path) -> Result<Self, ArtefactError> {
        Self::from_bytes(path, &artefact::read(path)?)
    }

    /// Checks the content of the file at `path`.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ArtefactError> {
        let (header, weights) = decode(bytes).map_err(|fault| fault.of(path))?;
        let network = Network::new(&layers_for(header.kind), &weights);
        Ok(Self { networks: vec![Trained { path: path.to_owned(), header, network }] })
    }

    /// Reads and checks one network per parking type: a first, and any others.
    pub fn load_all<P: AsRef<Path>>(first: P, others: &[P]) -> Result<Self, ArtefactError> {
        others.iter().try_fold(Self::load(first.as_ref())?, |all, path| {
            all.combine(Self::load(path.as_ref())?)
        })
    }

    /// Both selectors' networks in one. They must share the vehicle and differ in parking type.
    pub fn combine(mut self, other: Self) -> Result<Self, ArtefactError> {
        for new in other.networks {
            let first = &self.networks[0];
            artefact::check_vehicle(
                &new.path,
                &artefact::selector_training("mlp", &[new.header.kind]),
                &new.header.vehicle,
                &first.header.vehicle,
            )?;
            let same = self.networks.iter().find(|n| n.header.kind == new.header.kind);
            if let Some(same) = same {
                let problem = format!("{} is for {}, too", same.path.display(), same.header.kind);
                return Err(Fault::Mismatch(problem).of(&new.path));
            }
            self.networks.push(new);
        }
        Ok(self)
    }

    /// The vehicle the networks were trained for.
    pub fn vehicle(&self) -> &Vehicle {
        &self.networks[0].header.vehicle
    }

    /// The file of the first network.
    pub fn path(&self) -> &Path {
        &self.networks[0].path
    }

    /// The headers of all networks, in the order they were loaded.
    pub fn headers(&self) -> impl Iterator<Item = &MlpHeader> {
        self.networks.iter().map(|n| &n.header)
    }

    fn of(&self, kind: ParkingType) -> Option<&Trained> {
        self.networks.iter().find(|n| n.header.kind == kind)
    }

    /// The predicted preparatory pose (rear axle, spot frame); `None` for a parking type
    /// without a network.
    pub fn predict(&self, features: &Features) -> Option<Pose> {
        let kind = features.cell.kind();
        let trained = self.of(kind)?;
        let (scaling, network) = (&trained.header.input, &trained.network);
        let output: [f32; OUTPUTS] = match kind {
            ParkingType::Angled => network.forward(&scaling.normalise(features.slanted_values())),
            _ => network.forward(&scaling.normalise(features.values())),
        };
        Some(network::pose_from_outputs(trained.header.output.restore(output)))
    }
}

impl PoseSelector for MlpSelector {
    fn select(&self, features: &Features, _vehicle: &Vehicle, k: usize, out: &mut Vec<Pose>) {
        if k > 0 {
            let pose = self.predict(features).filter(|pose| pose.is_finite());
            out.extend(pose);
        }
    }

    fn grid(&self, kind: ParkingType) -> &Grid {
        &self.of(kind).unwrap_or(&self.networks[0]).header.grid
    }

    fn kinds(&self) -> Vec<ParkingType> {
        self.networks.iter().map(|n| n.header.kind).collect()
    }
}

fn decode(bytes: &[u8]) -> Result<(MlpHeader, Vec<LayerWeights>), Fault> {
    let (json, tensors) = tensor_file::decode(bytes, VERSION)?;
    if Content::of(&json) == Content::Policy {
        return Err(Fault::Policy);
    }
    let header: MlpHeader =
        serde_json::from_str(&json).map_err(|e| Fault::Header(e.to_string()))?;
    check_header(&header).map_err(Fault::Header)?;
    let layers = tensor_file::layers(&tensors, "", &layers_for(header.kind))?;
    Ok((header, layers))
}

fn check_header(header: &MlpHeader) -> Result<(), String> {
    header.vehicle.validate().map_err(|e| e.to_string())?;
    header.grid.validate().map_err(|e| e.to_string())?;
    let (layers, names) = (layers_for(header.kind), Features::names(header.kind));
    if header.layers != layers {
        return Err(format!("layers: expected {layers:?}, got {:?}", header.layers));
    }
    if header.features != names {
        return Err(format!("features: expected {names:?}, got {:?}", header.features));
    }
    header.input.check(names.len()).map_err(|e| format!("input {e}"))?;
    header.output.check(OUTPUTS).map_err(|e| format!("output {e}"))
}
