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

use candle_core::{DType, Device, Tensor, Var};
use rand::RngExt;
use rand::seq::SliceRandom;
use serde::{Deserialize, Serialize};

use super::curve::{self, EpochLoss};
use super::quality::{Errors, Reach, errors, reach};
use super::targets::{self, Example};
use super::{Loss, MlpConfig, TrainingError, Validation, card, solved, write_beside};
use crate::dataset::{Metadata, Sample, content_sha256, validation_cells};
use crate::geometry::Pose;
use crate::nn::AdamW;
use crate::progress;
use crate::rng::{Stream, rng};
use crate::selectors::artefact;
use crate::selectors::mlp::{self, MlpHeader};
use crate::selectors::network::{
    LAYERS, LayerWeights, OUTPUTS, outputs_from_pose, pose_from_outputs,
};
use crate::selectors::{Features, Normaliser};
use crate::world::ParkingType;

/// Fewest solved samples worth training on.
const LEAST_SAMPLES: usize = 10;

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
pub fn train(
    metadata: &Metadata,
    samples: &[Sample],
    kind: ParkingType,
    config: &MlpConfig,
    out: &Path,
) -> Result<TrainingLog, TrainingError> {
    config.validate()?;
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
        features: Features::NAMES.map(str::to_owned).to_vec(),
        layers: LAYERS.to_vec(),
        input: Normaliser::fit(&raw_inputs),
        output: Normaliser::fit(&raw_outputs),
        data_sha256: content_sha256(metadata, samples.iter().filter(|s| s.cell.kind == kind)),
        seed: config.seed,
        training: serde_json::to_value(config).expect("settings are plain data"),
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let train = Rows::new(&train, &header);
    let validation_rows = Rows::new(&validation, &header);
    let model = Trainable::new(config.seed)?;
    let mut optimiser = AdamW::new(&model.vars, config.weight_decay)?;

    let first = predictions(&model, &validation_rows, &header)?;
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
    let rows = samples.iter().filter(|s| s.cell.kind == kind).count();
    let mut best = f32::INFINITY;
    let mut order: Vec<usize> = (0..train.len()).collect();
    let bar = progress::bar(config.epochs as u64, kind.name());
    for epoch in 0..config.epochs {
        order.shuffle(&mut rng(config.seed, Stream::Shuffle, epoch as u64));
        let train_loss =
            run_epoch(&model, &mut optimiser, &train, &order, config, config.rate(epoch))?;
        let loss = EpochLoss {
            train: train_loss,
            validation: validation_loss(&model, &validation_rows, config)?,
        };
        if !(loss.train.is_finite() && loss.validation.is_finite()) {
            return Err(TrainingError::Diverged { epoch: epoch + 1, loss: loss.train });
        }
        log.losses.push(loss);
        if loss.validation < best {
            best = loss.validation;
            log.best_epoch = epoch + 1;
            let predicted = predictions(&model, &validation_rows, &header)?;
            log.validation = errors(&predicted, &validation);
            log.reach = reach(metadata, &validation, &predicted);
            artefact::write(out, &mlp::encode(&header, &model.weights()?))?;
            write_beside(out, &log, card::mlp(out, metadata, rows, &log))?;
        }
        let (median, direct) = (log.validation.position_median_m, 100.0 * log.reach.direct);
        bar.set_message(format!(
            "loss {:.4} validation {:.4} best {best:.4} (epoch {}, median {median:.2} m, \
             direct {direct:.0} %)",
            loss.train, loss.validation, log.best_epoch
        ));
        bar.inc(1);
        if epoch + 1 >= log.best_epoch + config.patience {
            break;
        }
    }
    bar.finish_and_clear();
    write_beside(out, &log, card::mlp(out, metadata, rows, &log))?;
    let picture = curve::svg(&format!("mlp, {kind}: loss"), &log.losses)?;
    artefact::write(&out.with_extension("training.svg"), picture.as_bytes())?;
    Ok(log)
}

fn features(example: &Example) -> [f32; Features::COUNT] {
    Features::new(example.start, example.cell).values()
}

/// Training and validation rows. Sample indices validate, the same in every cell, or whole
/// cells; at least one, and where there is one cell only, single rows of it do (whole cells where
/// each has one start only).
fn split(all: Vec<Example>, config: &MlpConfig) -> (Vec<Example>, Vec<Example>) {
    let one_cell = all[0].cell_index == all[all.len() - 1].cell_index;
    let one_start = all.iter().all(|e| e.sample_index == all[0].sample_index);
    let starts = one_cell || (config.validation == Validation::Starts && !one_start);
    let unit = |e: &Example| if starts { e.sample_index } else { e.cell_index };
    let units: BTreeSet<u32> = all.iter().map(unit).collect();
    let share = config.validation_share.max(1.0 / units.len() as f64);
    let kept = validation_cells(units, share, config.seed);
    all.into_iter().partition(|e| !kept.contains(&unit(e)))
}

/// Normalised rows, ready to be gathered into batches.
struct Rows {
    inputs: Vec<[f32; Features::COUNT]>,
    outputs: Vec<[f32; OUTPUTS]>,
}

impl Rows {
    fn new(examples: &[Example], header: &MlpHeader) -> Self {
        let inputs = examples.iter().map(|e| header.input.normalise(features(e)));
        let outputs = examples.iter().map(|e| header.output.normalise(outputs_from_pose(e.target)));
        Self { inputs: inputs.collect(), outputs: outputs.collect() }
    }

    fn len(&self) -> usize {
        self.inputs.len()
    }

    /// `[rows, 6]` and `[rows, 4]`.
    fn batch(&self, rows: &[usize]) -> candle_core::Result<(Tensor, Tensor)> {
        let inputs: Vec<f32> = rows.iter().flat_map(|&i| self.inputs[i]).collect();
        let outputs: Vec<f32> = rows.iter().flat_map(|&i| self.outputs[i]).collect();
        Ok((
            Tensor::from_vec(inputs, (rows.len(), Features::COUNT), &Device::Cpu)?,
            Tensor::from_vec(outputs, (rows.len(), OUTPUTS), &Device::Cpu)?,
        ))
    }
}

/// The network as candle variables.
struct Trainable {
    /// Weight `[inputs, outputs]` and bias `[outputs]` of each layer in turn. Weights are
    /// the transpose of the file's, so that neither pass has to transpose them.
    vars: Vec<Var>,
}

impl Trainable {
    /// He initialisation: uniform with variance 2 / inputs; biases zero.
    fn new(seed: u64) -> candle_core::Result<Self> {
        let mut vars = Vec::new();
        for (layer, size) in LAYERS.windows(2).enumerate() {
            let mut rng = rng(seed, Stream::Weights, layer as u64);
            let limit = (6.0 / size[0] as f32).sqrt();
            let weight: Vec<f32> =
                (0..size[0] * size[1]).map(|_| rng.random_range(-limit..limit)).collect();
            vars.push(Var::from_vec(weight, (size[0], size[1]), &Device::Cpu)?);
            vars.push(Var::zeros(size[1], DType::F32, &Device::Cpu)?);
        }
        Ok(Self { vars })
    }

    /// `[batch, 6]` → `[batch, 4]`, both normalised.
    fn forward(&self, inputs: &Tensor) -> candle_core::Result<Tensor> {
        let last = self.vars.len() / 2 - 1;
        let mut x = inputs.clone();
        for (n, layer) in self.vars.chunks_exact(2).enumerate() {
            x = x.matmul(&layer[0])?.broadcast_add(&layer[1])?;
            if n < last {
                x = x.relu()?;
            }
        }
        Ok(x)
    }

    fn weights(&self) -> candle_core::Result<Vec<LayerWeights>> {
        let layers = self.vars.chunks_exact(2).map(|layer| {
            Ok(LayerWeights {
                weight: layer[0].t()?.flatten_all()?.to_vec1()?,
                bias: layer[1].to_vec1()?,
            })
        });
        layers.collect()
    }
}

/// Mean loss over all components of `[batch, 4]` predictions.
fn loss(predicted: &Tensor, wanted: &Tensor, config: &MlpConfig) -> candle_core::Result<Tensor> {
    let error = (predicted - wanted)?;
    match config.loss {
        Loss::Mse => error.sqr()?.mean_all(),
        Loss::Huber => {
            // c·(|e| − c/2) with c = min(|e|, δ), over δ so that far errors weigh one.
            let size = error.abs()?;
            let near = size.minimum(config.huber_delta)?;
            ((&near * (size - (&near * 0.5)?)?)? * (1.0 / config.huber_delta))?.mean_all()
        }
    }
}

/// One pass over the training rows; their mean loss.
fn run_epoch(
    model: &Trainable,
    optimiser: &mut AdamW,
    rows: &Rows,
    order: &[usize],
    config: &MlpConfig,
    rate: f64,
) -> Result<f32, TrainingError> {
    let mut total = 0.0;
    for batch in order.chunks(config.batch) {
        let (inputs, outputs) = rows.batch(batch)?;
        let loss = loss(&model.forward(&inputs)?, &outputs, config)?;
        optimiser.step(&loss.backward()?, rate)?;
        total += loss.to_scalar::<f32>()? * batch.len() as f32;
    }
    Ok(total / order.len() as f32)
}

const EVALUATION_BATCH: usize = 2048;

/// Predictions for all rows, `[rows, 4]` chunk by chunk, with the wanted outputs.
fn evaluate(
    model: &Trainable,
    rows: &Rows,
    mut each: impl FnMut(Tensor, Tensor) -> candle_core::Result<()>,
) -> candle_core::Result<()> {
    let all: Vec<usize> = (0..rows.len()).collect();
    for batch in all.chunks(EVALUATION_BATCH) {
        let (inputs, outputs) = rows.batch(batch)?;
        // Nothing is learnt here: drop the graph.
        each(model.forward(&inputs)?.detach(), outputs)?;
    }
    Ok(())
}

fn validation_loss(
    model: &Trainable,
    rows: &Rows,
    config: &MlpConfig,
) -> Result<f32, TrainingError> {
    let mut total = 0.0;
    evaluate(model, rows, |predicted, wanted| {
        let count = wanted.dim(0)? as f32;
        total += loss(&predicted, &wanted, config)?.to_scalar::<f32>()? * count;
        Ok(())
    })?;
    Ok(total / rows.len() as f32)
}

/// The network's poses for all rows.
fn predictions(
    model: &Trainable,
    rows: &Rows,
    header: &MlpHeader,
) -> Result<Vec<Pose>, TrainingError> {
    let mut predicted = Vec::new();
    evaluate(model, rows, |values, _| {
        for row in values.to_vec2::<f32>()? {
            let row = [row[0], row[1], row[2], row[3]];
            predicted.push(pose_from_outputs(header.output.restore(row)));
        }
        Ok(())
    })?;
    Ok(predicted)
}
