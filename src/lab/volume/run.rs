//! Runs shards, going on where an earlier run was stopped.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use serde::Serialize;

use super::draw::draw;
use super::merge::check_settings;
use super::record::{Failure, Outcome, Results, ShardRecord, Times};
use super::{Totals, VolumeConfig};
use crate::curves::reeds_shepp;
use crate::episode::{self, EpisodeConfig};
use crate::files::{reason, remove_leftovers, write_whole};
use crate::geometry::Pose;
use crate::lab::dataset::Part;
use crate::lab::dataset::schema::GIT_REVISION;
use crate::lab::evaluation::oracle;
use crate::lab::progress;
use crate::lab::shards::Unfinished;
use crate::n3p::{Method, MethodError, MethodSettings, Models, ModelsError};
use crate::output::PathFile;
use crate::planners::Planner;
use crate::vehicle::Vehicle;
use crate::world::Scene;

/// How a run goes about it; none of it changes what the records say.
#[derive(Clone, Debug)]
pub struct VolumeOptions {
    /// Which shards this process runs.
    pub part: Part,
    /// Worker threads.
    pub threads: usize,
    /// Where scenes and paths are written for others to check, a file of JSON lines for each shard.
    pub samples: Option<PathBuf>,
    /// Of so many scenes one is written there.
    pub sample_every: u64,
}

/// A run that did not finish.
#[derive(Debug, thiserror::Error)]
pub enum VolumeError {
    /// An output folder cannot be made.
    #[error("{path}: cannot be an output folder: {}; choose one you can write to", reason(error))]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
    /// A file cannot be read or written.
    #[error("{path}: {}", reason(error))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
    /// The folder holds records of something else.
    #[error("{path}: {what}; give --out a new folder")]
    Other {
        /// The folder.
        path: PathBuf,
        /// What differs.
        what: &'static str,
    },
    /// Shards to merge are not there, damaged or another's.
    #[error(transparent)]
    Unfinished(#[from] Unfinished),
    /// The models cannot be used.
    #[error(transparent)]
    Models(#[from] ModelsError),
    /// The planner cannot be built.
    #[error(transparent)]
    Method(#[from] MethodError),
}

impl VolumeError {
    /// Whether the caller's input is at fault.
    pub fn is_bad_input(&self) -> bool {
        matches!(
            self,
            Self::Folder { .. } | Self::Other { .. } | Self::Unfinished(_) | Self::Models(_)
        )
    }
}

pub(super) fn failed(path: &Path) -> impl FnOnce(io::Error) -> VolumeError + '_ {
    |error| VolumeError::Io { path: path.to_owned(), error }
}

/// Plans what is not finished of the shards of `options.part` into the folder `out`. Returns what all
/// records there say together.
pub fn run(
    config: &VolumeConfig,
    out: &Path,
    options: &VolumeOptions,
) -> Result<Totals, VolumeError> {
    for folder in [Some(out), options.samples.as_deref()].into_iter().flatten() {
        std::fs::create_dir_all(folder)
            .and_then(|()| remove_leftovers(folder))
            .map_err(|error| VolumeError::Folder { path: folder.to_owned(), error })?;
    }
    let settings = out.join("config.toml");
    if !check_settings(config, out)? {
        write_whole(&settings, config.to_toml().as_bytes()).map_err(failed(&settings))?;
    }
    let job = Job { config, out, options, models: Models::usual(&[Method::N3P], None)? };
    job.all()?;
    Totals::read(config, out)
}

struct Job<'a> {
    config: &'a VolumeConfig,
    out: &'a Path,
    options: &'a VolumeOptions,
    models: Models,
}

/// A line of the samples.
#[derive(Serialize)]
struct Sample<'a> {
    number: u64,
    scene: &'a Scene,
    path: &'a PathFile,
}

impl Job<'_> {
    fn all(&self) -> Result<(), VolumeError> {
        let shards = 0..self.config.shards();
        let mine = shards.filter(|&s| self.options.part.contains(s as usize));
        let todo: Vec<u64> = mine.filter(|&s| !self.is_finished(s)).collect();
        let bar = progress::bar(todo.len() as u64, "volume");
        let next = AtomicUsize::new(0);
        let first_error = Mutex::new(None);
        let work = || {
            let run = || -> Result<(), VolumeError> {
                let mut planners = Planners { job: self, of: Vec::new() };
                while let Some(&shard) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
                    self.shard(shard, &mut planners)?;
                    bar.inc(1);
                }
                Ok(())
            };
            if let Err(error) = run() {
                // The others end with the shards at hand.
                next.store(todo.len(), Ordering::Relaxed);
                first_error.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(error);
            }
        };
        std::thread::scope(|scope| {
            (0..self.options.threads.max(1)).for_each(|_| drop(scope.spawn(work)));
        });
        bar.finish_and_clear();
        first_error.into_inner().unwrap_or_else(|e| e.into_inner()).map_or(Ok(()), Err)
    }

    fn planner(&self) -> Result<Box<dyn Planner + Send>, VolumeError> {
        Ok(Method::N3P.build(&self.models, &MethodSettings::default())?)
    }

    fn is_finished(&self, shard: u64) -> bool {
        let sampled = self.samples_path(shard).is_none_or(|path| path.exists());
        let ours = |r: ShardRecord| r.config_sha256 == self.config.sha256() && is_this_build(&r);
        sampled && ShardRecord::read(self.out, shard).is_some_and(ours)
    }

    fn samples_path(&self, shard: u64) -> Option<PathBuf> {
        let folder = self.options.samples.as_ref()?;
        Some(folder.join(format!("shard-{shard:06}.jsonl")))
    }

    fn shard(&self, shard: u64, planners: &mut Planners) -> Result<(), VolumeError> {
        let begun = Instant::now();
        let (mut results, mut times) = (Results::default(), Times::default());
        let mut samples = String::new();
        let first = shard * self.config.scenes_per_shard;
        for number in first..self.config.count.min(first + self.config.scenes_per_shard) {
            let sampled = self.options.samples.is_some() && number % self.options.sample_every == 0;
            self.scene(
                number,
                planners,
                &mut results,
                &mut times,
                sampled.then_some(&mut samples),
            )?;
        }
        if let Some(path) = self.samples_path(shard) {
            write_whole(&path, samples.as_bytes()).map_err(failed(&path))?;
        }
        times.seconds = begun.elapsed().as_secs_f64();
        let record = ShardRecord {
            config_sha256: self.config.sha256(),
            crate_version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: GIT_REVISION.to_owned(),
            shard,
            results,
            times,
        };
        record.write(self.out).map_err(failed(&ShardRecord::path(self.out, shard)))
    }

    /// Plans one scene. What panics is counted, and planned on with a planner of its own.
    fn scene(
        &self,
        number: u64,
        planners: &mut Planners,
        results: &mut Results,
        times: &mut Times,
        samples: Option<&mut String>,
    ) -> Result<(), VolumeError> {
        let case = draw(self.config, number);
        let once = EpisodeConfig { repeats: 0, ..EpisodeConfig::new(self.config.budget()) };
        let planner = planners.of(&case.scene.vehicle)?;
        let plan = || episode::run(&case, planner, &once, &oracle::JUDGE);
        let failure = |what, reason| Failure { number, what, reason };
        match catch_unwind(AssertUnwindSafe(plan)) {
            Ok(Ok(episode)) => {
                times.push(number, episode.row.plan_time_s);
                results.push(number, &episode.row, shortest(&case.scene));
                if let (Some(samples), Some(path)) = (samples, &episode.path) {
                    let sample = Sample { number, scene: &case.scene, path };
                    samples.push_str(&serde_json::to_string(&sample).expect("plain data"));
                    samples.push('\n');
                }
            }
            Ok(Err(error)) => {
                results.fail(&case.set, failure(Outcome::NoProblem, error.to_string()));
            }
            Err(panic) => {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
                let text = text.unwrap_or("a panic without words").to_owned();
                results.fail(&case.set, failure(Outcome::Panicked, text));
                planners.of.clear();
            }
        }
        Ok(())
    }
}

/// A planner for each vehicle: what one makes ready for its vehicle is not made anew at every turn.
struct Planners<'a> {
    job: &'a Job<'a>,
    of: Vec<(Vehicle, Box<dyn Planner + Send>)>,
}

impl Planners<'_> {
    fn of(&mut self, vehicle: &Vehicle) -> Result<&mut dyn Planner, VolumeError> {
        let known = self.of.iter().position(|(v, _)| v == vehicle);
        let at = match known {
            Some(at) => at,
            None => {
                self.of.push((*vehicle, self.job.planner()?));
                self.of.len() - 1
            }
        };
        Ok(self.of[at].1.as_mut())
    }
}

/// Whether a record is of this build.
pub(super) fn is_this_build(record: &ShardRecord) -> bool {
    record.crate_version == env!("CARGO_PKG_VERSION") && record.git_revision == GIT_REVISION
}

/// Length of the shortest curve from start to goal through empty space, metres.
fn shortest(scene: &Scene) -> f64 {
    let Scene { start, goal, .. } = scene;
    let here = Pose::new(0.0, 0.0, start.heading);
    let there = Pose::new(goal.x - start.x, goal.y - start.y, goal.heading);
    reeds_shepp::shortest_length(here, there, scene.vehicle.turning_radius())
}
