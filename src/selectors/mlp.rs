//! Preparatory poses predicted by the paper's network, one network per parking type.
//!
//! A network is one safetensors file `mlp-TYPE.safetensors`: `layers.N.weight`
//! (`[outputs, inputs]`) and `layers.N.bias` (`[outputs]`) in single precision, N = 0…4, and
//! one metadata entry `n3p`, a JSON object `{"sha256": …, "header": …}`. The header is an
//! [`MlpHeader`]; the checksum covers the header's text and all tensor bytes.
//!
//! Read next: [`super::network`] for the evaluation.

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError, SafeTensors};
use serde::{Deserialize, Serialize};

use super::artefact::{self, ArtefactError, Fault};
use super::network::{self, LAYERS, LayerWeights, Network, OUTPUTS};
use super::{Features, Normaliser, PoseSelector};
use crate::files::sha256_hex;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;
use crate::world::cell::Grid;

/// The format version written and read by this program.
pub const VERSION: u32 = 1;

const METADATA_KEY: &str = "n3p";

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
    /// Names of the inputs, [`Features::NAMES`].
    pub features: Vec<String>,
    /// Widths of the layers, [`LAYERS`].
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

/// Only the version, so that a file of another version is called that and not damaged.
#[derive(Deserialize)]
struct Versioned {
    header: VersionOnly,
}

#[derive(Deserialize)]
struct VersionOnly {
    format_version: u32,
}

/// The bytes of a file: the same input gives the same bytes.
///
/// Panics when `weights` are not those of [`LAYERS`].
pub fn encode(header: &MlpHeader, weights: &[LayerWeights]) -> Vec<u8> {
    let bytes =
        |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let mut tensors: Vec<(String, Vec<usize>, Vec<u8>)> = Vec::new();
    for (n, (layer, size)) in weights.iter().zip(LAYERS.windows(2)).enumerate() {
        tensors.push((name(n, "bias"), vec![size[1]], bytes(&layer.bias)));
        tensors.push((name(n, "weight"), vec![size[1], size[0]], bytes(&layer.weight)));
    }
    // Sorted by name, as safetensors lays them out.
    let header = serde_json::to_string(header).expect("a header is plain data");
    let mut parts = vec![header.as_bytes()];
    parts.extend(tensors.iter().map(|(_, _, data)| data.as_slice()));
    let sum = sha256_hex(&parts);
    // One entry only: safetensors writes several in random order.
    let entry = format!("{{\"sha256\":\"{sum}\",\"header\":{header}}}");
    let metadata = HashMap::from([(METADATA_KEY.to_owned(), entry)]);
    let views = tensors.iter().map(|(name, shape, data)| {
        let view = TensorView::new(Dtype::F32, shape.clone(), data);
        (name, view.expect("weights of the paper's layers"))
    });
    safetensors::serialize(views, Some(metadata)).expect("ten tensors are within the format")
}

fn name(layer: usize, part: &str) -> String {
    format!("layers.{layer}.{part}")
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
    /// Never empty; the first one's vehicle and grid are everyone's.
    networks: Vec<Trained>,
}

impl MlpSelector {
    /// Reads and checks one network.
    pub fn load(path: &Path) -> Result<Self, ArtefactError> {
        let mut bytes = Vec::new();
        artefact::open(path)?.read_to_end(&mut bytes).map_err(|e| Fault::Unreadable(e).of(path))?;
        let (header, weights) = decode(&bytes).map_err(|fault| fault.of(path))?;
        let network = Network::new(&weights);
        Ok(Self { networks: vec![Trained { path: path.to_owned(), header, network }] })
    }

    /// Reads and checks one network per parking type. Panics when `paths` is empty.
    pub fn load_all<P: AsRef<Path>>(paths: &[P]) -> Result<Self, ArtefactError> {
        let (first, rest) = paths.split_first().expect("at least one network");
        rest.iter().try_fold(Self::load(first.as_ref())?, |all, path| {
            all.combine(Self::load(path.as_ref())?)
        })
    }

    /// Both selectors' networks in one. They must share vehicle and grid and differ in
    /// parking type.
    pub fn combine(mut self, other: Self) -> Result<Self, ArtefactError> {
        for new in other.networks {
            let first = &self.networks[0];
            artefact::check_vehicle(
                &new.path,
                "mlp",
                &[new.header.kind],
                &new.header.vehicle,
                &first.header.vehicle,
            )?;
            let problem = if new.header.grid != first.header.grid {
                Some(format!("its grid of cells differs from that of {}", first.path.display()))
            } else {
                let same = self.networks.iter().find(|n| n.header.kind == new.header.kind);
                same.map(|n| format!("{} is for {}, too", n.path.display(), n.header.kind))
            };
            if let Some(problem) = problem {
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

    /// The predicted preparatory pose (rear axle, spot frame); `None` for a parking type
    /// without a network.
    pub fn predict(&self, features: &Features) -> Option<Pose> {
        let trained = self.networks.iter().find(|n| n.header.kind == features.cell.kind)?;
        let input = trained.header.input.normalise(features.values());
        let output = trained.network.forward(input);
        Some(network::pose_from_outputs(trained.header.output.restore(output)))
    }
}

impl PoseSelector for MlpSelector {
    fn select(&self, features: &Features, k: usize, out: &mut Vec<Pose>) {
        if k > 0 {
            let pose = self.predict(features).filter(|pose| pose.is_finite());
            out.extend(pose);
        }
    }

    fn grid(&self) -> &Grid {
        &self.networks[0].header.grid
    }

    fn kinds(&self) -> Vec<ParkingType> {
        self.networks.iter().map(|n| n.header.kind).collect()
    }
}

fn decode(bytes: &[u8]) -> Result<(MlpHeader, Vec<LayerWeights>), Fault> {
    let (data_at, entry) = metadata(bytes)?;
    let versioned: Versioned =
        serde_json::from_str(&entry).map_err(|e| Fault::Header(e.to_string()))?;
    let found = versioned.header.format_version;
    if found != VERSION {
        return Err(Fault::Version { found, supported: VERSION });
    }
    let (sum, json) = split_entry(&entry)
        .ok_or_else(|| Fault::Header("no checksum before the header".to_owned()))?;
    if sum != sha256_hex(&[json.as_bytes(), &bytes[data_at..]]) {
        return Err(Fault::Checksum);
    }
    let header: MlpHeader = serde_json::from_str(json).map_err(|e| Fault::Header(e.to_string()))?;
    check_header(&header).map_err(Fault::Header)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(|e| Fault::Header(e.to_string()))?;
    let layers = LAYERS.windows(2).enumerate().map(|(n, size)| {
        Ok(LayerWeights {
            weight: tensor(&tensors, &name(n, "weight"), &[size[1], size[0]])?,
            bias: tensor(&tensors, &name(n, "bias"), &[size[1]])?,
        })
    });
    let layers = layers.collect::<Result<Vec<_>, Fault>>()?;
    Ok((header, layers))
}

/// Where the tensor data begin, and the metadata entry of this program.
fn metadata(bytes: &[u8]) -> Result<(usize, String), Fault> {
    const LENGTH: usize = 8;
    if bytes.is_empty() {
        return Err(Fault::Empty);
    }
    let got = bytes.len() as u64;
    if bytes.len() <= LENGTH || bytes[LENGTH] != b'{' {
        return Err(Fault::NotAModel);
    }
    let header_len = u64::from_le_bytes(bytes[..LENGTH].try_into().expect("eight bytes"));
    let data_at = header_len.saturating_add(LENGTH as u64);
    if data_at > got {
        return Err(Fault::Length { expected: data_at, got });
    }
    match SafeTensors::read_metadata(bytes) {
        Ok((_, metadata)) => {
            let expected = data_at + metadata.data_len() as u64;
            if expected != got {
                return Err(Fault::Length { expected, got });
            }
            let entry = metadata.metadata().as_ref().and_then(|m| m.get(METADATA_KEY));
            Ok((data_at as usize, entry.ok_or(Fault::NotAModel)?.clone()))
        }
        Err(SafeTensorError::MetadataIncompleteBuffer) => {
            let expected = data_at + parameter_bytes();
            if expected == got {
                return Err(Fault::Header("the tensors do not fill the file".to_owned()));
            }
            Err(Fault::Length { expected, got })
        }
        Err(e) => Err(Fault::Header(e.to_string())),
    }
}

/// Size of all weights and biases, bytes.
fn parameter_bytes() -> u64 {
    LAYERS.windows(2).map(|size| 4 * (size[0] * size[1] + size[1]) as u64).sum()
}

/// The parts of `{"sha256":"…","header":…}`.
fn split_entry(entry: &str) -> Option<(&str, &str)> {
    let (sum, header) = entry.strip_prefix("{\"sha256\":\"")?.split_once("\",\"header\":")?;
    Some((sum, header.strip_suffix('}')?))
}

fn check_header(header: &MlpHeader) -> Result<(), String> {
    header.vehicle.validate().map_err(|e| e.to_string())?;
    header.grid.validate().map_err(|e| e.to_string())?;
    if header.layers != LAYERS {
        return Err(format!("layers: expected {LAYERS:?}, got {:?}", header.layers));
    }
    if header.features != Features::NAMES {
        return Err(format!("features: expected {:?}, got {:?}", Features::NAMES, header.features));
    }
    header.input.check(Features::COUNT).map_err(|e| format!("input {e}"))?;
    header.output.check(OUTPUTS).map_err(|e| format!("output {e}"))
}

fn tensor(file: &SafeTensors, name: &str, shape: &[usize]) -> Result<Vec<f32>, Fault> {
    let expected = format!("F32 {shape:?}");
    let wrong =
        |got: String| Fault::Shape { tensor: name.to_owned(), expected: expected.clone(), got };
    let view = file.tensor(name).map_err(|_| wrong("nothing".to_owned()))?;
    if view.dtype() != Dtype::F32 || view.shape() != shape {
        return Err(wrong(format!("{:?} {:?}", view.dtype(), view.shape())));
    }
    let (chunks, _) = view.data().as_chunks::<4>();
    let values: Vec<f32> = chunks.iter().map(|b| f32::from_le_bytes(*b)).collect();
    match values.iter().find(|v| !v.is_finite()) {
        Some(&value) => Err(Fault::NotFinite { tensor: name.to_owned(), value }),
        None => Ok(values),
    }
}
