//! Observations as the network's inputs.

use candle_core::{Device, Result, Tensor};
use serde::{Deserialize, Serialize};

use crate::environment::{BEAMS, MASK, Observation, TARGET};

/// Lidar and target, the inputs that are scaled. The mask is a share already.
const SCALED: usize = BEAMS + TARGET;

/// Mean and deviation of the scaled inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputScale {
    mean: Vec<f32>,
    deviation: Vec<f32>,
}

impl InputScale {
    /// Scaled values lie within ± this.
    const LIMIT: f32 = 10.0;

    /// The scale that gives `observations` mean 0 and deviation 1; inputs that never change keep
    /// theirs. There must be one observation at least.
    pub fn fit(observations: &[Observation]) -> Self {
        let count = observations.len() as f64;
        let values = |i: usize| observations.iter().map(move |o| f64::from(scaled(o, i)));
        let mean: Vec<f64> = (0..SCALED).map(|i| values(i).sum::<f64>() / count).collect();
        let deviation = (0..SCALED).map(|i| {
            let variance = values(i).map(|v| (v - mean[i]).powi(2)).sum::<f64>() / count;
            if variance > 1e-8 { variance.sqrt() as f32 } else { 1.0 }
        });
        Self { deviation: deviation.collect(), mean: mean.iter().map(|&m| m as f32).collect() }
    }

    /// Checks lengths and values, as read from a file.
    pub fn validate(&self) -> std::result::Result<(), String> {
        let (means, deviations) = (self.mean.len(), self.deviation.len());
        if (means, deviations) != (SCALED, SCALED) {
            return Err(format!(
                "the input scale has {means} and {deviations} values, not {SCALED}"
            ));
        }
        let fine = self.mean.iter().all(|m| m.is_finite())
            && self.deviation.iter().all(|d| d.is_finite() && *d > 0.0);
        if fine { Ok(()) } else { Err("the input scale holds values out of range".to_owned()) }
    }

    /// Lidar `[batch, 120]`, target `[batch, 5]` and mask `[batch, 42]`, scaled.
    pub fn inputs<'a>(
        &self,
        observations: impl ExactSizeIterator<Item = &'a Observation>,
        device: &Device,
    ) -> Result<[Tensor; 3]> {
        let batch = observations.len();
        let mut lidar = Vec::with_capacity(batch * BEAMS);
        let mut target = Vec::with_capacity(batch * TARGET);
        let mut mask = Vec::with_capacity(batch * MASK);
        for o in observations {
            lidar.extend((0..BEAMS).map(|i| self.apply(o, i)));
            target.extend((BEAMS..SCALED).map(|i| self.apply(o, i)));
            mask.extend(o.mask);
        }
        Ok([
            Tensor::from_vec(lidar, (batch, BEAMS), device)?,
            Tensor::from_vec(target, (batch, TARGET), device)?,
            Tensor::from_vec(mask, (batch, MASK), device)?,
        ])
    }

    fn apply(&self, o: &Observation, i: usize) -> f32 {
        ((scaled(o, i) - self.mean[i]) / self.deviation[i]).clamp(-Self::LIMIT, Self::LIMIT)
    }
}

fn scaled(o: &Observation, i: usize) -> f32 {
    if i < BEAMS { o.lidar[i] } else { o.target[i - BEAMS] }
}
