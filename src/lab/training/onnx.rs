//! Networks as ONNX files, for other runtimes.
//!
//! Raw features go in and raw outputs come out, as the model's card says: the scaling is part of the
//! graph. The format is Protocol Buffers; the few messages of a chain of dense layers are written here.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::selectors::artefact::{self, ArtefactError, Fault};
use crate::selectors::fleet::UNIT_LAYERS;
use crate::selectors::foresight::{MANOEUVRE_LAYERS, SCENE_LAYERS};
use crate::selectors::network::LayerWeights;
use crate::selectors::tensor_file::{self, Content};
use crate::selectors::{Normaliser, fleet, foresight, knn_file, mlp};

/// Version of the operators (ONNX opset) and of the format.
const OPERATORS: u64 = 13;
const IR: u64 = 8;

/// A network to write.
struct Dense {
    /// What the file's name ends with; empty where the model is one network.
    suffix: String,
    layers: Vec<LayerWeights>,
    input: Normaliser,
    /// `None` where outputs are not scaled.
    output: Option<Normaliser>,
}

/// Writes every network of the model at `path` to a file of its own in `folder`, and returns these files.
pub fn export(path: &Path, folder: &Path) -> Result<Vec<PathBuf>, ArtefactError> {
    let networks = networks(&artefact::read(path)?).map_err(|fault| fault.of(path))?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut files = Vec::new();
    for network in networks {
        let file = folder.join(format!("{stem}{}.onnx", network.suffix));
        artefact::write(&file, &network.model())?;
        files.push(file);
    }
    Ok(files)
}

/// The networks of a model's bytes, all of whose checks were passed.
fn networks(bytes: &[u8]) -> Result<Vec<Dense>, Fault> {
    let damaged = |e: serde_json::Error| Fault::Header(e.to_string());
    let normaliser = |value: &Value| serde_json::from_value::<Normaliser>(value.clone());
    let scaled = |header: &Value, prefix: &str, widths: &[usize], tensors: &_| {
        let layers = tensor_file::layers(tensors, prefix, widths)?;
        let suffix = String::new();
        let input = normaliser(&header["input"]).map_err(damaged)?;
        let output = Some(normaliser(&header["output"]).map_err(damaged)?);
        Ok::<_, Fault>(Dense { suffix, layers, input, output })
    };
    if bytes.starts_with(&knn_file::MAGIC) {
        return Err(Fault::NoNetwork);
    }
    match Content::of_file(bytes) {
        Content::Policy => Err(Fault::NoNetwork),
        Content::Mlp => {
            let (json, tensors) = tensor_file::decode(bytes, mlp::VERSION)?;
            let header: mlp::MlpHeader = serde_json::from_str(&json).map_err(damaged)?;
            let layers = mlp::layers_for(header.kind);
            let header = serde_json::to_value(header).expect("plain data");
            Ok(vec![scaled(&header, "", &layers, &tensors)?])
        }
        Content::Fleet => {
            let (json, tensors) = tensor_file::decode(bytes, fleet::VERSION)?;
            let header: fleet::FleetHeader = serde_json::from_str(&json).map_err(damaged)?;
            let scaling = serde_json::to_value(&header.scaling).expect("plain data");
            let of_kind = |(i, (kind, ..)): (usize, &(_, _, _))| {
                let prefix = format!("{kind}.");
                let network = scaled(&scaling[i], &prefix, &UNIT_LAYERS, &tensors)?;
                Ok(Dense { suffix: format!("-{kind}"), ..network })
            };
            header.kinds.iter().enumerate().map(of_kind).collect()
        }
        Content::Foresight => {
            let (json, tensors) = tensor_file::decode(bytes, foresight::VERSION)?;
            let header: foresight::ForesightHeader =
                serde_json::from_str(&json).map_err(damaged)?;
            let tower = |name: &str, widths: &[usize], input: Normaliser| {
                let layers = tensor_file::layers(&tensors, &format!("{name}."), widths)?;
                Ok(Dense { suffix: format!("-{name}"), layers, input, output: None })
            };
            Ok(vec![
                tower("scene", &SCENE_LAYERS, header.scene)?,
                tower("manoeuvre", &MANOEUVRE_LAYERS, header.manoeuvre)?,
            ])
        }
    }
}

/// A message of Protocol Buffers under way.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, mut v: u64) {
        while v >= 128 {
            self.0.push(v as u8 | 128);
            v >>= 7;
        }
        self.0.push(v as u8);
    }

    /// A whole number.
    fn number(mut self, field: u64, v: u64) -> Self {
        self.varint(field << 3);
        self.varint(v);
        self
    }

    /// Text, bytes, or the bytes of another message.
    fn bytes(mut self, field: u64, bytes: impl AsRef<[u8]>) -> Self {
        let bytes = bytes.as_ref();
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
        self
    }

    fn message(self, field: u64, message: Message) -> Self {
        self.bytes(field, message.0)
    }
}

/// The graph being written: one value flows through it.
struct Graph {
    message: Message,
    value: String,
    nodes: usize,
}

impl Graph {
    /// Adds `operator` on the value and on constants of the given shapes.
    fn apply(
        &mut self,
        operator: &str,
        constants: &[(&[usize], &[f32])],
        attributes: &[(&str, u64)],
    ) {
        let number = self.nodes;
        self.nodes += 1;
        let mut node = Message::default().bytes(1, &self.value);
        for (i, (shape, values)) in constants.iter().enumerate() {
            let name = format!("constant_{number}_{i}");
            let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let mut tensor = Message::default();
            for &size in *shape {
                tensor = tensor.number(1, size as u64);
            }
            // Of single precision.
            let tensor = tensor.number(2, 1).bytes(8, &name).bytes(9, raw);
            self.message = std::mem::take(&mut self.message).message(5, tensor);
            node = node.bytes(1, name);
        }
        self.value = format!("value_{number}");
        node = node.bytes(2, &self.value).bytes(4, operator);
        for (name, value) in attributes {
            // A whole number.
            let attribute = Message::default().bytes(1, name).number(3, *value).number(20, 2);
            node = node.message(5, attribute);
        }
        self.message = std::mem::take(&mut self.message).message(1, node);
    }
}

impl Dense {
    /// The file's bytes.
    fn model(&self) -> Vec<u8> {
        let (inputs, outputs) =
            (self.input.mean.len(), self.layers[self.layers.len() - 1].bias.len());
        let mut graph = Graph {
            message: Message::default().bytes(2, "n3p"),
            value: "features".into(),
            nodes: 0,
        };
        let Normaliser { mean, std } = &self.input;
        graph.apply("Sub", &[(&[inputs], mean)], &[]);
        graph.apply("Div", &[(&[inputs], std)], &[]);
        for (i, LayerWeights { weight, bias }) in self.layers.iter().enumerate() {
            let rows = bias.len();
            let shape = [rows, weight.len() / rows];
            graph.apply("Gemm", &[(&shape, weight), (&[rows], bias)], &[("transB", 1)]);
            if i + 1 < self.layers.len() {
                graph.apply("Relu", &[], &[]);
            }
        }
        if let Some(Normaliser { mean, std }) = &self.output {
            graph.apply("Mul", &[(&[outputs], std)], &[]);
            graph.apply("Add", &[(&[outputs], mean)], &[]);
        }
        let Graph { message, value, .. } = graph;
        let graph = message
            .message(11, described("features", inputs))
            .message(12, described(&value, outputs));
        let operators = Message::default().bytes(1, "").number(2, OPERATORS);
        let model = Message::default().number(1, IR).bytes(2, "n3p").message(7, graph);
        model.message(8, operators).0
    }
}

/// A value of shape `[batch, width]`.
fn described(name: &str, width: usize) -> Message {
    let batch = Message::default().bytes(2, "batch");
    let width = Message::default().number(1, width as u64);
    let shape = Message::default().message(1, batch).message(1, width);
    let tensor = Message::default().number(1, 1).message(2, shape);
    Message::default().bytes(1, name).message(2, Message::default().message(1, tensor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selectors::Features;
    use crate::selectors::mlp::MlpSelector;
    use crate::world::cell::Cell;
    use crate::world::{ParkingType, Stance};
    use rten::{Model, NodeId, Value as Tensor};
    use rten_tensor::AsView;

    /// What the file answers for one row.
    fn run(file: &Path, row: &[f32]) -> Vec<f32> {
        let model = Model::load_file(file).unwrap();
        let input: NodeId = model.input_ids()[0];
        let tensor = rten_tensor::Tensor::from_data(&[1, row.len()], row.to_vec());
        let output = model.run(vec![(input, tensor.into())], &[model.output_ids()[0]], None);
        let output: Tensor = output.unwrap().remove(0);
        let output: rten_tensor::Tensor<f32> = output.try_into().unwrap();
        output.to_vec()
    }

    #[test]
    fn another_runtime_predicts_the_same_pose() {
        let dir = tempfile::tempdir().unwrap();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/mlp-parallel.safetensors");
        let files = export(&path, dir.path()).unwrap();
        assert_eq!(files, [dir.path().join("mlp-parallel.onnx")]);
        let selector = MlpSelector::load(&path).unwrap();
        let stance = Stance::new(ParkingType::Parallel, 0.0);
        let cell = Cell { stance, lane_width: 5.0, spot_width: 6.5, dead_end: 9.0 };
        let start = crate::geometry::Pose::new(-6.0, 3.5, 0.1);
        let features = Features::new(start, cell);
        let pose = selector.predict(&features).unwrap();
        let [x, y, cos, sin] = run(&files[0], &features.values())[..] else { panic!("four") };
        assert!((f64::from(x) - pose.x).abs() < 1e-4 && (f64::from(y) - pose.y).abs() < 1e-4);
        assert!((f64::from(sin.atan2(cos)) - pose.heading).abs() < 1e-4);
    }

    #[test]
    fn every_network_gets_a_file_and_other_models_a_reason() {
        let dir = tempfile::tempdir().unwrap();
        let model = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name);
        let files = export(&model("fleet.safetensors"), dir.path()).unwrap();
        assert_eq!(files.len(), 3);
        assert_eq!(run(&files[0], &[0.5; 10]).len(), 4);
        let files = export(&model("foresight.safetensors"), dir.path()).unwrap();
        let names = files.iter().map(|f| f.file_name().unwrap().to_str().unwrap());
        let expected = ["foresight-scene.onnx", "foresight-manoeuvre.onnx"];
        assert!(names.eq(expected), "{files:?}");
        assert_eq!(run(&files[0], &[0.5; foresight::SCENE]).len(), foresight::CODE + 2);
        for name in ["knn.bin", "rl-eval.safetensors"] {
            let error = export(&model(name), dir.path()).unwrap_err().to_string();
            assert!(error.contains("no network that"), "{error}");
        }
    }
}
