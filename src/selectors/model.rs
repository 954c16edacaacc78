//! Models of every kind, told apart by content: `knn.bin` (see [`super::knn_file`]), one safetensors
//! file per network (see [`super::mlp`]), and one for any vehicle (see [`super::fleet`]).

use std::borrow::Cow;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use super::artefact::{self, ArtefactError, Fault, check_vehicle, selector_training};
use super::fleet::FleetSelector;
use super::knn::KnnSelector;
use super::mlp::MlpSelector;
use super::tensor_file::Content;
use super::{PoseSelector, knn_file, shipped};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// A loaded and checked model.
#[derive(Debug)]
pub enum Model {
    /// `knn.bin`.
    Knn(KnnSelector),
    /// A network of one parking type.
    Mlp(MlpSelector),
    /// Manoeuvres and networks for any vehicle.
    Fleet(Box<FleetSelector>),
}

impl Model {
    /// Loads a model of any kind.
    pub fn load(path: &Path) -> Result<Model, ArtefactError> {
        // A file that is no model may be large, or have no end.
        if shipped::find(path).is_none() || path.exists() {
            check_start(path)?;
        }
        Self::from_bytes(path, artefact::read(path)?)
    }

    /// Checks the content of the file at `path`.
    pub fn from_bytes(path: &Path, bytes: Cow<'static, [u8]>) -> Result<Model, ArtefactError> {
        if bytes.starts_with(&knn_file::MAGIC) {
            return Ok(Model::Knn(KnnSelector::from_bytes(path, bytes)?));
        }
        match Content::of_file(&bytes) {
            Content::Fleet => Ok(Model::Fleet(Box::new(FleetSelector::from_bytes(path, &bytes)?))),
            Content::Foresight => Err(Fault::Foresight.of(path)),
            Content::Mlp | Content::Policy => {
                Ok(Model::Mlp(MlpSelector::from_bytes(path, &bytes)?))
            }
        }
    }

    /// The vehicle the model was trained for; `None` where it is for any.
    pub fn vehicle(&self) -> Option<&Vehicle> {
        match self {
            Model::Knn(m) => Some(m.vehicle()),
            Model::Mlp(m) => Some(m.vehicle()),
            Model::Fleet(_) => None,
        }
    }

    /// The file it was loaded from.
    pub fn path(&self) -> &Path {
        match self {
            Model::Knn(m) => m.path(),
            Model::Mlp(m) => m.path(),
            Model::Fleet(m) => m.path(),
        }
    }

    /// The parking types it was trained for.
    pub fn kinds(&self) -> Vec<ParkingType> {
        match self {
            Model::Knn(m) => m.kinds(),
            Model::Mlp(m) => m.kinds(),
            Model::Fleet(m) => m.kinds(),
        }
    }

    /// What it is, as `n3p-train` calls it.
    pub fn name(&self) -> &'static str {
        match self {
            Model::Knn(_) => "knn",
            Model::Mlp(_) => "mlp",
            Model::Fleet(_) => "fleet",
        }
    }

    /// How to train another one.
    pub fn training(&self) -> String {
        selector_training(self.name(), &self.kinds())
    }

    /// Refuses a model that was trained for another car; see [`check_vehicle`].
    pub fn check_vehicle(&self, wanted: &Vehicle) -> Result<(), ArtefactError> {
        let Some(vehicle) = self.vehicle() else { return Ok(()) };
        check_vehicle(self.path(), &self.training(), vehicle, wanted)
    }

    /// The model as a selector that threads can share.
    pub fn into_selector(self) -> Arc<dyn PoseSelector> {
        match self {
            Model::Knn(m) => Arc::new(m),
            Model::Mlp(m) => Arc::new(m),
            Model::Fleet(m) => Arc::new(*m),
        }
    }
}

/// Refuses files that do not begin like a model.
fn check_start(path: &Path) -> Result<(), ArtefactError> {
    let mut start = Vec::new();
    let file = artefact::open(path)?;
    file.take(9).read_to_end(&mut start).map_err(|e| Fault::Unreadable(e).of(path))?;
    match &start[..] {
        [] => Err(Fault::Empty.of(path)),
        start if start.starts_with(&knn_file::MAGIC) => Ok(()),
        // A safetensors file begins with the length of its header and a brace.
        [.., b'{'] if start.len() == 9 => Ok(()),
        _ => Err(Fault::NotAModel.of(path)),
    }
}
