//! The state of a training, to go on with later: `NAME.checkpoint` beside the policy.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use candle_core::{Device, Var};
use serde::{Deserialize, Serialize};

use super::log::RlLog;
use super::strata::Strata;
use crate::environment::courses::Stratum;
use crate::environment::parking_env::Progress;
use crate::lab::rl::encoding::InputScale;
use crate::lab::rl::network::{Parameters, Role};
use crate::lab::rl::replay::Replay;
use crate::lab::rl::sac::{Parts, Sac};
use crate::selectors::artefact::{self, ArtefactError, Fault};
use crate::selectors::tensor_file::{self, NamedTensor};

const VERSION: u32 = 1;

/// The checkpoint of the policy `out`.
pub fn checkpoint_path(out: &Path) -> PathBuf {
    out.with_extension("checkpoint")
}

/// An episode under way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slot {
    /// Its stratum.
    pub stratum: usize,
    /// The index of its problem.
    pub index: u64,
    /// Its return so far.
    pub total: f64,
    /// Where it stands.
    pub progress: Progress,
}

/// Everything but tensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Version of the format.
    pub format_version: u32,
    /// Curve and settings.
    pub log: RlLog,
    /// Episodes finished.
    pub episodes: usize,
    /// Steps taken.
    pub steps: u64,
    /// Updates made.
    pub updates: u64,
    /// Rounds of steps: all environments once.
    pub rounds: u64,
    /// Scaling of the inputs.
    pub scale: InputScale,
    /// What was picked, and how it ended.
    pub strata: Strata,
    /// The episodes under way.
    pub slots: Vec<Slot>,
    /// Steps of the optimisers.
    optimiser_steps: [i32; 3],
    /// Where the next transition goes.
    replay_next: usize,
}

impl State {
    /// The state of a training at rest between two rounds.
    #[expect(clippy::too_many_arguments, reason = "it is what there is")]
    pub fn new(
        log: RlLog,
        episodes: usize,
        steps: u64,
        updates: u64,
        rounds: u64,
        strata: Strata,
        slots: Vec<Slot>,
        scale: InputScale,
    ) -> Self {
        Self {
            format_version: VERSION,
            log,
            episodes,
            steps,
            updates,
            rounds,
            scale,
            strata,
            slots,
            optimiser_steps: [0; 3],
            replay_next: 0,
        }
    }
}

const OPTIMISERS: [&str; 3] = ["actor", "critics", "temperature"];
const NETWORKS: [(&str, Role); 6] = [
    ("actor", Role::Actor),
    ("average", Role::Actor),
    ("critic0", Role::Critic),
    ("critic1", Role::Critic),
    ("target0", Role::Critic),
    ("target1", Role::Critic),
];

/// Writes a checkpoint; it appears whole or not at all.
pub fn write(
    path: &Path,
    mut state: State,
    agent: &mut Sac,
    replay: &Replay,
) -> Result<(), crate::lab::training::TrainingError> {
    let mut tensors = Vec::new();
    let parts = agent.parts();
    let networks = [
        &parts.actor,
        &parts.average,
        &parts.critics[0],
        &parts.critics[1],
        &parts.targets[0],
        &parts.targets[1],
    ];
    for ((prefix, role), network) in NETWORKS.into_iter().zip(networks) {
        let shapes = role.shapes();
        for (name, values) in network.values()? {
            let shape = shapes[&name].clone();
            tensors.push(NamedTensor::f32(format!("{prefix}.{name}"), shape, &values));
        }
    }
    let temperature = parts.log_temperature.to_vec1()?;
    tensors.push(NamedTensor::f32("log_temperature".to_owned(), vec![1], &temperature));
    for (i, (name, optimiser)) in OPTIMISERS.into_iter().zip(agent.optimisers()).enumerate() {
        let (steps, moments) = optimiser.state();
        state.optimiser_steps[i] = steps;
        tensors.push(NamedTensor::f32(format!("optimiser.{name}"), vec![moments.len()], &moments));
    }
    let (bytes, next) = replay.state();
    state.replay_next = next;
    tensors.push(NamedTensor::u8("replay".to_owned(), bytes.to_vec()));
    let header = serde_json::to_string(&state).expect("a state is plain data");
    Ok(artefact::write(path, &tensor_file::encode(&header, tensors))?)
}

/// Reads a checkpoint: the state, the agent and its memory.
pub fn read(path: &Path, device: &Device) -> Result<(State, Sac, Replay), ArtefactError> {
    let bytes = artefact::read_file(path)?;
    decode(&bytes, device).map_err(|fault| fault.of(path))
}

fn decode(bytes: &[u8], device: &Device) -> Result<(State, Sac, Replay), Fault> {
    let (json, tensors) = tensor_file::decode(bytes, VERSION)?;
    let damaged = |e: String| Fault::Header(e);
    let candle = |e: candle_core::Error| Fault::Header(e.to_string());
    let state: State = serde_json::from_str(&json).map_err(|e| damaged(e.to_string()))?;
    state.scale.validate().map_err(damaged)?;
    let config = &state.log.config;
    config.validate().map_err(|e| damaged(e.to_string()))?;
    let log = &state.log;
    let fits = state.slots.len() == config.environments
        && state.slots.iter().all(|s| s.stratum < Stratum::COUNT && s.index < u64::MAX)
        && state.strata.is_sound()
        && log.best < log.points.len();
    if !fits {
        return Err(damaged("the state contradicts its settings".to_owned()));
    }
    let network = |(prefix, role): (&str, Role)| {
        let mut values = BTreeMap::new();
        for (name, shape) in role.shapes() {
            let read = tensor_file::f32s(&tensors, &format!("{prefix}.{name}"), &shape)?;
            values.insert(name, read);
        }
        Parameters::from_values(role, values, device).map_err(candle)
    };
    let log_temperature = tensor_file::f32s(&tensors, "log_temperature", &[1])?;
    let parts = Parts {
        actor: network(NETWORKS[0])?,
        average: network(NETWORKS[1])?,
        critics: [network(NETWORKS[2])?, network(NETWORKS[3])?],
        targets: [network(NETWORKS[4])?, network(NETWORKS[5])?],
        log_temperature: Var::new(log_temperature.as_slice(), device).map_err(candle)?,
    };
    let mut agent =
        Sac::from_parts(config.sac, state.scale.clone(), parts, device).map_err(candle)?;
    let optimisers = OPTIMISERS.into_iter().zip(agent.optimisers()).zip(state.optimiser_steps);
    for ((name, optimiser), steps) in optimisers {
        let name = format!("optimiser.{name}");
        let count = optimiser.state().1.len();
        let moments = tensor_file::f32s(&tensors, &name, &[count])?;
        optimiser.restore((steps, &moments)).ok_or_else(|| damaged(name))?;
    }
    let replay = tensors.tensor("replay").map_err(|e| damaged(e.to_string()))?.data().to_vec();
    let replay = Replay::restored(config.replay, replay, state.replay_next)
        .filter(|r| !r.is_empty())
        .ok_or_else(|| damaged("the replay memory is of another size".to_owned()))?;
    Ok((state, agent, replay))
}
