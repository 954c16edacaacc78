//! AdamW as one pass over plain slices.
//!
//! Candle's own optimiser spends a quarter of a training step on temporary tensors; this one
//! does the same arithmetic in place. Source: Loshchilov & Hutter 2019, algorithm 2.

use candle_core::backprop::GradStore;
use candle_core::{Tensor, Var};

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// AdamW over the variables of a network.
pub struct AdamW {
    slots: Vec<Slot>,
    steps: i32,
    weight_decay: f32,
}

struct Slot {
    var: Var,
    value: Vec<f32>,
    mean: Vec<f32>,
    square: Vec<f32>,
}

impl AdamW {
    /// An optimiser of `vars`, all single precision, at rest.
    pub fn new(vars: &[Var], weight_decay: f64) -> candle_core::Result<Self> {
        let slots = vars.iter().map(|var| {
            let value = var.flatten_all()?.to_vec1::<f32>()?;
            let (mean, square) = (vec![0.0; value.len()], vec![0.0; value.len()]);
            Ok(Slot { var: var.clone(), value, mean, square })
        });
        let slots = slots.collect::<candle_core::Result<Vec<_>>>()?;
        Ok(Self { slots, steps: 0, weight_decay: weight_decay as f32 })
    }

    /// Steps so far, then mean and square of the gradients of each variable in turn: with the
    /// variables' values all that later steps depend on.
    pub fn state(&self) -> (i32, Vec<f32>) {
        let moments = self.slots.iter().flat_map(|s| s.mean.iter().chain(&s.square));
        (self.steps, moments.copied().collect())
    }

    /// Goes on from a [`AdamW::state`] of the same variables; `None` where the lengths differ.
    pub fn restore(&mut self, (steps, moments): (i32, &[f32])) -> Option<()> {
        let mut rest = moments;
        for slot in &mut self.slots {
            for moment in [&mut slot.mean, &mut slot.square] {
                let (own, others) = rest.split_at_checked(moment.len())?;
                moment.copy_from_slice(own);
                rest = others;
            }
        }
        self.steps = steps;
        rest.is_empty().then_some(())
    }

    /// One step down the gradients.
    pub fn step(&mut self, gradients: &GradStore, rate: f64) -> candle_core::Result<()> {
        self.steps += 1;
        let rate = rate as f32;
        let mean_scale = 1.0 / (1.0 - BETA_1.powi(self.steps));
        let square_scale = 1.0 / (1.0 - BETA_2.powi(self.steps));
        let keep = 1.0 - rate * self.weight_decay;
        for slot in &mut self.slots {
            let Some(gradient) = gradients.get(&slot.var) else { continue };
            let gradient = gradient.flatten_all()?.to_vec1::<f32>()?;
            let moments = slot.mean.iter_mut().zip(&mut slot.square);
            for ((value, (mean, square)), g) in slot.value.iter_mut().zip(moments).zip(gradient) {
                *mean = BETA_1 * *mean + (1.0 - BETA_1) * g;
                *square = BETA_2 * *square + (1.0 - BETA_2) * g * g;
                let direction = *mean * mean_scale / ((*square * square_scale).sqrt() + EPSILON);
                *value = *value * keep - rate * direction;
            }
            let next = Tensor::from_slice(&slot.value, slot.var.shape(), slot.var.device())?;
            slot.var.set(&next)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;
    use candle_nn::{Optimizer, ParamsAdamW};

    #[test]
    fn steps_like_candles_adamw() -> candle_core::Result<()> {
        let start = [0.5_f32, -1.5, 2.0];
        let ours = Var::new(&start, &Device::Cpu)?;
        let theirs = Var::new(&start, &Device::Cpu)?;
        let params = ParamsAdamW { lr: 0.05, weight_decay: 0.1, ..ParamsAdamW::default() };
        let mut reference = candle_nn::AdamW::new(vec![theirs.clone()], params)?;
        let mut optimiser = AdamW::new(std::slice::from_ref(&ours), 0.1)?;
        for _ in 0..20 {
            reference.backward_step(&theirs.sqr()?.sum_all()?)?;
            optimiser.step(&ours.sqr()?.sum_all()?.backward()?, 0.05)?;
        }
        for (a, b) in ours.to_vec1::<f32>()?.iter().zip(theirs.to_vec1::<f32>()?) {
            assert!((a - b).abs() < 1e-5, "{a} against {b}");
        }
        Ok(())
    }
}
