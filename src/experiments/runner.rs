//! Running an experiment: collect → train → evaluate → report.
//!
//! The results' folder:
//!
//! | file | holds |
//! |---|---|
//! | `config.toml`, `run.json` | every setting spelt out; the build; written first |
//! | `dataset/` | the samples |
//! | `models/` | `knn.bin`, `mlp-TYPE.safetensors`, their cards and logs |
//! | `learning-curve/` | points and models of each part of the data, where a curve is asked for |
//! | `rows.csv`, `rows.parquet`, `report.md`, `report.html` | the evaluation |
//! | `traces.jsonl` | its paths, for the report |
//! | `stages/` | which stage was begun or finished, from which settings |
//!
//! A finished stage is skipped when its settings, and those of the stages it builds on, are
//! the same; a stage that was interrupted goes on where it stopped, unless its settings or
//! the build changed: then it begins anew.

use std::path::{Path, PathBuf};

use super::config::ExperimentConfig;
use super::learning_curve;
use super::stages::{Failure, Stages, Todo, settings};
use crate::dataset::manifest::manifest_path;
use crate::dataset::read::read_metadata;
use crate::dataset::schema::GIT_REVISION;
use crate::dataset::{CollectError, CollectOptions, Dataset, DatasetError, collect};
use crate::evaluation::report::Provenance;
use crate::evaluation::rows::{Row, RowsError, read_csv};
use crate::evaluation::suite;
use crate::evaluation::{
    CurvePoint, MethodSettings, Models, ModelsError, OutputError, Outputs, SuiteConfig, SuiteError,
};
use crate::files::{reason, remove_leftovers, sha256_hex, write_whole};
use crate::progress;
use crate::selectors::artefact::ArtefactError;
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
    /// The data set given cannot be used.
    #[error("--data: {0}")]
    GivenData(DatasetError),
    /// The data set given is not the one that the experiment describes.
    #[error(
        "--data {path}: {field} is {found}, but the experiment's is {wanted}; give the data set \
         collected with its settings, or none"
    )]
    OtherData {
        /// The folder.
        path: PathBuf,
        /// The setting.
        field: String,
        /// Its value in the data set.
        found: String,
        /// Its value in the experiment.
        wanted: String,
    },
    /// The models given cannot be used.
    #[error("--models: {0}")]
    GivenModels(ArtefactError),
    /// The worker threads could not be started.
    #[error("collect: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl ExperimentError {
    /// Whether the caller's input is at fault, not the disk or this crate.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Io { .. } | Self::Suite(_) => true,
            Self::GivenData(_) | Self::OtherData { .. } | Self::GivenModels(_) => true,
            Self::Collect(e) => e.is_bad_input(),
            Self::Training(e) => e.is_bad_input(),
            _ => false,
        }
    }
}

impl From<Failure> for ExperimentError {
    fn from((path, error): Failure) -> Self {
        Self::Io { path, error }
    }
}

/// What an experiment takes as it is instead of making it.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// Folder of the data set, collected with the experiment's settings.
    pub data: Option<PathBuf>,
    /// Folder of the models, with the names that [`run`] gives them. Nothing is collected or
    /// trained, and no learning curve drawn.
    pub models: Option<PathBuf>,
}

/// A run of an experiment into a folder.
struct Runner<'a> {
    config: &'a ExperimentConfig,
    given: &'a Given,
    out: &'a Path,
    stages: Stages,
}

/// Runs `config` into the folder `out`, going on with what an earlier run left there.
/// Returns the rows. Progress and what is skipped go to stderr.
pub fn run(
    config: &ExperimentConfig,
    given: &Given,
    out: &Path,
) -> Result<Vec<Row>, ExperimentError> {
    let runner = Runner { config, given, out, stages: Stages::new(out) };
    let mut curve = Vec::new();
    // What the models come from.
    let mut trained = String::new();
    if let Some(folder) = given.models.as_ref().filter(|_| config.learns()) {
        trained = runner.given_models(folder)?;
        runner.prepare()?;
    } else if config.learns() {
        let given = given.data.as_ref().map(|folder| runner.given_data(folder)).transpose()?;
        runner.prepare()?;
        let data = match given {
            Some(data) => data,
            None => runner.collect()?,
        };
        let mut read = None;
        runner.train(&data, &mut read)?;
        curve = runner.learning_curve(&data, &mut read)?;
        trained = settings((&data, &config.train));
    } else {
        runner.prepare()?;
    }
    runner.evaluate(&trained, &curve)
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

    /// Settings of the data set collected here; every later stage's contain them.
    fn collect_settings(&self) -> String {
        let c = self.config;
        settings(("collect", env!("CARGO_PKG_VERSION"), &c.collect, &c.evaluate.types))
    }

    /// Checks that the data set in `folder` is the experiment's; what identifies it.
    fn given_data(&self, folder: &Path) -> Result<String, ExperimentError> {
        let found = read_metadata(folder).map_err(ExperimentError::GivenData)?;
        let wanted = self.config.collect.metadata();
        if let Some(d) = found.settings_difference(&wanted) {
            let (path, field, found, wanted) = (folder.to_owned(), d.field, d.stored, d.current);
            return Err(ExperimentError::OtherData { path, field, found, wanted });
        }
        let mut parts = Vec::new();
        for &kind in &self.config.evaluate.types {
            let missing = |_| {
                let path = folder.to_owned();
                ExperimentError::GivenData(DatasetError::Incomplete { path, kind })
            };
            parts.push(std::fs::read(manifest_path(folder, kind)).map_err(missing)?);
        }
        let parts: Vec<&[u8]> = parts.iter().map(Vec::as_slice).collect();
        Ok(settings(("given", sha256_hex(&parts))))
    }

    /// Checks that the models in `folder` can be loaded; what identifies them.
    fn given_models(&self, folder: &Path) -> Result<String, ExperimentError> {
        let files = self.model_files(folder);
        Models::load(&files).map_err(|error| match error {
            ModelsError::Load(error) => ExperimentError::GivenModels(error),
            error => error.into(),
        })?;
        let mut sums = Vec::new();
        for path in files {
            let bytes =
                std::fs::read(&path).map_err(|error| ExperimentError::Io { path, error })?;
            sums.push(sha256_hex(&[&bytes]));
        }
        Ok(settings(("models", sums)))
    }

    /// Collects the data set; what identifies it.
    fn collect(&self) -> Result<String, ExperimentError> {
        let settings = self.collect_settings();
        let folder = self.path("dataset");
        match self.stages.begin("collect", &settings)? {
            Todo::Nothing if folder.exists() => return Ok(settings),
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
        self.stages.finish("collect", &settings)?;
        Ok(settings)
    }

    /// Trains from the data set that `data` identifies.
    fn train(&self, data: &str, read: &mut Option<Dataset>) -> Result<(), ExperimentError> {
        let kinds = &self.config.evaluate.types;
        let knn = self.model("knn.bin");
        let knn_settings = settings(("knn", data));
        if self.stages.begin("train-knn", &knn_settings)? != Todo::Nothing || !knn.exists() {
            let set = self.dataset(read)?;
            training::knn::train(&set.metadata, &set.samples, kinds, &knn)?;
            self.stages.finish("train-knn", &knn_settings)?;
        }
        if !self.config.needs_mlp() {
            return Ok(());
        }
        for &kind in kinds {
            let (stage, out) = (format!("train-mlp-{kind}"), self.mlp_model(kind));
            let mlp = &self.config.train.mlp;
            let mlp_settings = settings((&stage, data, mlp));
            if self.stages.begin(&stage, &mlp_settings)? == Todo::Nothing && out.exists() {
                continue;
            }
            let set = self.dataset(read)?;
            let log = training::mlp::train(&set.metadata, &set.samples, kind, mlp, &out)?;
            tracing::info!(
                "{stage}: best of {} epochs is {}, median error {:.2} m on unseen rows",
                log.losses.len(),
                log.best_epoch,
                log.validation.position_median_m
            );
            self.stages.finish(&stage, &mlp_settings)?;
        }
        Ok(())
    }

    /// The points of the learning curve, if the experiment wants one.
    fn learning_curve(
        &self,
        data: &str,
        read: &mut Option<Dataset>,
    ) -> Result<Vec<CurvePoint>, ExperimentError> {
        let Some(curve) = &self.config.learning_curve else { return Ok(Vec::new()) };
        let mut points = Vec::new();
        for (i, part) in curve.parts.iter().enumerate() {
            let stage = format!("learning-curve-{i}");
            let folder = self.path(&format!("learning-curve/{i}"));
            let file = folder.join("points.json");
            let (c, e) = (self.config, &self.config.evaluate);
            let scenes = (&curve.methods, curve.count, curve.seed, &c.vehicle);
            let planning = (&e.types, &e.levels, e.max_expansions, &e.planner, &e.n3p);
            let settings = settings((&stage, data, part, scenes, planning, &c.train));
            let done = self.stages.begin(&stage, &settings)? == Todo::Nothing;
            let known = std::fs::read(&file).ok().filter(|_| done);
            let known = known.and_then(|j| serde_json::from_slice::<Vec<CurvePoint>>(&j).ok());
            if let Some(known) = known {
                points.extend(known);
                continue;
            }
            tracing::info!("{stage}: part {} of {}", i + 1, curve.parts.len());
            std::fs::create_dir_all(&folder)
                .map_err(|error| ExperimentError::Io { path: folder.clone(), error })?;
            let new = learning_curve::points(c, curve, self.dataset(read)?, part, &folder)?;
            let json = serde_json::to_string_pretty(&new).expect("plain data") + "\n";
            write_whole(&file, json.as_bytes())
                .map_err(|error| ExperimentError::Io { path: file, error })?;
            self.stages.finish(&stage, &settings)?;
            points.extend(new);
        }
        Ok(points)
    }

    /// The data set, read at most once.
    fn dataset<'d>(&self, read: &'d mut Option<Dataset>) -> Result<&'d Dataset, ExperimentError> {
        if read.is_none() {
            *read = Some(match &self.given.data {
                Some(folder) => Dataset::read(folder, None).map_err(ExperimentError::GivenData)?,
                None => Dataset::read(&self.path("dataset"), None)?,
            });
        }
        Ok(read.as_ref().expect("just read"))
    }

    /// The files of the models that the evaluation needs, in `folder`.
    fn model_files(&self, folder: &Path) -> Vec<PathBuf> {
        let mut files = Vec::new();
        if self.config.learns() {
            files.push(folder.join("knn.bin"));
        }
        if self.config.needs_mlp() {
            let network = |kind| folder.join(format!("mlp-{kind}.safetensors"));
            files.extend(self.config.evaluate.types.iter().map(network));
        }
        files
    }

    fn models(&self) -> Result<Models, ExperimentError> {
        let made = self.path("models");
        let folder = self.given.models.as_ref().unwrap_or(&made);
        Ok(Models::load(&self.model_files(folder))?)
    }

    /// Runs the methods with the models that `trained` identifies.
    fn evaluate(&self, trained: &str, curve: &[CurvePoint]) -> Result<Vec<Row>, ExperimentError> {
        let e = &self.config.evaluate;
        let settings = settings(("evaluate", trained, &self.config.vehicle, e));
        let rows_csv = self.path("rows.csv");
        match self.stages.begin("evaluate", &settings)? {
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
        outputs.finish(&title, &cases, &rows, curve, &provenance)?;
        self.stages.finish("evaluate", &settings)?;
        Ok(rows)
    }
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
