//! Foresight: a network that sees the free space around a spot, and says what known manoeuvres are worth
//! there and what the best plan will cost.
//!
//! Two towers. One makes a code of the scene: start, vehicle, how far everything is (`free_space`), and
//! the estimates of the library. The other makes a code of every manoeuvre: where it begins, what it costs,
//! what it sweeps; those of a library are made once. How well they go together, less what the manoeuvre is
//! estimated to cost, is its score. The scene's code also holds the foreseen cost of the best plan.
//!
//! All lengths and costs are in turning radii, so that one model serves vehicles of any size and any library.
//! What it says only decides what is tried first and how long the planner goes on; every path is checked
//! as exactly as without it.
//!
//! The file (`foresight.safetensors`): layers `scene.layers.N.…` and `manoeuvre.layers.N.…` as
//! [`super::tensor_file`] says, with a [`ForesightHeader`].

mod free_space;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub(crate) use self::free_space::is_in_sight;
use self::free_space::{FREE, SWEPT, free_space, swept};
use super::artefact::{self, ArtefactError, Fault};
use super::network::{LayerWeights, Network};
use super::{Normaliser, tensor_file};
use crate::curves::{self, Segment};
use crate::geometry::Pose;
use crate::planners::Problem;
use crate::vehicle::Vehicle;
use crate::world::Stance;

/// The format version written and read by this program.
pub const VERSION: u32 = 1;
/// Numbers that say what a scene is.
pub const SCENE: usize = 11 + FREE;
/// Numbers that say what a manoeuvre is.
pub const MANOEUVRE: usize = 8 + SWEPT;
/// Numbers of a code.
pub const CODE: usize = 32;
/// Widths of the tower that sees the scene: its code, the weight of estimates, the foreseen cost.
pub const SCENE_LAYERS: [usize; 4] = [SCENE, 128, 64, CODE + 2];
/// Widths of the tower that sees a manoeuvre: its code, and what it is worth anywhere.
pub const MANOEUVRE_LAYERS: [usize; 3] = [MANOEUVRE, 64, CODE + 1];
/// Costs beyond so many turning radii are as good as none.
const MOST: f64 = 20.0;

/// What the file says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForesightHeader {
    /// [`VERSION`] at training.
    pub format_version: u32,
    /// The models whose libraries it learnt with, and the SHA-256 of each.
    pub foresight: Vec<(String, String)>,
    /// Scaling of what says what a scene is.
    pub scene: Normaliser,
    /// Scaling of what says what a manoeuvre is.
    pub manoeuvre: Normaliser,
    /// Settings of the training, for the record.
    pub training: serde_json::Value,
    /// Version of this crate at training.
    pub crate_version: String,
}

/// The network, ready to look at scenes.
#[derive(Clone, Debug)]
pub struct Foresight {
    path: PathBuf,
    header: ForesightHeader,
    scene: Network,
    manoeuvre: Network,
}

/// The codes of a library's manoeuvres.
#[derive(Clone, Debug)]
pub struct Codes {
    /// A scene's code → the worth of each.
    worth: Network,
    count: usize,
}

/// What is foreseen in one scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outlook {
    code: [f32; CODE],
    /// By which estimated costs count, turning radii.
    weight: f32,
    /// What the best plan is foreseen to cost, metres.
    pub cost: f64,
    /// Whether nothing stands beside the spot: the network has learnt of few such.
    pub in_the_open: bool,
}

/// The bytes of a file.
#[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
pub fn encode(
    header: &ForesightHeader,
    scene: &[LayerWeights],
    manoeuvre: &[LayerWeights],
) -> Vec<u8> {
    let mut tensors = tensor_file::layer_tensors("scene.", &SCENE_LAYERS, scene);
    tensors.extend(tensor_file::layer_tensors("manoeuvre.", &MANOEUVRE_LAYERS, manoeuvre));
    tensor_file::encode(&serde_json::to_string(header).expect("plain data"), tensors)
}

/// What says what the scene of a problem is. `estimates`: those of the cheapest manoeuvre and of the
/// curve straight to the goal, metres.
pub fn scene_values(problem: &Problem, stance: Stance, estimates: [f64; 2]) -> [f32; SCENE] {
    let Problem { vehicle, start, .. } = problem;
    let of_radius = |metres: f64| (metres / vehicle.turning_radius()).clamp(-MOST, MOST);
    let (sin, cos) = start.sin_cos();
    let (goal_sin, goal_cos) = stance.heading().sin_cos();
    let seen = [
        of_radius(start.x),
        of_radius(start.y),
        cos,
        sin,
        goal_cos,
        goal_sin,
        of_radius(vehicle.length),
        of_radius(vehicle.width),
        of_radius(vehicle.rear_overhang),
        of_radius(estimates[0]),
        of_radius(estimates[1]),
    ];
    let free = free_space(problem, stance);
    std::array::from_fn(|i| if i < seen.len() { seen[i] as f32 } else { free[i - seen.len()] })
}

/// What says what a manoeuvre is: `motions` in driving order into a goal in which the car stands so, at
/// this `cost`.
pub fn manoeuvre_values(
    stance: Stance,
    vehicle: &Vehicle,
    motions: &[Segment],
    cost: f64,
) -> [f32; MANOEUVRE] {
    let radius = vehicle.turning_radius();
    let goal = vehicle.rear_axle(Pose::new(0.0, 0.0, stance.heading()));
    let begin = motions.iter().rev().fold(goal, |pose, s| s.reversed().end(pose));
    let first = motions.first().copied().unwrap_or_default();
    let gear = if motions.is_empty() { 0.0 } else { first.gear().sign() };
    let (sin, cos) = begin.sin_cos();
    let seen = [
        begin.x / radius,
        begin.y / radius,
        cos,
        sin,
        cost / radius,
        gear,
        first.curvature * radius,
        curves::Path::new(begin, motions.iter().copied()).direction_changes() as f64,
    ];
    let swept = swept(stance, vehicle, motions);
    std::array::from_fn(|i| if i < seen.len() { seen[i] as f32 } else { swept[i - seen.len()] })
}

/// What the foreseen cost is relative to: the least estimate, but no less than a little, metres.
pub fn least_cost(vehicle: &Vehicle, estimates: [f64; 2]) -> f64 {
    estimates[0].min(estimates[1]).max(0.5 * vehicle.turning_radius())
}

impl Foresight {
    /// Loads the file at `path`, or what is compiled in under that name.
    pub fn load(path: &Path) -> Result<Self, ArtefactError> {
        Self::from_bytes(path, &artefact::read(path)?)
    }

    /// Reads and checks the bytes of the file at `path`.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ArtefactError> {
        Self::decode(path, bytes).map_err(|fault| fault.of(path))
    }

    fn decode(path: &Path, bytes: &[u8]) -> Result<Self, Fault> {
        let (json, tensors) = tensor_file::decode(bytes, VERSION)?;
        let damaged = |e: String| Fault::Header(e);
        let header: ForesightHeader =
            serde_json::from_str(&json).map_err(|e| damaged(e.to_string()))?;
        header.scene.check(SCENE).map_err(|e| damaged(format!("scene {e}")))?;
        header.manoeuvre.check(MANOEUVRE).map_err(|e| damaged(format!("manoeuvre {e}")))?;
        let scene = tensor_file::layers(&tensors, "scene.", &SCENE_LAYERS)?;
        let manoeuvre = tensor_file::layers(&tensors, "manoeuvre.", &MANOEUVRE_LAYERS)?;
        let (path, scene) = (path.to_owned(), Network::new(&SCENE_LAYERS, &scene));
        let manoeuvre = Network::new(&MANOEUVRE_LAYERS, &manoeuvre);
        Ok(Self { path, header, scene, manoeuvre })
    }

    /// The file it was loaded from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The header.
    pub fn header(&self) -> &ForesightHeader {
        &self.header
    }

    /// The codes of manoeuvres, given by their values.
    pub fn codes(&self, manoeuvres: &[[f32; MANOEUVRE]]) -> Codes {
        let count = manoeuvres.len();
        let (mut weight, mut bias) = (Vec::with_capacity(count * CODE), Vec::new());
        for &values in manoeuvres {
            let values = self.header.manoeuvre.normalise(values);
            let code: [f32; CODE + 1] = self.manoeuvre.forward(&values);
            weight.extend_from_slice(&code[..CODE]);
            bias.push(code[CODE]);
        }
        Codes { worth: Network::new(&[CODE, count], &[LayerWeights { weight, bias }]), count }
    }

    /// Looks at the scene of a problem.
    pub fn look(&self, problem: &Problem, stance: Stance, estimates: [f64; 2]) -> Outlook {
        let seen = scene_values(problem, stance, estimates);
        let in_the_open = free_space::has_nothing_beside_the_spot(&seen[SCENE - FREE..]);
        let values = self.header.scene.normalise(seen);
        let out: [f32; CODE + 2] = self.scene.forward(&values);
        let cost = least_cost(&problem.vehicle, estimates) * f64::from(out[CODE + 1]).exp();
        let unit = problem.vehicle.turning_radius() as f32;
        let code = std::array::from_fn(|i| out[i]);
        Outlook { code, weight: out[CODE] / unit, cost, in_the_open }
    }
}

impl Codes {
    /// The scores of all manoeuvres, given what each is estimated to cost, metres; the higher the better.
    pub fn scores(&self, outlook: &Outlook, estimates: &[f32], out: &mut Vec<f32>) {
        out.clear();
        out.resize(self.count, 0.0);
        self.worth.forward_into(&outlook.code, out);
        for (score, estimate) in out.iter_mut().zip(estimates) {
            *score -= outlook.weight * estimate;
        }
    }
}
