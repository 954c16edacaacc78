//! The loop: drive, remember, learn, validate.

use std::path::Path;

use candle_core::Device;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::checkpoint::{self, Slot, State, checkpoint_path};
use super::log::{Point, RlLog, Validation};
use super::strata::Strata;
use super::{RlConfig, card, curve};
use crate::environment::courses::{Course, Stratum};
use crate::environment::parking_env::{End, ParkingEnv};
use crate::environment::{Action, Observation};
use crate::lab::progress;
use crate::lab::rl::Policy;
use crate::lab::rl::actor::{Actor, ActorPolicy, normal, random_action};
use crate::lab::rl::encoding::InputScale;
use crate::lab::rl::network::ACTION;
use crate::lab::rl::policy_file::{self, PolicyHeader};
use crate::lab::rl::replay::{Replay, Transition};
use crate::lab::rl::sac::{Losses, Sac};
use crate::lab::training::watch::Watch;
use crate::lab::training::{TrainingError, write_beside};
use crate::n3p::Choice;
use crate::rng::{Stream, rng};
use crate::selectors::artefact;

/// Whether a training begins or goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begin {
    /// Anew; a checkpoint in the way is an error.
    Anew,
    /// From the checkpoint, or anew where there is none.
    Resume,
}

/// Trains a policy and writes it to `out`, with its log, its model card and the curve
/// (`.training.svg`) beside it.
#[allow(clippy::missing_panics_doc, reason = "a report adds a point")]
pub fn train(
    course: Course,
    config: &RlConfig,
    out: &Path,
    begin: Begin,
    device: &Device,
) -> Result<RlLog, TrainingError> {
    config.validate()?;
    let path = checkpoint_path(out);
    let mut trainer = match (begin, path.exists()) {
        (Begin::Anew, true) => return Err(TrainingError::CheckpointInTheWay(path)),
        (Begin::Resume, true) if !out.exists() => {
            return Err(TrainingError::PolicyGone(out.to_owned()));
        }
        (Begin::Resume, true) => Trainer::resumed(course, config, &path, device)?,
        (_, false) => Trainer::new(course, config, device),
    };
    let mut watch = Watch::begin(out, trainer.episodes > 0)?;
    let bar = progress::bar(config.episodes as u64, course.name());
    while trainer.episodes < config.episodes {
        bar.set_position(trainer.episodes as u64);
        trainer.round()?;
        trainer.learn()?;
        if trainer.is_due() {
            trainer.report(out)?;
            let point = trainer.log.points.last().expect("a report adds a point");
            watch.tell(point)?;
            let problems = trainer.validation_problems() as f64;
            let validated = f64::from(point.validated().total()) / problems;
            let line = format!(
                "{} episodes, {} steps: {:.0} % parked, {:.1} % of the validation problems, \
                 α {:.3}, entropy {:.2}",
                point.episodes,
                point.steps,
                100.0 * point.success(),
                100.0 * validated,
                point.losses.temperature,
                point.losses.entropy,
            );
            bar.set_message(line.clone());
            log::info!("{line}");
        }
    }
    bar.finish_and_clear();
    if trainer.log.points.last().is_none_or(|p| p.episodes < trainer.episodes) {
        trainer.report(out)?;
        watch.tell(trainer.log.points.last().expect("a report adds a point"))?;
    }
    write_beside(out, &trainer.log, card::card(out, &trainer.log))?;
    let picture = curve::svg(&trainer.log)?;
    artefact::write(&out.with_extension("training.svg"), picture.as_bytes())?;
    Ok(trainer.log)
}

/// A training under way.
struct Trainer {
    device: Device,
    log: RlLog,
    envs: Vec<ParkingEnv>,
    /// Stratum, problem and return so far of each environment's episode.
    running: Vec<Running>,
    strata: Strata,
    replay: Replay,
    /// `None` until the warm-up has shown how inputs are scaled.
    agent: Option<Sac>,
    episodes: usize,
    begun: u64,
    steps: u64,
    updates: u64,
    rounds: u64,
    window: Window,
    losses: Losses,
}

#[derive(Clone, Copy, Debug)]
struct Running {
    stratum: usize,
    index: u64,
    total: f64,
}

/// What episodes since the last point came to.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    parked: [[u32; 2]; Stratum::COUNT],
    total: f64,
    steps: u64,
}

impl Trainer {
    fn new(course: Course, config: &RlConfig, device: &Device) -> Self {
        let log = RlLog { course, config: config.clone(), points: Vec::new(), best: 0 };
        let mut trainer = Self {
            device: device.clone(),
            log,
            envs: Vec::new(),
            running: Vec::new(),
            strata: Strata::default(),
            replay: Replay::new(config.replay),
            agent: None,
            episodes: 0,
            begun: 0,
            steps: 0,
            updates: 0,
            rounds: 0,
            window: Window::default(),
            losses: Losses::default(),
        };
        for _ in 0..config.environments {
            let running = trainer.next_episode();
            let problem = trainer.problem(&running);
            trainer.envs.push(ParkingEnv::new(problem, config.env));
            trainer.running.push(running);
        }
        trainer
    }

    fn resumed(
        course: Course,
        config: &RlConfig,
        path: &Path,
        device: &Device,
    ) -> Result<Self, TrainingError> {
        let (state, agent, replay) =
            checkpoint::read(path, device).map_err(TrainingError::Checkpoint)?;
        // More episodes only make it longer (and leave a point of the curve where it had ended).
        let same = RlConfig { episodes: config.episodes, ..state.log.config.clone() };
        if same != *config || state.log.course != course {
            return Err(TrainingError::OtherCheckpoint(path.to_owned()));
        }
        let mut trainer = Self {
            agent: Some(agent),
            replay,
            strata: state.strata,
            episodes: state.episodes,
            begun: state.slots.iter().map(|s| s.index + 1).max().unwrap_or(0),
            steps: state.steps,
            updates: state.updates,
            rounds: state.rounds,
            losses: state.log.points.last().map(|p| p.losses).unwrap_or_default(),
            log: RlLog { config: config.clone(), ..state.log },
            envs: Vec::new(),
            running: Vec::new(),
            device: device.clone(),
            window: Window::default(),
        };
        for Slot { stratum, index, total, progress } in state.slots {
            let running = Running { stratum, index, total };
            let mut env = ParkingEnv::new(trainer.problem(&running), config.env);
            env.resume(progress);
            trainer.envs.push(env);
            trainer.running.push(running);
        }
        Ok(trainer)
    }

    fn config(&self) -> &RlConfig {
        &self.log.config
    }

    fn next_episode(&mut self) -> Running {
        let stratum = self.strata.pick(self.config().seed);
        self.begun += 1;
        Running { stratum, index: self.begun - 1, total: 0.0 }
    }

    fn problem(&self, running: &Running) -> crate::planners::Problem {
        let config = self.config();
        let stratum = Stratum::nth(running.stratum);
        self.log.course.problem(&config.vehicle, stratum, config.seed, running.index)
    }

    /// One step of every environment.
    fn round(&mut self) -> Result<(), TrainingError> {
        let seen: Vec<Observation> = self.envs.iter().map(ParkingEnv::observe).collect();
        let mut rng = rng(self.config().seed, Stream::Policy, self.rounds);
        let actions = self.actions(&seen, &mut rng)?;
        self.rounds += 1;
        for (i, (before, action)) in seen.into_iter().zip(actions).enumerate() {
            let step = self.envs[i].step(action);
            self.steps += 1;
            self.replay.push(&Transition {
                before,
                action: step.action,
                reward: step.reward as f32,
                goes_on: matches!(step.end, None | Some(End::OutOfTime)),
                after: self.envs[i].observe(),
            });
            self.running[i].total += step.reward;
            if let Some(end) = step.end {
                self.finish(i, end);
            }
        }
        Ok(())
    }

    /// What each environment is to do: at random while warming up or where the last step did not
    /// move the car.
    fn actions(
        &self,
        seen: &[Observation],
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<Action>, TrainingError> {
        let mut actions: Vec<Action> = seen.iter().map(|_| random_action(rng)).collect();
        if let Some(agent) = &self.agent {
            let noise = normal(rng, seen.len() * ACTION);
            let chosen = agent.act(seen, Some(&noise))?;
            for ((action, [steer, speed]), env) in actions.iter_mut().zip(chosen).zip(&self.envs) {
                if env.progress().moved {
                    *action = Action { steer: steer.into(), speed: speed.into() };
                }
            }
        }
        Ok(actions)
    }

    /// Counts the episode of environment `i`, and begins the next one there.
    fn finish(&mut self, i: usize, end: End) {
        let Running { stratum, total, .. } = self.running[i];
        let parked = end == End::Parked;
        self.strata.record(stratum, parked);
        self.episodes += 1;
        self.window.parked[stratum][0] += u32::from(parked);
        self.window.parked[stratum][1] += 1;
        self.window.total += total;
        self.window.steps += u64::from(self.envs[i].progress().step);
        self.running[i] = self.next_episode();
        let problem = self.problem(&self.running[i]);
        self.envs[i].enter(problem);
    }

    /// The updates that the steps so far ask for.
    fn learn(&mut self) -> Result<(), TrainingError> {
        let (warm_up, per_update) =
            (self.config().warm_up as u64, self.config().steps_per_update as u64);
        if self.steps < warm_up {
            return Ok(());
        }
        let (config, seed) = (self.config().sac, self.config().seed);
        let agent = match &mut self.agent {
            Some(agent) => agent,
            None => {
                let seen: Vec<_> =
                    (0..self.replay.len()).map(|i| self.replay.get(i).before).collect();
                let scale = InputScale::fit(&seen);
                self.agent.insert(Sac::new(config, scale, seed, &self.device)?)
            }
        };
        while self.updates < (self.steps - warm_up) / per_update {
            let mut rng = rng(seed, Stream::Replay, self.updates);
            let draw = |_| self.replay.get(rng.random_range(0..self.replay.len()));
            let batch: Vec<Transition> = (0..config.batch).map(draw).collect();
            let noise = normal(&mut rng, 2 * config.batch * ACTION);
            self.losses = agent.update(&batch, &noise)?;
            self.updates += 1;
            let Losses { critic, actor, .. } = self.losses;
            if !(critic.is_finite() && actor.is_finite()) {
                return Err(TrainingError::Diverged { epoch: self.episodes, loss: critic });
            }
        }
        Ok(())
    }

    /// Whether the next point of the curve is due.
    fn is_due(&self) -> bool {
        let every = self.config().report_every;
        let last = self.log.points.last().map_or(0, |p| p.episodes);
        self.agent.is_some() && self.episodes / every > last / every
    }

    fn validation_problems(&self) -> usize {
        Stratum::COUNT * self.config().validation_count
    }

    /// Adds a point, stores the policy if it is the best, and leaves a checkpoint.
    fn report(&mut self, out: &Path) -> Result<(), TrainingError> {
        let Some(agent) = &self.agent else { return Err(TrainingError::OnlyWarmUp) };
        let actor = Actor::new(&agent.parts().average, agent.scale.clone());
        let Window { parked, total, steps } = std::mem::take(&mut self.window);
        let finished = f64::from(parked.iter().map(|p| p[1]).sum::<u32>().max(1));
        let point = Point {
            episodes: self.episodes,
            steps: self.steps,
            updates: self.updates,
            parked,
            mean_return: total / finished,
            mean_steps: steps as f64 / finished,
            losses: self.losses,
            sampled: self.validate(&actor, Choice::Sampled),
            mean: self.validate(&actor, Choice::Mean),
        };
        let best = self.log.points.get(self.log.best);
        let is_best = best.is_none_or(|best| point.is_better_than(best));
        self.log.points.push(point);
        if is_best {
            self.log.best = self.log.points.len() - 1;
            let weights = agent.parts().average.values()?;
            artefact::write(out, &policy_file::encode(&self.header(agent), &weights))?;
        }
        write_beside(out, &self.log, card::card(out, &self.log))?;
        self.checkpoint(out)
    }

    fn header(&self, agent: &Sac) -> PolicyHeader {
        let config = self.config();
        PolicyHeader {
            format_version: policy_file::VERSION,
            course: self.log.course,
            vehicle: config.vehicle,
            scale: agent.scale.clone(),
            episodes: self.episodes,
            seed: config.seed,
            training: serde_json::to_value(config).expect("settings are plain data"),
            crate_version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    fn checkpoint(&mut self, out: &Path) -> Result<(), TrainingError> {
        let slots = self.running.iter().zip(&self.envs).map(|(r, env)| Slot {
            stratum: r.stratum,
            index: r.index,
            total: r.total,
            progress: env.progress().clone(),
        });
        let slots = slots.collect();
        let Some(agent) = &mut self.agent else { return Ok(()) };
        let state = State::new(
            self.log.clone(),
            self.episodes,
            self.steps,
            self.updates,
            self.rounds,
            self.strata.clone(),
            slots,
            agent.scale.clone(),
        );
        checkpoint::write(&checkpoint_path(out), state, agent, &self.replay)
    }

    /// Drives the validation problems.
    fn validate(&self, actor: &Actor, choice: Choice) -> Validation {
        let config = self.config();
        let (mut parked, mut steps) = ([0; Stratum::COUNT], 0);
        for (s, parked) in parked.iter_mut().enumerate() {
            for i in 0..config.validation_count as u64 {
                let seed = config.validation_seed;
                let stratum = Stratum::nth(s);
                let problem = self.log.course.problem(&config.vehicle, stratum, seed, i);
                let mut env = ParkingEnv::new(problem, config.env);
                let mut policy = ActorPolicy::new(actor.clone(), choice);
                let mut rng = rng(seed, Stream::Policy, (s as u64) << 32 | i);
                *parked += u32::from(drive(&mut env, &mut policy, &mut rng) == End::Parked);
                steps += env.progress().step;
            }
        }
        let problems = self.validation_problems() as f64;
        Validation { parked, mean_steps: f64::from(steps) / problems }
    }
}

/// Drives one episode to its end.
fn drive(env: &mut ParkingEnv, policy: &mut ActorPolicy, rng: &mut ChaCha8Rng) -> End {
    loop {
        let action = if env.is_scripted() {
            Action::default()
        } else {
            policy.act(&env.observe(), rng).expect("a trained actor always answers")
        };
        if let Some(end) = env.step(action).end {
            return end;
        }
    }
}
