//! Policies from ONNX files, run by `rten` (pure Rust) on one thread.
//!
//! Tensors, all 32-bit floats; the batch dimension may be symbolic:
//!
//! | name | shape | holds |
//! |---|---|---|
//! | input `lidar` | `[1, 120]` | [`Observation::lidar`] |
//! | input `target` | `[1, 5]` | [`Observation::target`] |
//! | input `mask` | `[1, 42]` | [`Observation::mask`] |
//! | output `action` | `[1, 2]` | steer, speed, as in [`Action`] |
//!
//! A graph may leave inputs out and may have further outputs, which are not computed. Numbers
//! are exactly those of the observation: what else a network wants, such as scaling, belongs into
//! the graph. Equal observations give equal actions on one machine; another processor may add in
//! another order, and differ in the last bits.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread;
use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rten::{
    DataType, Dimension, Model, NodeId, NodeInfo, RunOptions, ThreadPool, Value, ValueType,
    ValueView,
};
use rten_tensor::Layout;

pub use super::onnx_file::{OnnxError, OnnxFault};
use super::onnx_file::{in_one_line, read};
use super::{Policy, PolicyFault};
use crate::environment::{Action, BEAMS, MASK, Observation};

/// Name of the output.
const ACTION: &str = "action";
/// Loading takes milliseconds; what takes longer than this never ends.
const LOADING: Duration = Duration::from_secs(10);

/// A policy that is an ONNX file.
pub struct OnnxPolicy {
    path: PathBuf,
    model: Model,
    /// The inputs that the graph has, in its order.
    inputs: Vec<(NodeId, Input)>,
    action: NodeId,
    /// One thread: small networks gain nothing from more, and evaluation uses the other cores.
    pool: Arc<ThreadPool>,
}

/// What an input is fed.
#[derive(Clone, Copy)]
enum Input {
    Lidar,
    Target,
    Mask,
}

impl Input {
    fn of(name: &str) -> Option<Self> {
        match name {
            "lidar" => Some(Self::Lidar),
            "target" => Some(Self::Target),
            "mask" => Some(Self::Mask),
            _ => None,
        }
    }

    fn of_observation(self, observation: &Observation) -> &[f32] {
        match self {
            Self::Lidar => &observation.lidar,
            Self::Target => &observation.target,
            Self::Mask => &observation.mask,
        }
    }
}

impl OnnxPolicy {
    /// Loads the file at `path`, checks its tensors, and runs it once, so that a file that does
    /// not fit is refused here and not in the middle of an episode.
    pub fn load(path: &Path) -> Result<Self, OnnxError> {
        let (send, loaded) = sync_channel(1);
        let file = path.to_owned();
        // On a thread of its own, which is given up where a damaged file traps the runtime.
        thread::Builder::new()
            .spawn(move || {
                let _ = send.send(Self::try_load(&file));
            })
            .map_err(OnnxFault::Unreadable)
            .and_then(|_| loaded.recv_timeout(LOADING).unwrap_or(Err(OnnxFault::Stuck)))
            .map_err(|fault| OnnxError { path: path.to_owned(), fault })
    }

    fn try_load(path: &Path) -> Result<Self, OnnxFault> {
        let model = read(path)?;
        let mut inputs = Vec::new();
        for &id in model.input_ids() {
            let info = info(&model, id)?;
            let name = info.name().unwrap_or_default();
            let input = Input::of(name).ok_or_else(|| OnnxFault::UnknownInput(name.to_owned()))?;
            check("input", &info, input.of_observation(&plain_observation()).len())?;
            inputs.push((id, input));
        }
        let action = find_action(&model)?;
        let pool = Arc::new(ThreadPool::with_num_threads(1));
        let policy = Self { path: path.to_owned(), model, inputs, action, pool };
        match policy.run(&plain_observation())? {
            answer if answer.iter().all(|v| v.is_finite()) => Ok(policy),
            answer => Err(OnnxFault::NotFinite(answer)),
        }
    }

    /// Steer and speed as the graph gives them.
    fn run(&self, observation: &Observation) -> Result<[f32; 2], OnnxFault> {
        let fails = |e: &dyn std::error::Error| OnnxFault::Fails(in_one_line(e));
        let mut inputs = Vec::with_capacity(self.inputs.len());
        for &(id, input) in &self.inputs {
            let values = input.of_observation(observation);
            let view = ValueView::from_shape([1, values.len()], values).map_err(|e| fails(&e))?;
            inputs.push((id, view.into()));
        }
        let options = RunOptions::default().with_thread_pool(Some(self.pool.clone()));
        let outputs = self.model.run_n(inputs, [self.action], Some(options));
        let [output] = outputs.map_err(|e| fails(&e))?;
        answer(&output)
    }
}

impl Policy for OnnxPolicy {
    fn act(
        &mut self,
        observation: &Observation,
        _rng: &mut ChaCha8Rng,
    ) -> Result<Action, PolicyFault> {
        let warn = |what: String| log::warn!("policy {}: {what}", self.path.display());
        match self.run(observation) {
            Ok([steer, speed]) if steer.is_finite() && speed.is_finite() => {
                Ok(Action { steer: steer.into(), speed: speed.into() })
            }
            Ok(answer) => {
                warn(format!("step {}: the answer is {answer:?}", observation.step));
                Err(PolicyFault::NotFinite)
            }
            Err(fault) => {
                let what = match fault {
                    OnnxFault::Fails(what) => what,
                    other => other.to_string(),
                };
                warn(format!("step {}: {what}", observation.step));
                Err(PolicyFault::NoAction)
            }
        }
    }
}

fn info(model: &Model, id: NodeId) -> Result<NodeInfo<'_>, OnnxFault> {
    model.node_info(id).ok_or(OnnxFault::NotOnnx)
}

/// The output called `action`.
fn find_action(model: &Model) -> Result<NodeId, OnnxFault> {
    let mut names = Vec::new();
    for &id in model.output_ids() {
        let info = info(model, id)?;
        let name = info.name().unwrap_or_default();
        if name == ACTION {
            check("output", &info, 2)?;
            return Ok(id);
        }
        names.push(format!("{name:?}"));
    }
    Err(OnnxFault::NoAction(names.join(", ")))
}

/// Whether a tensor can be f32 `[1, size]`, as far as the file says.
fn check(side: &str, info: &NodeInfo, size: usize) -> Result<(), OnnxFault> {
    let dtype = info.dtype().unwrap_or(ValueType::Tensor(DataType::Float));
    let fits = |dim: &Dimension, expected| match dim {
        Dimension::Fixed(n) => *n == expected,
        Dimension::Symbolic(_) => true,
    };
    let shape = info.shape();
    let shape_fits = match shape.as_deref() {
        Some([batch, width]) => fits(batch, 1) && fits(width, size),
        Some(_) => false,
        None => true,
    };
    if shape_fits && dtype == ValueType::Tensor(DataType::Float) {
        return Ok(());
    }
    let dims = shape.unwrap_or_default();
    let dims = dims.iter().map(|dim| match dim {
        Dimension::Fixed(n) => n.to_string(),
        Dimension::Symbolic(name) => name.clone(),
    });
    let dims = dims.collect::<Vec<_>>().join(", ");
    let dtype = match dtype {
        ValueType::Tensor(dtype) => dtype.to_string(),
        other => other.to_string(),
    };
    let tensor = format!("{side} {}", info.name().unwrap_or_default());
    Err(OnnxFault::Shape { tensor, found: format!("{dtype} [{dims}]"), size })
}

/// The two numbers of what the graph computed.
fn answer(output: &Value) -> Result<[f32; 2], OnnxFault> {
    if let Value::FloatTensor(tensor) = output
        && tensor.shape() == [1, 2]
    {
        return Ok([tensor[[0, 0]], tensor[[0, 1]]]);
    }
    let found = format!("{} {:?}", output.dtype(), output.shape());
    Err(OnnxFault::Shape { tensor: format!("output {ACTION}"), found, size: 2 })
}

/// Open space, and a goal some metres ahead on the right.
fn plain_observation() -> Observation {
    Observation {
        step: 0,
        lidar: [5.0; BEAMS],
        target: [5.0, 0.8, -0.6, 0.6, -0.8],
        mask: [1.0; MASK],
    }
}
