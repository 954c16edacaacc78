//! What models there are, for people and programs.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::models::named;
use super::{TrainedPolicy, more};
use crate::selectors::artefact::{ArtefactError, Fault};
use crate::selectors::foresight::Foresight;
use crate::selectors::model::Model;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// A model that could be planned with.
#[derive(Clone, Debug, Serialize)]
pub struct Listing {
    /// Its file, or its name where it is compiled in.
    pub path: PathBuf,
    /// Whether it is compiled in.
    pub compiled_in: bool,
    /// What it is: `knn`, `mlp`, `fleet`, `foresight` or `rl-COURSE`.
    pub what: String,
    /// The parking types it knows.
    pub types: Vec<&'static str>,
    /// The vehicle it was trained for; `None` where it serves any.
    pub vehicle: Option<Vehicle>,
}

/// The models in `models/` and those compiled in, by name; or why one of them cannot be used.
pub fn catalogue() -> Vec<Result<Listing, ArtefactError>> {
    let is_model = |name: &str| name.ends_with(".bin") || name.ends_with(".safetensors");
    named(is_model).iter().map(|path| Listing::of(path)).collect()
}

impl Listing {
    /// What the model at `path` is.
    pub fn of(path: &Path) -> Result<Self, ArtefactError> {
        let (path, compiled_in) = (path.to_owned(), !path.exists());
        match Model::load(&path) {
            Ok(model) => Ok(Self {
                what: model.name().to_owned(),
                types: model.kinds().iter().map(|kind| kind.name()).collect(),
                vehicle: model.vehicle().copied(),
                path,
                compiled_in,
            }),
            Err(ArtefactError { fault: Fault::Policy, .. }) => {
                let TrainedPolicy { course, vehicle, .. } = more::read_policy(&path)?;
                let (what, vehicle) = (format!("rl-{course}"), Some(vehicle));
                Ok(Self { what, types: Vec::new(), vehicle, path, compiled_in })
            }
            Err(ArtefactError { fault: Fault::Foresight, .. }) => {
                Foresight::load(&path)?;
                let types = ParkingType::SQUARE.iter().map(|kind| kind.name()).collect();
                Ok(Self { what: "foresight".to_owned(), types, vehicle: None, path, compiled_in })
            }
            Err(error) => Err(error),
        }
    }
}

impl fmt::Display for Listing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let types = if self.types.is_empty() { "all".to_owned() } else { self.types.join(", ") };
        let vehicle = self.vehicle.map_or("any vehicle".to_owned(), |v| {
            format!("{} x {} m, wheelbase {} m", v.length, v.width, v.wheelbase)
        });
        let from = if self.compiled_in { "compiled in" } else { "file" };
        let path = self.path.display().to_string();
        write!(f, "{path:<32} {from:<12} {:<10} {types:<26} {vehicle}", self.what)
    }
}
