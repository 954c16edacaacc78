//! Samples → one network of a parking type.
//!
//! The network learns `Features → (x, y, cos θ, sin θ)` of a preparatory pose from solved
//! samples, both sides normalised; which pose, [`super::Targets`] says. Some
//! starts of every cell are kept for validation, or whole cells ([`super::Validation`]). Whenever it improves the model file is
//! replaced, so an interrupted training leaves the best network so far.
//!
//! The same samples, settings and seed give the same bytes: initial weights, order of rows
//! and validation cells come from [`crate::rng`].

use std::collections::BTreeSet;
use std::num::NonZero;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::curve::{self, EpochLoss};
use super::quality::{Errors, Reach, errors, reach};
use super::regression::{Rows, Trainable, fit, predictions};
use super::targets::{self, Example};
use super::watch::Watch;
use super::{MlpConfig, TrainingError, Validation, card, solved, write_beside};
use crate::lab::dataset::{Metadata, Sample, content_sha256, validation_cells};
use crate::selectors::artefact;
use crate::selectors::mlp::{self, MlpHeader};
use crate::selectors::network::outputs_from_pose;
use crate::selectors::{Features, Normaliser};
use crate::world::ParkingType;

/// Fewest solved samples worth training on.
pub const LEAST_SAMPLES: usize = 10;

/// The training's log, written as JSON beside the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingLog {
    /// The parking type.
    pub kind: ParkingType,
    /// The settings.
    pub config: MlpConfig,
    /// SHA-256 of the data set.
    pub data_sha256: String,
    /// Training rows.
    pub train_rows: usize,
    /// Validation rows.
    pub validation_rows: usize,
    /// Losses epoch by epoch.
    pub losses: Vec<EpochLoss>,
    /// The epoch of the stored network, from 1.
    pub best_epoch: usize,
    /// Errors of the stored network on the validation rows.
    pub validation: Errors,
    /// What its predictions for validation rows are worth to a planner.
    pub reach: Reach,
}

/// Trains a network of `kind` and writes it to `out`, with its log, its model card and the
/// loss curve (`.training.svg`) beside it.
#[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
pub fn train(
    metadata: &Metadata,
    samples: &[Sample],
    kind: ParkingType,
    config: &MlpConfig,
    out: &Path,
) -> Result<TrainingLog, TrainingError> {
    match kind {
        ParkingType::Angled => {
            train_with(metadata, samples, kind, config, out, Features::slanted_values)
        }
        _ => train_with(metadata, samples, kind, config, out, Features::values),
    }
}

/// The same, where `values` of the features are the inputs.
fn train_with<const N: usize>(
    metadata: &Metadata,
    samples: &[Sample],
    kind: ParkingType,
    config: &MlpConfig,
    out: &Path,
    values: fn(&Features) -> [f32; N],
) -> Result<TrainingLog, TrainingError> {
    config.validate()?;
    let layers = mlp::layers_for(kind);
    let features = |e: &Example| values(&Features::new(e.start, e.cell));
    let solved = solved(samples, kind, metadata.grid.cell_count(kind))?;
    if solved.is_empty() {
        return Err(TrainingError::NoSamples(kind));
    }
    if solved.len() < LEAST_SAMPLES {
        let (samples, needed) = (solved.len(), LEAST_SAMPLES);
        return Err(TrainingError::TooFew { kind, samples, needed });
    }
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    let (train, validation) = split(targets::examples(metadata, &solved, config, threads), config);
    let raw_inputs: Vec<_> = train.iter().map(features).collect();
    let raw_outputs: Vec<_> = train.iter().map(|e| outputs_from_pose(e.target)).collect();
    let header = MlpHeader {
        format_version: mlp::VERSION,
        kind,
        vehicle: metadata.vehicle,
        grid: metadata.grid,
        features: Features::names(kind).iter().map(|name| (*name).to_owned()).collect(),
        layers: layers.to_vec(),
        input: Normaliser::fit(&raw_inputs),
        output: Normaliser::fit(&raw_outputs),
        data_sha256: content_sha256(metadata, samples.iter().filter(|s| s.cell.kind() == kind)),
        seed: config.seed,
        training: serde_json::to_value(config).expect("settings are plain data"),
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let rows = |examples: &[Example]| {
        let inputs: Vec<_> = examples.iter().map(features).collect();
        let outputs: Vec<_> = examples.iter().map(|e| outputs_from_pose(e.target)).collect();
        Rows::new(&inputs, &outputs, &header.input, &header.output)
    };
    let (train, validation_rows) = (rows(&train), rows(&validation));
    let model = Trainable::new(&layers, config.seed)?;

    let first = predictions(&model, &validation_rows, &header.output)?;
    let mut log = TrainingLog {
        kind,
        config: config.clone(),
        data_sha256: header.data_sha256.clone(),
        train_rows: train.len(),
        validation_rows: validation_rows.len(),
        losses: Vec::new(),
        best_epoch: 0,
        validation: errors(&first, &validation),
        reach: reach(metadata, &validation, &first),
    };
    let rows = samples.iter().filter(|s| s.cell.kind() == kind).count();
    let mut watch = Watch::begin(out, false)?;
    let named = (kind.name(), &mut watch);
    let losses = fit(&model, &train, &validation_rows, config, named, |losses| {
        log.losses = losses.to_vec();
        log.best_epoch = losses.len();
        let predicted = predictions(&model, &validation_rows, &header.output)?;
        log.validation = errors(&predicted, &validation);
        log.reach = reach(metadata, &validation, &predicted);
        artefact::write(out, &mlp::encode(&header, &model.weights()?))?;
        write_beside(out, &log, card::mlp(out, metadata, rows, &log))?;
        let (median, direct) = (log.validation.position_median_m, 100.0 * log.reach.direct);
        Ok(format!("median {median:.2} m, direct {direct:.0} %"))
    })?;
    log.losses = losses;
    write_beside(out, &log, card::mlp(out, metadata, rows, &log))?;
    let picture = curve::svg(&format!("mlp, {kind}: loss"), &log.losses)?;
    artefact::write(&out.with_extension("training.svg"), picture.as_bytes())?;
    Ok(log)
}

/// Training and validation rows. Sample indices validate, the same in every cell, or whole
/// cells; at least one, and where there is one cell only, single rows of it do (whole cells where
/// each has one start only).
pub(super) fn split(all: Vec<Example>, config: &MlpConfig) -> (Vec<Example>, Vec<Example>) {
    let one_cell = all[0].cell_index == all[all.len() - 1].cell_index;
    let one_start = all.iter().all(|e| e.sample_index == all[0].sample_index);
    let starts = one_cell || (config.validation == Validation::Starts && !one_start);
    let unit = |e: &Example| if starts { e.sample_index } else { e.cell_index };
    let units: BTreeSet<u32> = all.iter().map(unit).collect();
    let share = config.validation_share.max(1.0 / units.len() as f64);
    let kept = validation_cells(units, share, config.seed);
    all.into_iter().partition(|e| !kept.contains(&unit(e)))
}
