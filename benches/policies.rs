//! How many steps a second does the parking environment drive, what does an action cost, and an
//! update?
//!
//! `environment/eval`: eight environments side by side, random actions within the mask,
//! observation included; `elem/s` are steps per second. `action`: the shipped actor on one
//! observation. `update`: one step of soft actor-critic with the default batch.

mod common;

use std::path::Path;

use candle_core::Device;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use n3p::environment::courses::{Course, Stratum};
use n3p::environment::motion::{action, admitted};
use n3p::environment::parking_env::{EnvConfig, ParkingEnv};
use n3p::environment::{MASK, Observation};
use n3p::lab::rl::Policy;
use n3p::lab::rl::actor::{ActorPolicy, normal};
use n3p::lab::rl::encoding::InputScale;
use n3p::lab::rl::network::ACTION;
use n3p::lab::rl::policy_file;
use n3p::lab::rl::replay::Transition;
use n3p::lab::rl::sac::{Sac, SacConfig};
use n3p::n3p::Choice;
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use rand::RngExt;

const ENVIRONMENTS: u64 = 8;

/// Environments that begin anew where an episode ends.
struct Side {
    course: Course,
    envs: Vec<ParkingEnv>,
    begun: u64,
}

impl Side {
    fn new(course: Course) -> Self {
        let mut side = Self { course, envs: Vec::new(), begun: 0 };
        for _ in 0..ENVIRONMENTS {
            let problem = side.next();
            side.envs.push(ParkingEnv::new(problem, EnvConfig::default()));
        }
        side
    }

    fn next(&mut self) -> n3p::planners::Problem {
        self.begun += 1;
        let stratum = Stratum::nth(self.begun as usize % Stratum::COUNT);
        self.course.problem(&Vehicle::default(), stratum, common::SEED, self.begun)
    }

    /// One step of each; what they taught.
    fn round(&mut self, rng: &mut rand_chacha::ChaCha8Rng) -> Vec<Transition> {
        let mut taught = Vec::new();
        for i in 0..self.envs.len() {
            let before: Observation = self.envs[i].observe();
            let step = self.envs[i].step(admitted(action(rng.random_range(0..MASK)), &before.mask));
            let (action, reward) = (step.action, step.reward as f32);
            let goes_on = step.end.is_none();
            let after = before;
            taught.push(Transition { before, action, reward, goes_on, after });
            if !goes_on {
                let problem = self.next();
                self.envs[i].enter(problem);
            }
        }
        taught
    }
}

fn bench(c: &mut Criterion) {
    // As every program does that drives or trains policies.
    // SAFETY: the only benchmark of this program, and criterion has started no thread.
    unsafe { n3p::lab::training::single_threaded() };
    let mut rng = rng(common::SEED, Stream::Policy, 0);
    let mut group = c.benchmark_group("environment");
    group.throughput(Throughput::Elements(ENVIRONMENTS));
    for course in [Course::Simple, Course::Eval] {
        let mut side = Side::new(course);
        group.bench_function(course.name(), |b| b.iter(|| side.round(&mut rng)));
    }
    group.finish();

    let mut side = Side::new(Course::Eval);
    let rounds = (0..100).flat_map(|_| side.round(&mut rng));
    let transitions: Vec<Transition> = rounds.collect();
    let seen: Vec<Observation> = transitions.iter().map(|t| t.before).collect();
    let file = Path::new("models/rl-eval.safetensors");
    let (_, actor) = policy_file::load(file).expect("the policies of the repository load");
    let mut policy = ActorPolicy::new(actor.clone(), Choice::Mean);
    let mut turn = 0;
    c.bench_function("action", |b| {
        b.iter(|| {
            turn = (turn + 1) % seen.len();
            policy.act(&seen[turn], &mut rng)
        });
    });

    let config = SacConfig::default();
    let scale = InputScale::fit(&seen);
    let mut agent = Sac::new(config, scale, common::SEED, &Device::Cpu).expect("weights are made");
    let noise = normal(&mut rng, 2 * config.batch * ACTION);
    c.bench_function("update", |b| b.iter(|| agent.update(&transitions[..config.batch], &noise)));
}

criterion_group! { name = benches; config = common::slow(); targets = bench }
criterion_main!(benches);
