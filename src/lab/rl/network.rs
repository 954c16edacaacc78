//! The network of actors and critics: one token per modality, one attention block.
//!
//! As in HOPE, reduced and without the image: each modality passes two linear layers and becomes
//! a token of [`WIDTH`]; one pre-norm transformer block lets the tokens see each other; two more
//! layers read them all. Rectified linear units stand for the hyperbolic tangents of the
//! original, which cost seven times as much here.

use std::collections::BTreeMap;

use candle_core::{Device, Result, Tensor, Var};
use rand::RngExt;

use crate::environment::{BEAMS, MASK, TARGET};
use crate::lab::nn::{attention, layer_norm};
use crate::rng::{Stream, rng};

/// Width of a token.
pub const WIDTH: usize = 64;
const HEADS: usize = 4;
/// Components of an action.
pub const ACTION: usize = 2;

/// What a network maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Observation → mean and raw log σ of each component of the action.
    Actor,
    /// Observation and action → value.
    Critic,
}

impl Role {
    /// Sizes of the modalities, in the order of the inputs.
    pub fn inputs(self) -> &'static [usize] {
        match self {
            Role::Actor => &[BEAMS, TARGET, MASK],
            Role::Critic => &[BEAMS, TARGET, MASK, ACTION],
        }
    }

    fn outputs(self) -> usize {
        match self {
            Role::Actor => 2 * ACTION,
            Role::Critic => 1,
        }
    }

    /// Inputs and outputs of every linear layer, by name.
    fn layers(self) -> Vec<(String, usize, usize)> {
        let inputs = self.inputs();
        let mut layers = Vec::new();
        for (i, &size) in inputs.iter().enumerate() {
            layers.push((format!("token{i}.0"), size, WIDTH));
            layers.push((format!("token{i}.1"), WIDTH, WIDTH));
        }
        for (name, from, to) in [
            ("qkv", WIDTH, 3 * WIDTH),
            ("mix", WIDTH, WIDTH),
            ("feed.0", WIDTH, WIDTH),
            ("feed.1", WIDTH, WIDTH),
            ("head.0", inputs.len() * WIDTH, WIDTH),
            ("head.1", WIDTH, self.outputs()),
        ] {
            layers.push((name.to_owned(), from, to));
        }
        layers
    }

    /// Shape of every parameter, by name: weights `[inputs, outputs]`, biases `[outputs]`, and
    /// scale and shift of the two normalisations `[WIDTH]`.
    pub fn shapes(self) -> BTreeMap<String, Vec<usize>> {
        let mut shapes = BTreeMap::new();
        for (name, from, to) in self.layers() {
            shapes.insert(format!("{name}.weight"), vec![from, to]);
            shapes.insert(format!("{name}.bias"), vec![to]);
        }
        for norm in ["norm0", "norm1"] {
            shapes.insert(format!("{norm}.scale"), vec![WIDTH]);
            shapes.insert(format!("{norm}.shift"), vec![WIDTH]);
        }
        shapes
    }
}

/// The variables of a network, by name.
#[derive(Clone, Debug)]
pub struct Parameters {
    role: Role,
    vars: BTreeMap<String, Var>,
}

impl Parameters {
    /// Initial weights drawn from `(seed, index)`: uniform with variance 1 / inputs, those of the
    /// last layer a hundredth of it; biases 0.
    pub fn random(role: Role, seed: u64, index: u64, device: &Device) -> Result<Self> {
        let mut rng = rng(seed, Stream::Weights, index);
        let mut values = BTreeMap::new();
        for (name, from, to) in role.layers() {
            let gain = if name == "head.1" { 0.01 } else { 1.0 };
            let limit = gain * (3.0 / from as f32).sqrt();
            let weight = (0..from * to).map(|_| rng.random_range(-limit..limit)).collect();
            values.insert(format!("{name}.weight"), weight);
        }
        for (name, shape) in role.shapes() {
            let fill = if name.ends_with("scale") { 1.0 } else { 0.0 };
            values.entry(name).or_insert_with(|| vec![fill; shape[0]]);
        }
        Self::from_values(role, values, device)
    }

    /// Parameters with these values; names and lengths are those of [`Role::shapes`].
    pub fn from_values(
        role: Role,
        mut values: BTreeMap<String, Vec<f32>>,
        device: &Device,
    ) -> Result<Self> {
        let mut vars = BTreeMap::new();
        for (name, shape) in role.shapes() {
            let values = values.remove(&name).unwrap_or_default();
            vars.insert(name, Var::from_vec(values, shape, device)?);
        }
        Ok(Self { role, vars })
    }

    /// Another set of the same values.
    pub fn copied(&self) -> Result<Self> {
        let copy =
            |(name, var): (&String, &Var)| Ok((name.clone(), Var::from_tensor(&var.copy()?)?));
        Ok(Self { role: self.role, vars: self.vars.iter().map(copy).collect::<Result<_>>()? })
    }

    /// The variables, by name.
    pub fn vars(&self) -> &BTreeMap<String, Var> {
        &self.vars
    }

    /// The values, by name.
    pub fn values(&self) -> Result<BTreeMap<String, Vec<f32>>> {
        let values =
            |(name, var): (&String, &Var)| Ok((name.clone(), var.flatten_all()?.to_vec1()?));
        self.vars.iter().map(values).collect()
    }

    /// Moves every value toward that of `other` by `share` of the way.
    pub fn follow(&self, other: &Parameters, share: f64) -> Result<()> {
        for (name, var) in &self.vars {
            let toward = (other.vars[name].as_tensor() - var.as_tensor())?.detach();
            var.set(&(var.as_tensor().detach() + (toward * share)?)?)?;
        }
        Ok(())
    }

    /// The network of these parameters; it follows their changes.
    pub fn network(&self) -> Network {
        Network::new(self.role, |name| self.vars[name].as_tensor().clone())
    }

    /// The same network; no gradient goes to its parameters.
    pub fn frozen_network(&self) -> Network {
        Network::new(self.role, |name| self.vars[name].as_tensor().detach())
    }
}

#[derive(Clone, Debug)]
struct Linear {
    weight: Tensor,
    bias: Tensor,
}

impl Linear {
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        x.matmul(&self.weight)?.broadcast_add(&self.bias)
    }
}

#[derive(Clone, Debug)]
struct Norm {
    scale: Tensor,
    shift: Tensor,
}

impl Norm {
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        layer_norm(x)?.broadcast_mul(&self.scale)?.broadcast_add(&self.shift)
    }
}

/// A network ready to run.
#[derive(Clone, Debug)]
pub struct Network {
    tokens: Vec<[Linear; 2]>,
    norms: [Norm; 2],
    qkv: Linear,
    mix: Linear,
    feed: [Linear; 2],
    head: [Linear; 2],
}

impl Network {
    fn new(role: Role, get: impl Fn(&str) -> Tensor) -> Self {
        let linear = |name: &str| Linear {
            weight: get(&format!("{name}.weight")),
            bias: get(&format!("{name}.bias")),
        };
        let norm = |name: &str| Norm {
            scale: get(&format!("{name}.scale")),
            shift: get(&format!("{name}.shift")),
        };
        let pair = |name: &str| [0, 1].map(|i| linear(&format!("{name}.{i}")));
        Self {
            tokens: (0..role.inputs().len()).map(|i| pair(&format!("token{i}"))).collect(),
            norms: [norm("norm0"), norm("norm1")],
            qkv: linear("qkv"),
            mix: linear("mix"),
            feed: pair("feed"),
            head: pair("head"),
        }
    }

    /// One input `[batch, size]` per modality → `[batch, outputs]`.
    pub fn forward(&self, inputs: &[&Tensor]) -> Result<Tensor> {
        let count = self.tokens.len();
        let tokens = self.tokens.iter().zip(inputs).map(|([first, second], input)| {
            second.forward(&first.forward(input)?.relu()?)?.unsqueeze(1)
        });
        let tokens = Tensor::cat(&tokens.collect::<Result<Vec<_>>>()?, 1)?;
        let batch = tokens.dim(0)?;
        let x = tokens.reshape((batch * count, WIDTH))?;
        let seen = attention(&self.qkv.forward(&self.norms[0].forward(&x)?)?, count, HEADS)?;
        let x = (x + self.mix.forward(&seen)?)?;
        let [first, second] = &self.feed;
        let fed = second.forward(&first.forward(&self.norms[1].forward(&x)?)?.relu()?)?;
        let x = (x + fed)?.reshape((batch, count * WIDTH))?;
        let [first, last] = &self.head;
        last.forward(&first.forward(&x)?.relu()?)
    }
}
