//! Soft actor-critic.
//!
//! T. Haarnoja et al., "Soft Actor-Critic Algorithms and Applications", 2018: twin critics with
//! slowly following targets, a Gaussian policy squashed by tanh, and a temperature that holds the
//! policy's entropy at a target. Departures from HOPE: σ depends on the state, the squashing
//! enters the log-density, and rates are such that σ and temperature settle.

use candle_core::{D, Device, Result, Tensor, Var};
use serde::{Deserialize, Serialize};

use super::encoding::InputScale;
use super::network::{ACTION, Network, Parameters, Role};
use super::replay::Transition;
use crate::environment::Observation;
use crate::lab::nn::AdamW;

/// Settings of the algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SacConfig {
    /// Discount γ per step.
    pub discount: f64,
    /// Share of the way by which targets follow their critics at each update.
    pub follow: f64,
    /// Share of the way by which the averaged actor follows the actor at each update. It is the
    /// one that is validated and stored: the actor itself swings.
    pub average: f64,
    /// Learning rate of actor, critics and temperature.
    pub learning_rate: f64,
    /// Transitions per update.
    pub batch: usize,
    /// Entropy that the temperature aims at.
    pub target_entropy: f64,
    /// Temperature at the start.
    pub temperature: f64,
}

impl Default for SacConfig {
    fn default() -> Self {
        Self {
            discount: 0.98,
            follow: 0.005,
            average: 0.001,
            learning_rate: 1e-4,
            batch: 64,
            target_entropy: -(ACTION as f64),
            temperature: 0.01,
        }
    }
}

/// What an update saw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Losses {
    /// Mean squared error of both critics together.
    pub critic: f32,
    /// Mean of α log π − Q.
    pub actor: f32,
    /// Temperature α.
    pub temperature: f32,
    /// Mean −log π.
    pub entropy: f32,
}

/// The agent while it learns.
pub struct Sac {
    config: SacConfig,
    device: Device,
    /// Scaling of the inputs.
    pub scale: InputScale,
    parts: Parts,
    optimisers: [AdamW; 3],
}

/// All that is learnt.
pub struct Parts {
    /// The actor.
    pub actor: Parameters,
    /// Its average over the last updates.
    pub average: Parameters,
    /// The twin critics.
    pub critics: [Parameters; 2],
    /// Their targets.
    pub targets: [Parameters; 2],
    /// Log of the temperature, one value.
    pub log_temperature: Var,
}

impl Sac {
    /// A new agent.
    pub fn new(config: SacConfig, scale: InputScale, seed: u64, device: &Device) -> Result<Self> {
        let critic = |index| Parameters::random(Role::Critic, seed, index, device);
        let critics = [critic(1)?, critic(2)?];
        let actor = Parameters::random(Role::Actor, seed, 0, device)?;
        let parts = Parts {
            average: actor.copied()?,
            actor,
            targets: [critics[0].copied()?, critics[1].copied()?],
            critics,
            log_temperature: Var::new(&[config.temperature.ln() as f32], device)?,
        };
        Self::from_parts(config, scale, parts, device)
    }

    /// An agent of these parts, its optimisers at rest.
    pub fn from_parts(
        config: SacConfig,
        scale: InputScale,
        parts: Parts,
        device: &Device,
    ) -> Result<Self> {
        let all = |p: &Parameters| p.vars().values().cloned().collect::<Vec<_>>();
        let critics: Vec<Var> = parts.critics.iter().flat_map(all).collect();
        let optimisers = [
            AdamW::new(&all(&parts.actor), 0.0)?,
            AdamW::new(&critics, 0.0)?,
            AdamW::new(std::slice::from_ref(&parts.log_temperature), 0.0)?,
        ];
        Ok(Self { config, device: device.clone(), scale, parts, optimisers })
    }

    /// All that is learnt.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// The optimisers of actor, critics and temperature.
    pub fn optimisers(&mut self) -> &mut [AdamW; 3] {
        &mut self.optimisers
    }

    /// Actions for `observations`, `[batch, 2]`, with this normal noise (none: the mean).
    pub fn act(
        &self,
        observations: &[Observation],
        noise: Option<&[f32]>,
    ) -> Result<Vec<[f32; 2]>> {
        let inputs = self.scale.inputs(observations.iter(), &self.device)?;
        let output = self.parts.actor.frozen_network().forward(&inputs.each_ref())?;
        squashed(&output, noise, &self.device)?.to_vec2().map(pairs)
    }

    /// One update from a batch of transitions; `noise`: normal, two values for the actions after
    /// and two for those before each transition.
    pub fn update(&mut self, batch: &[Transition], noise: &[f32]) -> Result<Losses> {
        let device = &self.device;
        let before = self.scale.inputs(batch.iter().map(|t| &t.before), device)?;
        let after = self.scale.inputs(batch.iter().map(|t| &t.after), device)?;
        let column = |value: &dyn Fn(&Transition) -> f32| {
            Tensor::from_vec(batch.iter().map(value).collect(), (batch.len(), 1), device)
        };
        let rewards = column(&|t| t.reward)?;
        let discounts = column(&|t| if t.goes_on { self.config.discount as f32 } else { 0.0 })?;
        let actions = batch.iter().flat_map(|t| [t.action.steer as f32, t.action.speed as f32]);
        let actions = Tensor::from_vec(actions.collect::<Vec<_>>(), (batch.len(), ACTION), device)?;
        let (noise_after, noise_before) = noise.split_at(noise.len() / 2);
        let log_temperature = self.parts.log_temperature.as_tensor();
        let temperature = log_temperature.exp()?.to_vec1::<f32>()?[0];

        // Critics, toward the targets' word on what follows.
        let actor = self.parts.actor.frozen_network();
        let (next, next_log) = drawn(&actor.forward(&after.each_ref())?, noise_after, device)?;
        let targets = self.parts.targets.each_ref().map(Parameters::frozen_network);
        let worth = (least(&targets, &after, &next)? - (next_log * f64::from(temperature))?)?;
        let wanted = (rewards + (discounts * worth)?)?.detach();
        let critics = self.parts.critics.each_ref().map(Parameters::network);
        let errors =
            critics.iter().map(|c| (value(c, &before, &actions)? - &wanted)?.sqr()?.mean_all());
        let errors = errors.collect::<Result<Vec<_>>>()?;
        let critic_loss = (&errors[0] + &errors[1])?;
        let rate = self.config.learning_rate;
        self.optimisers[1].step(&critic_loss.backward()?, rate)?;

        // Actor, toward what the critics value.
        let actor = self.parts.actor.network();
        let (now, log) = drawn(&actor.forward(&before.each_ref())?, noise_before, device)?;
        let critics = self.parts.critics.each_ref().map(Parameters::frozen_network);
        let best = least(&critics, &before, &now)?;
        let actor_loss = ((&log * f64::from(temperature))? - best)?.mean_all()?;
        self.optimisers[0].step(&actor_loss.backward()?, rate)?;

        // Temperature, toward the entropy wanted.
        let entropy = -log.mean_all()?.to_scalar::<f32>()?;
        let excess = f64::from(entropy) - self.config.target_entropy;
        let loss = (log_temperature * excess)?.sum_all()?;
        self.optimisers[2].step(&loss.backward()?, rate)?;

        self.parts.average.follow(&self.parts.actor, self.config.average)?;
        for (target, critic) in self.parts.targets.iter().zip(&self.parts.critics) {
            target.follow(critic, self.config.follow)?;
        }
        let (critic, actor) = (critic_loss.to_scalar()?, actor_loss.to_scalar()?);
        Ok(Losses { critic, actor, temperature, entropy })
    }
}

fn pairs(rows: Vec<Vec<f32>>) -> Vec<[f32; 2]> {
    rows.into_iter().map(|row| [row[0], row[1]]).collect()
}

/// `[batch, 1]`: what a critic says of actions.
fn value(critic: &Network, inputs: &[Tensor; 3], actions: &Tensor) -> Result<Tensor> {
    critic.forward(&[&inputs[0], &inputs[1], &inputs[2], actions])
}

/// The lesser of what both critics say.
fn least(critics: &[Network; 2], inputs: &[Tensor; 3], actions: &Tensor) -> Result<Tensor> {
    value(&critics[0], inputs, actions)?.minimum(&value(&critics[1], inputs, actions)?)
}

/// Means and log σ, each `[batch, 2]`, of an actor's output; σ from e⁻⁵ to e².
fn gaussian(output: &Tensor) -> Result<(Tensor, Tensor)> {
    const LOW: f64 = -5.0;
    const HIGH: f64 = 2.0;
    let raw = output.narrow(1, ACTION, ACTION)?.tanh()?;
    let log_sigma = ((raw * ((HIGH - LOW) / 2.0))? + (HIGH + LOW) / 2.0)?;
    Ok((output.narrow(1, 0, ACTION)?, log_sigma))
}

/// Actions of an actor's output with this noise; without, those of the mean.
pub(super) fn squashed(output: &Tensor, noise: Option<&[f32]>, device: &Device) -> Result<Tensor> {
    let (mean, log_sigma) = gaussian(output)?;
    let Some(noise) = noise else { return mean.tanh() };
    let noise = Tensor::from_slice(noise, mean.shape(), device)?;
    (mean + (log_sigma.exp()? * noise)?)?.tanh()
}

/// Actions drawn with this noise, and their log-density `[batch, 1]`.
fn drawn(output: &Tensor, noise: &[f32], device: &Device) -> Result<(Tensor, Tensor)> {
    /// ½ log 2π.
    const HALF_LOG_TAU: f64 = 0.918_938_533_204_672_7;
    let (mean, log_sigma) = gaussian(output)?;
    let noise = Tensor::from_slice(noise, mean.shape(), device)?;
    let action = (mean + (log_sigma.exp()? * &noise)?)?.tanh()?;
    let normal = ((noise.sqr()? * 0.5)? + log_sigma)?;
    // log (1 − a²), kept from −∞.
    let squash = ((1.0 - action.sqr()?)? + 1e-6)?.log()?;
    let log = ((normal + squash)? + HALF_LOG_TAU)?.sum_keepdim(D::Minus1)?.neg()?;
    Ok((action, log))
}
