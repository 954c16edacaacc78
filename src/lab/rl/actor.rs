//! A trained actor as a policy.

use crate::n3p::Choice;
use candle_core::{Device, Tensor};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::encoding::InputScale;
use super::network::{ACTION, Network, Parameters};
use super::sac::squashed;
use super::{Policy, PolicyFault};
use crate::environment::motion::admitted;
use crate::environment::{Action, Observation, TARGET};

/// The actor's network and the scaling of its inputs.
#[derive(Clone, Debug)]
pub struct Actor {
    network: Network,
    scale: InputScale,
}

impl Actor {
    /// The actor of `parameters`.
    pub fn new(parameters: &Parameters, scale: InputScale) -> Self {
        Self { network: parameters.frozen_network(), scale }
    }

    fn forward(&self, observation: &Observation) -> candle_core::Result<Tensor> {
        let inputs = self.scale.inputs([observation].into_iter(), &Device::Cpu)?;
        self.network.forward(&inputs.each_ref())
    }
}

/// A trained actor that drives.
///
/// Where a step did not move the car at all, the next action is random, as in HOPE: the same
/// mean would be tried for ever.
#[derive(Clone, Debug)]
pub struct ActorPolicy {
    actor: Actor,
    choice: Choice,
    last_target: Option<[f32; TARGET]>,
}

impl ActorPolicy {
    /// `actor`, driving by `choice`.
    pub fn new(actor: Actor, choice: Choice) -> Self {
        Self { actor, choice, last_target: None }
    }
}

impl Policy for ActorPolicy {
    fn act(
        &mut self,
        observation: &Observation,
        rng: &mut ChaCha8Rng,
    ) -> Result<Action, PolicyFault> {
        let last = self.last_target.replace(observation.target);
        let stuck = observation.step > 0 && last == Some(observation.target);
        let action = if stuck {
            random_action(rng)
        } else {
            let noise = (self.choice == Choice::Sampled).then(|| normal(rng, ACTION));
            let output = self.actor.forward(observation);
            let action = output.and_then(|o| squashed(&o, noise.as_deref(), &Device::Cpu));
            let action = action.and_then(|a| a.flatten_all()?.to_vec1::<f32>());
            // Shapes were checked when the file was read.
            let action = action.expect("an actor of the right shapes");
            Action { steer: action[0].into(), speed: action[1].into() }
        };
        Ok(match self.choice {
            Choice::Sampled => action,
            Choice::Mean => admitted(action, &observation.mask),
        })
    }
}

/// Uniform over all steering and speed.
pub fn random_action(rng: &mut ChaCha8Rng) -> Action {
    Action { steer: rng.random_range(-1.0..=1.0), speed: rng.random_range(-1.0..=1.0) }
}

/// `count` values of the standard normal distribution.
pub fn normal(rng: &mut ChaCha8Rng, count: usize) -> Vec<f32> {
    (0..count).map(|_| rng.sample(StandardNormal)).collect()
}
