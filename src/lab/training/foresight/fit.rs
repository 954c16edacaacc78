//! Fits both towers to examples, in candle.
//!
//! The ranking learns the share that each manoeuvre is wanted by: `exp(−c/T)` of what it costs more than the
//! best one, by cross-entropy with the softmax of the scores. The foreseen cost learns a ratio, by
//! Huber's loss.

use candle_core::{D, Device, Tensor};
use rand::seq::SliceRandom;
use serde::{Deserialize, Serialize};

use super::ForesightConfig;
use super::examples::{Example, Examples};
use crate::lab::nn::AdamW;
use crate::lab::progress;
use crate::lab::training::TrainingError;
use crate::lab::training::curve::{EpochLine, EpochLoss};
use crate::lab::training::regression::Trainable;
use crate::lab::training::watch::Watch;
use crate::rng::{Stream, rng};
use crate::selectors::Normaliser;
use crate::selectors::foresight::{CODE, MANOEUVRE, MANOEUVRE_LAYERS, SCENE, SCENE_LAYERS};
use crate::selectors::network::LayerWeights;

/// Where Huber's loss turns linear.
const HUBER: f64 = 0.1;
/// What counts as nothing lost, turning radii.
const NOTHING: f32 = 0.1;
/// The most promising manoeuvres of the validation.
const FEW: usize = 3;
const MANY: usize = 12;

/// Both towers as they were on the best epoch, and how good they are.
pub(super) struct Fitted {
    pub scene: Vec<LayerWeights>,
    pub manoeuvre: Vec<LayerWeights>,
    pub scene_scaling: Normaliser,
    pub manoeuvre_scaling: Normaliser,
    pub losses: Vec<EpochLoss>,
    pub best_epoch: usize,
    /// Library by library.
    pub validation: Vec<Foreseen>,
}

/// How well a network foresees what it has not seen. Shares are of scenes in which some manoeuvre leads to
/// a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Foreseen {
    /// Scenes.
    pub scenes: usize,
    /// Share in which the first 3 hold a manoeuvre about as good as the best.
    pub in_first: f64,
    /// Share in which the first 12 do.
    pub in_order: f64,
    /// The same for the order of estimates alone.
    pub in_first_by_estimate: f64,
    /// The same.
    pub in_order_by_estimate: f64,
    /// Median of how far the foreseen cost is off, as a share of the cost.
    pub cost_median: f64,
    /// 95th percentile of the same.
    pub cost_p95: f64,
}

/// Codes of scenes and of manoeuvres.
struct Towers {
    scene: Trainable,
    manoeuvre: Trainable,
}

/// The libraries' manoeuvres and the examples, normalised.
struct Prepared<'a> {
    libraries: Vec<Tensor>,
    examples: &'a [Example],
    scenes: Vec<[f32; SCENE]>,
}

impl<'a> Prepared<'a> {
    fn new(
        all: &'a Examples,
        scene: &Normaliser,
        manoeuvre: &Normaliser,
    ) -> candle_core::Result<Self> {
        let of_library = |values: &Vec<[f32; MANOEUVRE]>| {
            let rows: Vec<f32> = values.iter().flat_map(|&v| manoeuvre.normalise(v)).collect();
            Tensor::from_vec(rows, (values.len(), MANOEUVRE), &Device::Cpu)
        };
        let libraries = all.libraries.iter().map(of_library).collect::<Result<_, _>>()?;
        let scenes = all.examples.iter().map(|e| scene.normalise(e.scene)).collect();
        Ok(Self { libraries, examples: &all.examples, scenes })
    }

    /// `[scenes, SCENE]` of the examples with these numbers.
    fn scenes(&self, batch: &[usize]) -> candle_core::Result<Tensor> {
        let rows: Vec<f32> = batch.iter().flat_map(|&i| self.scenes[i]).collect();
        Tensor::from_vec(rows, (batch.len(), SCENE), &Device::Cpu)
    }

    /// `[scenes, manoeuvres]` of what `row` writes for each example.
    fn rows(
        &self,
        batch: &[usize],
        row: impl Fn(&Example, &mut [f32]),
    ) -> candle_core::Result<Tensor> {
        let count = self.examples[batch[0]].estimates.len();
        let mut rows = vec![0.0; batch.len() * count];
        for (&i, slot) in batch.iter().zip(rows.chunks_exact_mut(count)) {
            row(&self.examples[i], slot);
        }
        Tensor::from_vec(rows, (batch.len(), count), &Device::Cpu)
    }

    /// Batches of one library each, in the given order of examples.
    fn batches(&self, order: &[usize], size: usize) -> Vec<Vec<usize>> {
        let mut open = vec![Vec::new(); self.libraries.len()];
        let mut full = Vec::new();
        for &i in order {
            let batch = &mut open[self.examples[i].library];
            batch.push(i);
            if batch.len() == size {
                full.push(std::mem::take(batch));
            }
        }
        full.extend(open.into_iter().filter(|batch| !batch.is_empty()));
        full
    }
}

impl Towers {
    /// The scores `[scenes, manoeuvres]` and the foreseen `[scenes]`.
    fn forward(
        &self,
        data: &Prepared,
        library: usize,
        batch: &[usize],
    ) -> candle_core::Result<(Tensor, Tensor)> {
        let scene = self.scene.forward(&data.scenes(batch)?)?;
        let manoeuvre = self.manoeuvre.forward(&data.libraries[library])?;
        let code = scene.narrow(D::Minus1, 0, CODE)?;
        let weight = scene.narrow(D::Minus1, CODE, 1)?;
        let value = scene.narrow(D::Minus1, CODE + 1, 1)?.squeeze(1)?;
        let worth = code.contiguous()?.matmul(&manoeuvre.narrow(1, 0, CODE)?.t()?.contiguous()?)?;
        let anywhere = manoeuvre.narrow(1, CODE, 1)?.t()?;
        let estimates = data.rows(batch, |e, row| row.copy_from_slice(&e.estimates))?;
        let scores = worth.broadcast_add(&anywhere)?.sub(&estimates.broadcast_mul(&weight)?)?;
        Ok((scores, value))
    }

    fn loss(
        &self,
        data: &Prepared,
        batch: &[usize],
        config: &ForesightConfig,
    ) -> candle_core::Result<Tensor> {
        let library = data.examples[batch[0]].library;
        let (scores, value) = self.forward(data, library, batch)?;
        let wanted = data.rows(batch, |e, row| {
            let wanted = |cost: f32| (-cost / config.temperature as f32).exp();
            let sum: f32 = e.costs.iter().map(|(_, cost)| wanted(*cost)).sum();
            e.costs.iter().for_each(|&(i, cost)| row[i as usize] = wanted(cost) / sum);
        })?;
        let ranking = (candle_nn::ops::log_softmax(&scores, D::Minus1)? * wanted)?
            .sum(D::Minus1)?
            .neg()?
            .mean_all()?;
        let values: Vec<f32> = batch.iter().map(|&i| data.examples[i].value).collect();
        let error = (value - Tensor::from_vec(values, batch.len(), &Device::Cpu)?)?.abs()?;
        let near = error.minimum(HUBER)?;
        let off = ((&near * (error - (&near * 0.5)?)?)? * (1.0 / HUBER))?.mean_all()?;
        ranking + (off * config.value_weight)?
    }
}

/// Trains both towers; those of the epoch that validates best are returned.
pub(super) fn fit(
    train: &Examples,
    validation: &Examples,
    config: &ForesightConfig,
    watch: &mut Watch,
) -> Result<Fitted, TrainingError> {
    let scenes: Vec<_> = train.examples.iter().map(|e| e.scene).collect();
    let manoeuvres: Vec<_> = train.libraries.iter().flatten().copied().collect();
    if scenes.is_empty() || validation.examples.is_empty() {
        return Err(TrainingError::NoWorlds);
    }
    let (scene_scaling, manoeuvre_scaling) =
        (Normaliser::fit(&scenes), Normaliser::fit(&manoeuvres));
    let prepared = |all| Prepared::new(all, &scene_scaling, &manoeuvre_scaling);
    let (train, validation) = (prepared(train)?, prepared(validation)?);
    let towers = Towers {
        scene: Trainable::new(&SCENE_LAYERS, config.seed << 1)?,
        manoeuvre: Trainable::new(&MANOEUVRE_LAYERS, config.seed << 1 | 1)?,
    };
    let vars = [towers.scene.vars(), towers.manoeuvre.vars()].concat();
    let mut optimiser = AdamW::new(&vars, config.weight_decay)?;
    let mut losses: Vec<EpochLoss> = Vec::new();
    let mut best: Option<(f32, usize, [Vec<LayerWeights>; 2])> = None;
    let mut order: Vec<usize> = (0..train.examples.len()).collect();
    let held_back: Vec<usize> = (0..validation.examples.len()).collect();
    let bar = progress::bar(config.epochs as u64, "foresight");
    for epoch in 0..config.epochs {
        let mut rng = rng(config.seed, Stream::Shuffle, epoch as u64);
        order.shuffle(&mut rng);
        let mut batches = train.batches(&order, config.batch);
        batches.shuffle(&mut rng);
        let mut total = 0.0;
        for batch in &batches {
            let loss = towers.loss(&train, batch, config)?;
            optimiser.step(&loss.backward()?, config.rate(epoch))?;
            total += loss.to_scalar::<f32>()? * batch.len() as f32;
        }
        let mut held = 0.0;
        for batch in validation.batches(&held_back, 512) {
            let loss = towers.loss(&validation, &batch, config)?;
            held += loss.to_scalar::<f32>()? * batch.len() as f32;
        }
        let loss = EpochLoss {
            train: total / order.len() as f32,
            validation: held / held_back.len() as f32,
        };
        if !(loss.train.is_finite() && loss.validation.is_finite()) {
            return Err(TrainingError::Diverged { epoch: epoch + 1, loss: loss.train });
        }
        losses.push(loss);
        let (name, epochs, learning_rate) = ("foresight", config.epochs, config.rate(epoch));
        watch.tell(&EpochLine { name, epoch: epoch + 1, epochs, learning_rate, loss })?;
        if best.as_ref().is_none_or(|(least, ..)| loss.validation < *least) {
            let weights = [towers.scene.weights()?, towers.manoeuvre.weights()?];
            best = Some((loss.validation, epoch + 1, weights));
        }
        let best_epoch = best.as_ref().map_or(0, |(_, epoch, _)| *epoch);
        bar.set_message(format!(
            "loss {:.4} validation {:.4} (best: epoch {best_epoch})",
            loss.train, loss.validation
        ));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let (_, best_epoch, [scene, manoeuvre]) = best.expect("at least one epoch");
    let towers = Towers {
        scene: Trainable::of(&SCENE_LAYERS, &scene)?,
        manoeuvre: Trainable::of(&MANOEUVRE_LAYERS, &manoeuvre)?,
    };
    let validated = validate(&towers, &validation)?;
    Ok(Fitted {
        scene,
        manoeuvre,
        scene_scaling,
        manoeuvre_scaling,
        losses,
        best_epoch,
        validation: validated,
    })
}

/// How good the towers are, library by library.
fn validate(towers: &Towers, data: &Prepared) -> candle_core::Result<Vec<Foreseen>> {
    let mut all = vec![Foreseen::default(); data.libraries.len()];
    let mut off = vec![Vec::new(); data.libraries.len()];
    let order: Vec<usize> = (0..data.examples.len()).collect();
    for batch in data.batches(&order, 512) {
        let library = data.examples[batch[0]].library;
        let (scores, values) = towers.forward(data, library, &batch)?;
        let (scores, values) = (scores.to_vec2::<f32>()?, values.to_vec1::<f32>()?);
        for ((&i, scores), value) in batch.iter().zip(scores).zip(values) {
            let example = &data.examples[i];
            off[library].push(f64::from((value - example.value).exp() - 1.0).abs());
            if example.costs.is_empty() {
                continue;
            }
            let of = &mut all[library];
            of.scenes += 1;
            let by_estimate: Vec<f32> = example.estimates.iter().map(|e| -e).collect();
            of.in_first += holds(example, &scores, FEW);
            of.in_order += holds(example, &scores, MANY);
            of.in_first_by_estimate += holds(example, &by_estimate, FEW);
            of.in_order_by_estimate += holds(example, &by_estimate, MANY);
        }
    }
    for (of, off) in all.iter_mut().zip(&mut off) {
        let scenes = of.scenes.max(1) as f64;
        for share in [
            &mut of.in_first,
            &mut of.in_order,
            &mut of.in_first_by_estimate,
            &mut of.in_order_by_estimate,
        ] {
            *share /= scenes;
        }
        off.sort_by(f64::total_cmp);
        let quantile = |q: f64| off.get((q * off.len() as f64) as usize).copied().unwrap_or(0.0);
        (of.cost_median, of.cost_p95) = (quantile(0.5), quantile(0.95));
    }
    Ok(all)
}

/// 1 where one of the `count` highest scores is that of a manoeuvre about as good as the best, else 0.
fn holds(example: &Example, scores: &[f32], count: usize) -> f64 {
    let mut order: Vec<usize> = (0..scores.len()).collect();
    order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    let good =
        |i: &usize| example.costs.iter().any(|(m, cost)| *m as usize == *i && *cost <= NOTHING);
    f64::from(u8::from(order.iter().take(count).any(good)))
}
