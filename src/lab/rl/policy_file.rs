//! The file of a trained policy: `rl-COURSE.safetensors`.
//!
//! The actor's parameters by the names of [`Role::shapes`] in single precision, with a
//! [`PolicyHeader`] as [`crate::selectors::tensor_file`] says.

use std::collections::BTreeMap;
use std::path::Path;

use candle_core::Device;
use serde::{Deserialize, Serialize};

use super::actor::Actor;
use super::encoding::InputScale;
use super::network::{Parameters, Role};
use crate::environment::courses::Course;
use crate::selectors::artefact::{self, ArtefactError, Fault};
use crate::selectors::tensor_file::{self, Content, NamedTensor};
use crate::vehicle::Vehicle;

/// The file name of a course's policy.
pub fn usual_name(course: Course) -> String {
    format!("rl-{}.safetensors", course.name())
}

/// The format version written and read by this program.
pub const VERSION: u32 = 1;

/// What a policy's file says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyHeader {
    /// [`VERSION`] at training.
    pub format_version: u32,
    /// Where it learnt.
    pub course: Course,
    /// The vehicle it drove.
    pub vehicle: Vehicle,
    /// Scaling of the inputs.
    pub scale: InputScale,
    /// Episodes of training until then.
    pub episodes: usize,
    /// Seed of the training.
    pub seed: u64,
    /// Settings of the training, for the record.
    pub training: serde_json::Value,
    /// Version of this crate at training.
    pub crate_version: String,
}

/// The bytes of a file: the same input gives the same bytes.
#[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
pub fn encode(header: &PolicyHeader, actor: &BTreeMap<String, Vec<f32>>) -> Vec<u8> {
    let shapes = Role::Actor.shapes();
    let tensors = shapes.into_iter().map(|(name, shape)| {
        let values = &actor[&name];
        NamedTensor::f32(name, shape, values)
    });
    let header = serde_json::to_string(header).expect("a header is plain data");
    tensor_file::encode(&header, tensors.collect())
}

/// Reads and checks a policy.
pub fn load(path: &Path) -> Result<(PolicyHeader, Actor), ArtefactError> {
    let bytes = artefact::read_file(path)?;
    decode(&bytes).map_err(|fault| fault.of(path))
}

fn decode(bytes: &[u8]) -> Result<(PolicyHeader, Actor), Fault> {
    let shapes = Role::Actor.shapes();
    let (json, tensors) = tensor_file::decode(bytes, VERSION)?;
    if Content::of(&json) != Content::Policy {
        return Err(Fault::Selector);
    }
    let damaged = |e: String| Fault::Header(e);
    let header: PolicyHeader = serde_json::from_str(&json).map_err(|e| damaged(e.to_string()))?;
    header.vehicle.validate().map_err(|e| damaged(e.to_string()))?;
    header.scale.validate().map_err(damaged)?;
    let read = |(name, shape): (String, Vec<usize>)| {
        let values = tensor_file::f32s(&tensors, &name, &shape)?;
        Ok((name, values))
    };
    let values = shapes.into_iter().map(read).collect::<Result<_, Fault>>()?;
    let parameters = Parameters::from_values(Role::Actor, values, &Device::Cpu)
        .map_err(|e| damaged(e.to_string()))?;
    let actor = Actor::new(&parameters, header.scale.clone());
    Ok((header, actor))
}
