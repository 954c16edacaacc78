//! Fits a network to rows of features and preparatory poses, in candle.
//!
//! The same rows, settings and seed give the same weights: initial weights and order of rows come
//! from [`crate::rng`].

use candle_core::{DType, Device, Tensor, Var};
use rand::RngExt;
use rand::seq::SliceRandom;

use super::curve::{EpochLine, EpochLoss};
use super::watch::Watch;
use super::{Loss, MlpConfig, TrainingError};
use crate::geometry::Pose;
use crate::lab::nn::AdamW;
use crate::lab::progress;
use crate::rng::{Stream, rng};
use crate::selectors::Normaliser;
use crate::selectors::network::{LayerWeights, OUTPUTS, pose_from_outputs};

/// Trains `model` until the epochs or the patience of `config` run out, and returns the losses.
///
/// Whenever the validation loss is the least so far `improved` is told the losses up to then; it
/// answers with what the progress bar, called `name`, is to say of the model. Every epoch becomes a line
/// of `watch`.
pub(super) fn fit<const N: usize>(
    model: &Trainable,
    train: &Rows<N>,
    validation: &Rows<N>,
    config: &MlpConfig,
    (name, watch): (&str, &mut Watch),
    mut improved: impl FnMut(&[EpochLoss]) -> Result<String, TrainingError>,
) -> Result<Vec<EpochLoss>, TrainingError> {
    let mut optimiser = AdamW::new(&model.vars, config.weight_decay)?;
    let mut losses: Vec<EpochLoss> = Vec::new();
    let (mut best, mut best_epoch, mut said) = (f32::INFINITY, 0, String::new());
    let mut order: Vec<usize> = (0..train.len()).collect();
    let bar = progress::bar(config.epochs as u64, name);
    for epoch in 0..config.epochs {
        order.shuffle(&mut rng(config.seed, Stream::Shuffle, epoch as u64));
        let train_loss =
            run_epoch(model, &mut optimiser, train, &order, config, config.rate(epoch))?;
        let loss = EpochLoss {
            train: train_loss,
            validation: validation_loss(model, validation, config)?,
        };
        if !(loss.train.is_finite() && loss.validation.is_finite()) {
            return Err(TrainingError::Diverged { epoch: epoch + 1, loss: loss.train });
        }
        losses.push(loss);
        let (epochs, learning_rate) = (config.epochs, config.rate(epoch));
        watch.tell(&EpochLine { name, epoch: epoch + 1, epochs, learning_rate, loss })?;
        if loss.validation < best {
            (best, best_epoch) = (loss.validation, epoch + 1);
            said = improved(&losses)?;
        }
        bar.set_message(format!(
            "loss {:.4} validation {:.4} best {best:.4} (epoch {best_epoch}, {said})",
            loss.train, loss.validation
        ));
        bar.inc(1);
        if epoch + 1 >= best_epoch + config.patience {
            break;
        }
    }
    bar.finish_and_clear();
    Ok(losses)
}

/// Normalised rows of `N` inputs, ready to be gathered into batches.
pub(super) struct Rows<const N: usize> {
    inputs: Vec<[f32; N]>,
    outputs: Vec<[f32; OUTPUTS]>,
}

impl<const N: usize> Rows<N> {
    /// Normalises raw `inputs` and `outputs`.
    pub fn new(
        inputs: &[[f32; N]],
        outputs: &[[f32; OUTPUTS]],
        input: &Normaliser,
        output: &Normaliser,
    ) -> Self {
        let inputs = inputs.iter().map(|&row| input.normalise(row));
        let outputs = outputs.iter().map(|&row| output.normalise(row));
        Self { inputs: inputs.collect(), outputs: outputs.collect() }
    }

    pub fn len(&self) -> usize {
        self.inputs.len()
    }

    /// `[rows, N]` and `[rows, 4]`.
    fn batch(&self, rows: &[usize]) -> candle_core::Result<(Tensor, Tensor)> {
        let inputs: Vec<f32> = rows.iter().flat_map(|&i| self.inputs[i]).collect();
        let outputs: Vec<f32> = rows.iter().flat_map(|&i| self.outputs[i]).collect();
        Ok((
            Tensor::from_vec(inputs, (rows.len(), N), &Device::Cpu)?,
            Tensor::from_vec(outputs, (rows.len(), OUTPUTS), &Device::Cpu)?,
        ))
    }
}

/// The network as candle variables.
pub(super) struct Trainable {
    /// Weight `[inputs, outputs]` and bias `[outputs]` of each layer in turn. Weights are
    /// the transpose of the file's, so that neither pass has to transpose them.
    vars: Vec<Var>,
}

impl Trainable {
    /// Layers of these widths. He initialisation: uniform with variance 2 / inputs; biases zero.
    pub fn new(layers: &[usize], seed: u64) -> candle_core::Result<Self> {
        let mut vars = Vec::new();
        for (layer, size) in layers.windows(2).enumerate() {
            let mut rng = rng(seed, Stream::Weights, layer as u64);
            let limit = (6.0 / size[0] as f32).sqrt();
            let weight: Vec<f32> =
                (0..size[0] * size[1]).map(|_| rng.random_range(-limit..limit)).collect();
            vars.push(Var::from_vec(weight, (size[0], size[1]), &Device::Cpu)?);
            vars.push(Var::zeros(size[1], DType::F32, &Device::Cpu)?);
        }
        Ok(Self { vars })
    }

    /// Layers of these widths with weights that [`Trainable::weights`] gave.
    pub fn of(layers: &[usize], weights: &[LayerWeights]) -> candle_core::Result<Self> {
        let mut vars = Vec::new();
        for (size, LayerWeights { weight, bias }) in layers.windows(2).zip(weights) {
            let weight = Tensor::from_slice(weight, (size[1], size[0]), &Device::Cpu)?;
            vars.push(Var::from_tensor(&weight.t()?.contiguous()?)?);
            vars.push(Var::from_slice(bias, size[1], &Device::Cpu)?);
        }
        Ok(Self { vars })
    }

    /// What is learnt.
    pub fn vars(&self) -> &[Var] {
        &self.vars
    }

    /// `[batch, inputs]` → `[batch, outputs]`, both normalised.
    pub fn forward(&self, inputs: &Tensor) -> candle_core::Result<Tensor> {
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

    pub fn weights(&self) -> candle_core::Result<Vec<LayerWeights>> {
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
fn run_epoch<const N: usize>(
    model: &Trainable,
    optimiser: &mut AdamW,
    rows: &Rows<N>,
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
fn evaluate<const N: usize>(
    model: &Trainable,
    rows: &Rows<N>,
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

fn validation_loss<const N: usize>(
    model: &Trainable,
    rows: &Rows<N>,
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
pub(super) fn predictions<const N: usize>(
    model: &Trainable,
    rows: &Rows<N>,
    output: &Normaliser,
) -> Result<Vec<Pose>, TrainingError> {
    let mut predicted = Vec::new();
    evaluate(model, rows, |values, _| {
        for row in values.to_vec2::<f32>()? {
            let row = [row[0], row[1], row[2], row[3]];
            predicted.push(pose_from_outputs(output.restore(row)));
        }
        Ok(())
    })?;
    Ok(predicted)
}
