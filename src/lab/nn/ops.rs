//! Attention among few tokens, and layer normalisation.
//!
//! Both exist twice: composed of candle's own operations, for accelerators, and as one pass with
//! its gradient written out, for the CPU. With a handful of tokens the composed form spends most
//! of its time on tiny matrices and temporary tensors. A test holds the two against each other.

use candle_core::{CpuStorage, CustomOp1, CustomOp2, D, Layout, Result, Shape, Tensor, bail};

/// Scaled dot-product self-attention (Vaswani et al. 2017, eq. 1).
///
/// `qkv`: `[batch · tokens, 3 · width]`, queries, keys and values beside each other; `width` is
/// divided among `heads`. Returns `[batch · tokens, width]`.
pub fn attention(qkv: &Tensor, tokens: usize, heads: usize) -> Result<Tensor> {
    let (rows, width) = qkv.dims2()?;
    let shape = Attention { batch: rows / tokens, tokens, heads, size: width / 3 / heads };
    if qkv.device().is_cpu() { qkv.contiguous()?.apply_op1(shape) } else { shape.composed(qkv) }
}

/// Rows of `x`, `[rows, width]`, with mean 0 and variance 1.
pub fn layer_norm(x: &Tensor) -> Result<Tensor> {
    if x.device().is_cpu() { x.contiguous()?.apply_op1(LayerNorm) } else { normed(x) }
}

/// Guards against rows without variance.
const EPSILON: f32 = 1e-5;

fn normed(x: &Tensor) -> Result<Tensor> {
    let centred = x.broadcast_sub(&x.mean_keepdim(D::Minus1)?)?;
    let variance = centred.sqr()?.mean_keepdim(D::Minus1)?;
    centred.broadcast_div(&(variance + f64::from(EPSILON))?.sqrt()?)
}

#[derive(Clone, Copy)]
struct Attention {
    batch: usize,
    tokens: usize,
    heads: usize,
    /// Width of one head.
    size: usize,
}

impl Attention {
    fn composed(&self, qkv: &Tensor) -> Result<Tensor> {
        let Self { batch, tokens, heads, size } = *self;
        let split = qkv.reshape((batch, tokens, 3, heads, size))?.permute((2, 0, 3, 1, 4))?;
        let part = |i| split.get(i)?.contiguous();
        let (q, k, v) = (part(0)?, part(1)?, part(2)?);
        let scores = (q.matmul(&k.t()?.contiguous()?)? * f64::from(self.scale()))?;
        let mixed = candle_nn::ops::softmax(&scores, D::Minus1)?.matmul(&v)?;
        mixed.transpose(1, 2)?.contiguous()?.reshape((batch * tokens, heads * size))
    }

    fn scale(&self) -> f32 {
        (self.size as f32).powf(-0.5)
    }

    /// Calls `each` for every sample and head with the offsets of its tokens' queries in a row of
    /// qkv, and of its outputs; keys and values lie `width` and `2 · width` further on.
    fn for_each_head(&self, mut each: impl FnMut(usize, usize)) {
        let width = self.heads * self.size;
        for sample in 0..self.batch {
            for head in 0..self.heads {
                let first = sample * self.tokens;
                each(first * 3 * width + head * self.size, first * width + head * self.size);
            }
        }
    }

    /// Softmax of one query's scores, into `weights`.
    fn weights(&self, qkv: &[f32], at: usize, query: usize, weights: &mut [f32]) {
        let width = self.heads * self.size;
        let row = |token: usize, part: usize| at + token * 3 * width + part * width;
        let q = &qkv[row(query, 0)..][..self.size];
        for (j, w) in weights.iter_mut().enumerate() {
            *w = dot(q, &qkv[row(j, 1)..][..self.size]) * self.scale();
        }
        let most = weights.iter().fold(f32::MIN, |a, &b| a.max(b));
        weights.iter_mut().for_each(|w| *w = (*w - most).exp());
        let total: f32 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= total);
    }
}

impl CustomOp1 for Attention {
    fn name(&self) -> &'static str {
        "attention"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let qkv = values(storage, layout)?;
        let width = self.heads * self.size;
        let mut out = vec![0.0; self.batch * self.tokens * width];
        let mut weights = vec![0.0; self.tokens];
        self.for_each_head(|at, to| {
            for i in 0..self.tokens {
                self.weights(qkv, at, i, &mut weights);
                let mixed = &mut out[to + i * width..][..self.size];
                for (j, &w) in weights.iter().enumerate() {
                    add(mixed, w, &qkv[at + j * 3 * width + 2 * width..][..self.size]);
                }
            }
        });
        Ok((CpuStorage::F32(out), (self.batch * self.tokens, width).into()))
    }

    fn bwd(&self, qkv: &Tensor, _out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        Ok(Some(qkv.apply_op2_no_bwd(&grad.contiguous()?, &AttentionGradient(*self))?))
    }
}

/// From qkv and the gradient of the output to the gradient of qkv.
struct AttentionGradient(Attention);

impl CustomOp2 for AttentionGradient {
    fn name(&self) -> &'static str {
        "attention-gradient"
    }

    fn cpu_fwd(
        &self,
        s1: &CpuStorage,
        l1: &Layout,
        s2: &CpuStorage,
        l2: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (shape, qkv, out) = (self.0, values(s1, l1)?, values(s2, l2)?);
        let (size, width) = (shape.size, shape.heads * shape.size);
        let mut gradient = vec![0.0; qkv.len()];
        let mut weights = vec![0.0; shape.tokens];
        let mut scores = vec![0.0; shape.tokens];
        shape.for_each_head(|at, to| {
            let row = |token: usize, part: usize| at + token * 3 * width + part * width;
            for i in 0..shape.tokens {
                shape.weights(qkv, at, i, &mut weights);
                let g = &out[to + i * width..][..size];
                for (j, s) in scores.iter_mut().enumerate() {
                    *s = dot(g, &qkv[row(j, 2)..][..size]);
                    add(&mut gradient[row(j, 2)..][..size], weights[j], g);
                }
                // Through the softmax: w (s − Σ w s).
                let mean = dot(&weights, &scores);
                for (j, (&w, &s)) in weights.iter().zip(&scores).enumerate() {
                    let g = w * (s - mean) * shape.scale();
                    add(&mut gradient[row(i, 0)..][..size], g, &qkv[row(j, 1)..][..size]);
                    add(&mut gradient[row(j, 1)..][..size], g, &qkv[row(i, 0)..][..size]);
                }
            }
        });
        Ok((CpuStorage::F32(gradient), l1.shape().clone()))
    }
}

struct LayerNorm;

impl CustomOp1 for LayerNorm {
    fn name(&self) -> &'static str {
        "layer-norm"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let mut out = values(storage, layout)?.to_vec();
        let (_, width) = layout.shape().dims2()?;
        for row in out.chunks_exact_mut(width) {
            let mean = row.iter().sum::<f32>() / width as f32;
            row.iter_mut().for_each(|v| *v -= mean);
            let scale = 1.0 / deviation(row);
            row.iter_mut().for_each(|v| *v *= scale);
        }
        Ok((CpuStorage::F32(out), layout.shape().clone()))
    }

    fn bwd(&self, x: &Tensor, out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        // (g − mean(g) − y mean(g y)) / σ: the scale is found again from x.
        let gradient = LayerNormGradient { x: x.flatten_all()?.to_vec1()? };
        Ok(Some(out.apply_op2_no_bwd(&grad.contiguous()?, &gradient)?))
    }
}

/// From the output and its gradient to the gradient of the input.
struct LayerNormGradient {
    x: Vec<f32>,
}

impl CustomOp2 for LayerNormGradient {
    fn name(&self) -> &'static str {
        "layer-norm-gradient"
    }

    fn cpu_fwd(
        &self,
        s1: &CpuStorage,
        l1: &Layout,
        s2: &CpuStorage,
        l2: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (out, grad) = (values(s1, l1)?, values(s2, l2)?);
        let (_, width) = l1.shape().dims2()?;
        let mut gradient = Vec::with_capacity(out.len());
        let rows = out.chunks_exact(width).zip(grad.chunks_exact(width));
        for ((y, g), x) in rows.zip(self.x.chunks_exact(width)) {
            let n = width as f32;
            let mean = x.iter().sum::<f32>() / n;
            let centred: Vec<f32> = x.iter().map(|v| v - mean).collect();
            let scale = 1.0 / deviation(&centred);
            let (g_mean, gy_mean) = (g.iter().sum::<f32>() / n, dot(g, y) / n);
            gradient.extend(g.iter().zip(y).map(|(g, y)| (g - g_mean - y * gy_mean) * scale));
        }
        Ok((CpuStorage::F32(gradient), l1.shape().clone()))
    }
}

/// Standard deviation of values whose mean is 0.
fn deviation(centred: &[f32]) -> f32 {
    (dot(centred, centred) / centred.len() as f32 + EPSILON).sqrt()
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `to += factor · from`.
fn add(to: &mut [f32], factor: f32, from: &[f32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
}

/// The values of a contiguous tensor of single precision.
fn values<'a>(storage: &'a CpuStorage, layout: &Layout) -> Result<&'a [f32]> {
    match (storage, layout.contiguous_offsets()) {
        (CpuStorage::F32(values), Some((from, to))) => Ok(&values[from..to]),
        _ => bail!("expected contiguous single precision"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, rng};
    use candle_core::{Device, Var};
    use rand::RngExt;

    fn random(rows: usize, width: usize, index: u64) -> Result<Var> {
        let mut rng = rng(1, Stream::Weights, index);
        let values: Vec<f32> = (0..rows * width).map(|_| rng.random_range(-2.0..2.0)).collect();
        Var::from_vec(values, (rows, width), &Device::Cpu)
    }

    /// Values and gradients of `one` and `other` agree.
    fn agree(x: &Var, one: Tensor, other: Tensor) -> Result<()> {
        let (rows, width) = one.dims2()?;
        let seed = random(rows, width, 9)?;
        let gradient = |out: &Tensor| -> Result<Tensor> {
            let grads = (out * seed.as_tensor())?.sum_all()?.backward()?;
            grads.get(x).expect("depends on x").contiguous()
        };
        for (a, b) in [(gradient(&one)?, gradient(&other)?), (one, other)] {
            let apart = (a - b)?.abs()?.max_all()?.to_scalar::<f32>()?;
            assert!(apart < 2e-5, "{apart}");
        }
        Ok(())
    }

    #[test]
    fn one_pass_agrees_with_candles_operations() -> Result<()> {
        for (batch, tokens, heads, size) in [(5, 3, 4, 16), (1, 4, 2, 8), (3, 1, 1, 4)] {
            let x = random(batch * tokens, 3 * heads * size, 1)?;
            let shape = Attention { batch, tokens, heads, size };
            agree(&x, attention(&x, tokens, heads)?, shape.composed(&x)?)?;
            let x = random(batch, size, 2)?;
            agree(&x, layer_norm(&x)?, normed(&x)?)?;
        }
        Ok(())
    }
}
