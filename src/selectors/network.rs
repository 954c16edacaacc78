//! Networks with ReLU evaluated without a framework: the paper's, 6 → 256 → 256 → 256 → 128 → 4, and
//! others of other widths.
//!
//! One sample at a time, plain loops over single precision. A layer's outputs are
//! computed in blocks whose sums stay in registers while the block's weights are read once,
//! in order; inputs that ReLU has zeroed are skipped. Every output adds its terms in the same
//! order with separate multiplication and addition, so that results are the same bits on
//! every machine, whatever its vector width.

use super::Features;
use crate::geometry::Pose;

/// Widths of the layers, input and output included (paper, section IV).
pub const LAYERS: [usize; 6] = layers(Features::COUNT);
/// Number of outputs: `(x, y, cos θ, sin θ)` of the preparatory pose.
pub const OUTPUTS: usize = 4;

/// [`LAYERS`] with another number of inputs.
pub const fn layers(inputs: usize) -> [usize; 6] {
    [inputs, 256, 256, 256, 128, OUTPUTS]
}

/// Outputs per block: eight registers of four numbers on the plainest x86-64.
const BLOCK: usize = 32;
const WIDEST: usize = 256;

/// Weights of one fully connected layer, as stored in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerWeights {
    /// `[outputs, inputs]`, row after row.
    pub weight: Vec<f32>,
    /// `[outputs]`.
    pub bias: Vec<f32>,
}

/// A pose as the network's raw outputs: the position in its own unit, cosine, sine.
pub fn outputs_from_pose(pose: Pose) -> [f32; OUTPUTS] {
    let (sin, cos) = pose.sin_cos();
    [pose.x, pose.y, cos, sin].map(|v| v as f32)
}

/// The pose of raw outputs; cosine and sine need not be normalised.
pub fn pose_from_outputs([x, y, cos, sin]: [f32; OUTPUTS]) -> Pose {
    let [x, y, cos, sin] = [x, y, cos, sin].map(f64::from);
    Pose::new(x, y, sin.atan2(cos))
}

/// A network, laid out for evaluation.
#[derive(Clone, Debug)]
pub struct Network {
    layers: Vec<Dense>,
}

#[derive(Clone, Debug)]
struct Dense {
    inputs: usize,
    outputs: usize,
    /// One per block of outputs; padded with zeros.
    bias: Vec<[f32; BLOCK]>,
    /// Block after block; in a block one row per input.
    weight: Vec<[f32; BLOCK]>,
}

impl Dense {
    fn new(inputs: usize, outputs: usize, weights: &LayerWeights) -> Self {
        let blocks = outputs.div_ceil(BLOCK);
        let mut bias = vec![[0.0; BLOCK]; blocks];
        let mut weight = vec![[0.0; BLOCK]; blocks * inputs];
        for o in 0..outputs {
            let (block, lane) = (o / BLOCK, o % BLOCK);
            bias[block][lane] = weights.bias[o];
            for i in 0..inputs {
                weight[block * inputs + i][lane] = weights.weight[o * inputs + i];
            }
        }
        Self { inputs, outputs, bias, weight }
    }

    /// Writes the first outputs, as many as there is room for.
    #[inline(always)]
    fn forward(&self, active: &[(usize, f32)], out: &mut [f32]) {
        let blocks = self.bias.iter().zip(self.weight.chunks_exact(self.inputs));
        for ((bias, rows), out) in blocks.zip(out.chunks_mut(BLOCK)) {
            let sums = block(bias, rows, active);
            match out.as_chunks_mut() {
                ([whole], _) => *whole = sums,
                (_, part) => part.copy_from_slice(&sums[..part.len()]),
            }
        }
    }
}

/// The outputs of one block. A function of its own, so that its sums stay in registers.
#[inline(always)]
fn block(bias: &[f32; BLOCK], rows: &[[f32; BLOCK]], active: &[(usize, f32)]) -> [f32; BLOCK] {
    let mut sums = *bias;
    for &(i, v) in active {
        let row = &rows[i];
        for (sum, w) in sums.iter_mut().zip(row) {
            *sum += v * w;
        }
    }
    sums
}

impl Network {
    /// Lays out the weights of layers of these widths, that of the input first; only the last may be
    /// wider than 256.
    ///
    /// # Panics
    ///
    /// When the sizes of the weights are others.
    pub fn new(widths: &[usize], weights: &[LayerWeights]) -> Self {
        assert_eq!(weights.len(), widths.len() - 1, "one set of weights per layer");
        assert!(widths[..widths.len() - 1].iter().all(|w| *w <= WIDEST), "{widths:?}");
        let layers = weights.iter().zip(widths.windows(2)).map(|(weights, size)| {
            assert_eq!(weights.weight.len(), size[0] * size[1], "weights of {size:?}");
            assert_eq!(weights.bias.len(), size[1], "biases of {size:?}");
            Dense::new(size[0], size[1], weights)
        });
        Self { layers: layers.collect() }
    }

    /// Normalised features, as many as there are inputs, → normalised outputs.
    pub fn forward<const N: usize>(&self, input: &[f32]) -> [f32; N] {
        let mut out = [0.0; N];
        self.forward_into(input, &mut out);
        out
    }

    /// [`Network::forward`] into `out`, which has room for every output.
    ///
    /// # Panics
    ///
    /// When `input` or `out` has another length than the network's.
    pub fn forward_into(&self, input: &[f32], out: &mut [f32]) {
        assert_eq!(input.len(), self.layers[0].inputs, "one value for each input");
        assert_eq!(Some(out.len()), self.layers.last().map(|l| l.outputs), "room for the outputs");
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.forward_avx2(input, out) };
        }
        self.forward_plain(input, out);
    }

    /// The same loops compiled for eight numbers per register; FMA stays off, for its
    /// rounding would differ.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn forward_avx2(&self, input: &[f32], out: &mut [f32]) {
        self.forward_plain(input, out);
    }

    #[inline(always)]
    fn forward_plain(&self, input: &[f32], out: &mut [f32]) {
        let mut values = [0.0_f32; WIDEST];
        let mut active = [(0_usize, 0.0_f32); WIDEST];
        let mut count = input.len();
        for (i, &v) in input.iter().enumerate() {
            active[i] = (i, v);
        }
        let last = self.layers.len() - 1;
        for layer in &self.layers[..last] {
            layer.forward(&active[..count], &mut values[..layer.outputs]);
            // ReLU, keeping the positive ones; written without a branch.
            count = 0;
            for (i, &v) in values[..layer.outputs].iter().enumerate() {
                active[count] = (i, v);
                count += usize::from(v > 0.0);
            }
        }
        self.layers[last].forward(&active[..count], out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    /// Values around what He initialisation gives.
    fn random_weights(seed: u64) -> Vec<LayerWeights> {
        let mut rng = crate::rng::rng(seed, crate::rng::Stream::Weights, 0);
        let layers = LAYERS.windows(2).map(|size| {
            let limit = (6.0 / size[0] as f32).sqrt();
            let mut draw = |n| (0..n).map(|_| rng.random_range(-limit..limit)).collect();
            LayerWeights { weight: draw(size[0] * size[1]), bias: draw(size[1]) }
        });
        layers.collect()
    }

    fn reference(weights: &[LayerWeights], input: [f32; 6]) -> Vec<f32> {
        let mut x = input.to_vec();
        for (n, (layer, size)) in weights.iter().zip(LAYERS.windows(2)).enumerate() {
            let row = |o: usize| &layer.weight[o * size[0]..(o + 1) * size[0]];
            let y = (0..size[1]).map(|o| {
                let dot: f64 =
                    row(o).iter().zip(&x).map(|(w, x)| f64::from(*w) * f64::from(*x)).sum();
                let sum = (dot + f64::from(layer.bias[o])) as f32;
                if n + 2 < LAYERS.len() { sum.max(0.0) } else { sum }
            });
            x = y.collect();
        }
        x
    }

    #[test]
    fn equals_the_textbook_sum_and_itself_without_avx2() {
        let weights = random_weights(5);
        let network = Network::new(&LAYERS, &weights);
        for i in 0..20 {
            let input: [f32; 6] =
                std::array::from_fn(|j| ((i * 7 + j * 3) % 11) as f32 / 5.0 - 1.0);
            let got: [f32; OUTPUTS] = network.forward(&input);
            let mut plain = [0.0; OUTPUTS];
            network.forward_plain(&input, &mut plain);
            assert_eq!(got, plain);
            for (g, e) in got.iter().zip(reference(&weights, input)) {
                assert!((g - e).abs() < 1e-4, "input {i}: {g} against {e}");
            }
        }
    }
}
