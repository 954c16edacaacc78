//! Foresight learnt in many worlds: what known manoeuvres are worth in a scene, and what the best plan
//! costs ([`crate::selectors::foresight`]).
//!
//! World by world every manoeuvre in common use is tried, and a teacher, Hybrid A* that takes the best of
//! several solutions and improves it, looks for something better (`examples`). The network learns which
//! manoeuvres come near the best one, and what the best plan costs (`fit`). Whole libraries are
//! validated with worlds of another seed.

mod config;
mod examples;
mod fit;

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::curve::{self, EpochLoss};
use super::watch::Watch;
use super::{TrainingError, card, write_beside};
use crate::files::sha256_hex;
use crate::selectors::artefact::{self, ArtefactError};
use crate::selectors::foresight::{self, ForesightHeader};
use crate::selectors::model::Model;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

pub use config::ForesightConfig;
use examples::{Source, collect};
pub use fit::Foreseen;

/// The training's log, written as JSON beside the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForesightLog {
    /// The models whose libraries it learnt with, and the SHA-256 of each.
    pub models: Vec<(String, String)>,
    /// The settings.
    pub config: ForesightConfig,
    /// By library: the vehicle's length, the type, examples learnt from and examples to validate with.
    pub libraries: Vec<LibraryLog>,
    /// Losses epoch by epoch.
    pub losses: Vec<EpochLoss>,
    /// The epoch of the stored network, from 1.
    pub best_epoch: usize,
    /// Size of the file.
    pub bytes: usize,
}

/// What was learnt with one library.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LibraryLog {
    /// The model it is from.
    pub model: String,
    /// The vehicle planned for.
    pub vehicle: Vehicle,
    /// The parking type.
    pub kind: ParkingType,
    /// Examples learnt from.
    pub examples: usize,
    /// How good the stored network is on worlds of another seed.
    pub validation: Foreseen,
}

/// Loads the models at `paths`.
pub fn load(paths: &[impl AsRef<Path>]) -> Result<Vec<(Model, String)>, ArtefactError> {
    let load = |path: &Path| {
        let path = artefact::find_model(path);
        Ok((Model::load(&path)?, sha256_hex(&[&artefact::read(&path)?])))
    };
    paths.iter().map(|path| load(path.as_ref())).collect()
}

/// Trains with the libraries of `models` and writes the network to `out`, with its log, its model card and
/// the loss curve (`.training.svg`) beside it.
#[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
pub fn train(
    models: Vec<(Model, String)>,
    config: &ForesightConfig,
    out: &Path,
) -> Result<ForesightLog, TrainingError> {
    config.validate()?;
    let name =
        |model: &Model| model.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let named: Vec<_> = models.iter().map(|(model, sum)| (name(model), sum.clone())).collect();
    let sources = Source::all(models.into_iter().map(|(model, _)| model), config);
    let [train, validation] = collect(&sources, config);
    let fitted = fit::fit(&train, &validation, config, &mut Watch::begin(out, false)?)?;
    let header = ForesightHeader {
        format_version: foresight::VERSION,
        foresight: named.clone(),
        scene: fitted.scene_scaling,
        manoeuvre: fitted.manoeuvre_scaling,
        training: serde_json::to_value(config).expect("settings are plain data"),
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let bytes = foresight::encode(&header, &fitted.scene, &fitted.manoeuvre);
    artefact::write(out, &bytes)?;
    let of_library = |(i, source): (usize, &Source)| LibraryLog {
        model: source.model.clone(),
        vehicle: source.vehicle,
        kind: source.kind,
        examples: train.examples.iter().filter(|e| e.library == i).count(),
        validation: fitted.validation[i],
    };
    let log = ForesightLog {
        models: named,
        config: config.clone(),
        libraries: sources.iter().enumerate().map(of_library).collect(),
        losses: fitted.losses,
        best_epoch: fitted.best_epoch,
        bytes: bytes.len(),
    };
    write_beside(out, &log, card::foresight(out, &log))?;
    let picture = curve::svg("foresight: loss", &log.losses)?;
    artefact::write(&out.with_extension("training.svg"), picture.as_bytes())?;
    Ok(log)
}
