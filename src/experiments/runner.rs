//! Running an experiment: collect → train → evaluate → report.
//!
//! The results' folder:
//!
//! | file | holds |
//! |---|---|
//! | `config.toml`, `run.json` | every setting spelt out; the build; written first |
//! | `dataset/` | the samples |
//! | `models/` | `knn.bin`, `mlp-TYPE.safetensors`, their cards and logs |
//! | `rows.csv`, `rows.parquet`, `report.md`, `report.html` | the evaluation |
//! | `traces.jsonl` | its paths, for the report |
//! | `stages/` | which stage was begun or finished, from which settings |
//!
//! A finished stage is skipped when its settings, and those of the stages it builds on, are
//! the same; a stage that was interrupted goes on where it stopped, unless its settings or
//! the build changed: then it begins anew.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::config::ExperimentConfig;
use crate::dataset::schema::GIT_REVISION;
use crate::dataset::{CollectError, CollectOptions, Dataset, DatasetError, collect};
use crate::evaluation::report::Provenance;
use crate::evaluation::rows::{Row, RowsError, read_csv};
use crate::evaluation::suite;
use crate::evaluation::{
    MethodSettings, Models, ModelsError, OutputError, Outputs, SuiteConfig, SuiteError,
};
use crate::files::{reason, remove_leftovers, sha256_hex, write_whole};
use crate::progress;
use crate::training::{self, TrainingError};
use crate::world::ParkingType;

/// An experiment that did not finish.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// A file of the results cannot be written or read.
    #[error("{path}: {}; choose a folder you can write to", reason(error))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: std::io::Error,
    },
    /// The collection failed.
    #[error("collect: {0}")]
    Collect(#[from] CollectError),
    /// The data set cannot be read back.
    #[error("train: {0}")]
    Dataset(#[from] DatasetError),
    /// A training failed.
    #[error("train: {0}")]
    Training(#[from] TrainingError),
    /// A model cannot be loaded back.
    #[error("evaluate: {0}")]
    Models(#[from] ModelsError),
    /// The evaluation cannot run.
    #[error("evaluate: {0}")]
    Suite(#[from] SuiteError),
    /// Rows or report cannot be written.
    #[error("evaluate: {0}")]
    Output(#[from] OutputError),
    /// Rows cannot be read.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// The worker threads could not be started.
    #[error("collect: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl ExperimentError {
    /// Whether the caller's input is at fault, not the disk or this crate.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Io { .. } | Self::Suite(_) => true,
            Self::Collect(e) => e.is_bad_input(),
            Self::Training(e) => e.is_bad_input(),
            _ => false,
        }
    }
}

/// A run of an experiment into a folder.
struct Runner<'a> {
    config: &'a ExperimentConfig,
    out: &'a Path,
}

/// The record of a stage, `stages/NAME.json`.
#[derive(PartialEq, Serialize, Deserialize)]
struct Stage {
    /// Over everything that decides the stage's output, builds aside.
    settings_sha256: String,
    /// The build that began it.
    git_revision: String,
    finished: bool,
}

/// What to do with a stage.
#[derive(PartialEq)]
enum Todo {
    Nothing,
    GoOn,
    BeginAnew,
}

/// Runs `config` into the folder `out`, going on with what an earlier run left there.
/// Returns the rows. Progress and what is skipped go to stderr.
pub fn run(config: &ExperimentConfig, out: &Path) -> Result<Vec<Row>, ExperimentError> {
    let runner = Runner { config, out };
    runner.prepare()?;
    if config.learns() {
        runner.collect()?;
        runner.train()?;
    }
    runner.evaluate()
}

/// The differences between the rows of two runs, times aside; one line each.
pub fn differences(expected: &[Row], found: &[Row]) -> Vec<String> {
    let mut lines = Vec::new();
    let name = |row: &Row| format!("{} by {}", row.scene, row.method);
    for row in expected {
        let Some(other) = found.iter().find(|r| r.key() == row.key()) else {
            lines.push(format!("{}: missing in the new run", name(row)));
            continue;
        };
        let columns = Row::COLUMNS.iter().zip(row.untimed().fields());
        for ((column, old), new) in columns.zip(other.untimed().fields()) {
            if old != new {
                lines.push(format!("{}: {column} was {old}, is {new}", name(row)));
            }
        }
    }
    let unknown = |row: &&Row| !expected.iter().any(|r| r.key() == row.key());
    lines.extend(found.iter().filter(unknown).map(|r| format!("{}: only in the new run", name(r))));
    lines
}

impl Runner<'_> {
    fn path(&self, name: &str) -> PathBuf {
        self.out.join(name)
    }

    fn model(&self, name: &str) -> PathBuf {
        self.out.join("models").join(name)
    }

    fn mlp_model(&self, kind: ParkingType) -> PathBuf {
        self.model(&format!("mlp-{kind}.safetensors"))
    }

    /// Makes the folders and records what is about to happen.
    fn prepare(&self) -> Result<(), ExperimentError> {
        for path in [self.out.to_owned(), self.path("models"), self.path("stages")] {
            std::fs::create_dir_all(&path)
                .and_then(|()| remove_leftovers(&path))
                .map_err(|error| ExperimentError::Io { path, error })?;
        }
        self.write("config.toml", self.config.to_toml())?;
        let run = serde_json::json!({
            "crate_version": env!("CARGO_PKG_VERSION"),
            "git_revision": GIT_REVISION,
            "seed": self.config.seed,
            "scene_seed": self.config.evaluate.seed,
        });
        self.write("run.json", format!("{run:#}\n"))
    }

    fn write(&self, name: &str, text: String) -> Result<(), ExperimentError> {
        let path = self.path(name);
        write_whole(&path, text.as_bytes()).map_err(|error| ExperimentError::Io { path, error })
    }

    /// Settings of the data set; every later stage's contain them.
    fn collect_settings(&self) -> String {
        let c = self.config;
        settings(("collect", env!("CARGO_PKG_VERSION"), &c.collect, &c.evaluate.types))
    }

    /// Compares a stage's record with `settings`, and records that it begins.
    fn begin(&self, stage: &str, settings: &str) -> Result<Todo, ExperimentError> {
        let record = std::fs::read(self.path(&format!("stages/{stage}.json")))
            .ok()
            .and_then(|bytes| serde_json::from_slice::<Stage>(&bytes).ok())
            .filter(|s| s.settings_sha256 == settings);
        let todo = match record {
            Some(s) if s.finished => Todo::Nothing,
            Some(s) if s.git_revision == GIT_REVISION => Todo::GoOn,
            _ => Todo::BeginAnew,
        };
        match todo {
            Todo::Nothing => tracing::info!("{stage}: finished before, nothing to do"),
            _ => self.record(stage, settings, false)?,
        }
        Ok(todo)
    }

    fn record(&self, stage: &str, settings: &str, finished: bool) -> Result<(), ExperimentError> {
        let (settings_sha256, git_revision) = (settings.to_owned(), GIT_REVISION.to_owned());
        let record = Stage { settings_sha256, git_revision, finished };
        let json = serde_json::to_string_pretty(&record).expect("plain data");
        self.write(&format!("stages/{stage}.json"), json + "\n")
    }

    fn collect(&self) -> Result<(), ExperimentError> {
        let settings = self.collect_settings();
        let folder = self.path("dataset");
        match self.begin("collect", &settings)? {
            Todo::Nothing if folder.exists() => return Ok(()),
            Todo::GoOn => {}
            _ => remove(&folder)?,
        }
        // An explicit number: training keeps rayon's own pool to one thread.
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let options = CollectOptions { resume: true, ..CollectOptions::default() };
        let (config, kinds) = (&self.config.collect, &self.config.evaluate.types);
        let bar = progress::bar(0, "collect");
        let reports = pool.install(|| collect(config, &folder, kinds, options, &bar))?;
        bar.finish_and_clear();
        for r in &reports {
            tracing::info!("collect: {}: {} of {} samples solved", r.kind, r.solved, r.rows);
        }
        self.record("collect", &settings, true)
    }

    fn train(&self) -> Result<(), ExperimentError> {
        let data = self.collect_settings();
        let kinds = &self.config.evaluate.types;
        let mut read = None;
        let knn = self.model("knn.bin");
        let knn_settings = settings(("knn", &data));
        if self.begin("train-knn", &knn_settings)? != Todo::Nothing || !knn.exists() {
            let set = self.dataset(&mut read)?;
            training::knn::train(&set.metadata, &set.samples, kinds, &knn)?;
            self.record("train-knn", &knn_settings, true)?;
        }
        if !self.config.needs_mlp() {
            return Ok(());
        }
        for &kind in kinds {
            let (stage, out) = (format!("train-mlp-{kind}"), self.mlp_model(kind));
            let mlp = &self.config.train.mlp;
            let mlp_settings = settings((&stage, &data, mlp));
            if self.begin(&stage, &mlp_settings)? == Todo::Nothing && out.exists() {
                continue;
            }
            let set = self.dataset(&mut read)?;
            let log = training::mlp::train(&set.metadata, &set.samples, kind, mlp, &out)?;
            tracing::info!(
                "{stage}: best of {} epochs is {}, median error {:.2} m on unseen cells",
                log.losses.len(),
                log.best_epoch,
                log.validation.position_median_m
            );
            self.record(&stage, &mlp_settings, true)?;
        }
        Ok(())
    }

    /// The data set, read at most once.
    fn dataset<'d>(&self, read: &'d mut Option<Dataset>) -> Result<&'d Dataset, ExperimentError> {
        if read.is_none() {
            *read = Some(Dataset::read(&self.path("dataset"), None)?);
        }
        Ok(read.as_ref().expect("just read"))
    }

    fn models(&self) -> Result<Models, ExperimentError> {
        let mut files = Vec::new();
        if self.config.learns() {
            files.push(self.model("knn.bin"));
        }
        if self.config.needs_mlp() {
            files.extend(self.config.evaluate.types.iter().map(|&kind| self.mlp_model(kind)));
        }
        Ok(Models::load(&files)?)
    }

    fn evaluate(&self) -> Result<Vec<Row>, ExperimentError> {
        let e = &self.config.evaluate;
        let trained = settings((self.collect_settings(), &self.config.train));
        let settings = settings(("evaluate", trained, &self.config.vehicle, e));
        let rows_csv = self.path("rows.csv");
        match self.begin("evaluate", &settings)? {
            Todo::Nothing if rows_csv.exists() => return Ok(read_csv(&rows_csv)?),
            Todo::GoOn => {}
            _ => remove(&rows_csv)?,
        }
        let models = self.models()?;
        let suite_config = SuiteConfig {
            methods: e.methods.clone(),
            settings: MethodSettings { planner: e.planner, n3p: e.n3p },
            max_expansions: e.max_expansions,
            threads: 1,
        };
        let vehicle = &self.config.vehicle;
        let cases = suite::generated(vehicle, &e.types, &e.levels, e.count, e.seed)?;
        suite::check(&cases, &models, &suite_config)?;
        let (mut outputs, mut rows) = Outputs::resume(self.out)?;
        let bar = progress::bar((cases.len() * e.methods.len()) as u64, "evaluate");
        bar.set_position(rows.len() as u64);
        let new = suite::run(&cases, &models, &suite_config, rows.len(), |case, episode| {
            bar.inc(1);
            outputs.take(case, episode, &models).map_err(ExperimentError::from)
        })?;
        bar.finish_and_clear();
        rows.extend(new);
        let scenes = format!(
            "{} generated, {} of each type and level, seed {}; data set and training seed {}",
            cases.len(),
            e.count,
            e.seed,
            self.config.seed
        );
        let provenance = Provenance::here(scenes, e.seed, e.max_expansions, 1);
        let title = format!("Experiment {}", self.config.name);
        outputs.finish(&title, &cases, &rows, &provenance)?;
        self.record("evaluate", &settings, true)?;
        Ok(rows)
    }
}

/// A checksum over settings.
fn settings(parts: impl Serialize) -> String {
    let json = serde_json::to_vec(&parts).expect("settings are plain values");
    sha256_hex(&[&json])
}

fn remove(path: &Path) -> Result<(), ExperimentError> {
    let result =
        if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    match result {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(ExperimentError::Io { path: path.to_owned(), error })
        }
        _ => Ok(()),
    }
}
