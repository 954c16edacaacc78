//! Running an experiment: collect → train → evaluate → report.
//!
//! The results' folder:
//!
//! | file | holds |
//! |---|---|
//! | `config.toml`, `run.json` | every setting spelt out; the build; written first |
//! | `dataset/` | the samples |
//! | `models/` | `knn.bin`, `mlp-TYPE.safetensors`, `rl-COURSE.safetensors`, their cards and logs |
//! | `learning-curve.json`, `learning-curve/` | points of the curve, where one is asked for; those and the models of each part |
//! | `rows.csv`, `rows.parquet`, `report.md`, `report.html` | the evaluation |
//! | `traces.jsonl` | its paths, for the report |
//! | `stages/` | which stage was begun or finished, from which settings |
//!
//! A finished stage is skipped when its settings, and those of the stages it builds on, are
//! the same; a stage that was interrupted goes on where it stopped, unless its settings or
//! the build changed: then it begins anew.

use std::path::{Path, PathBuf};

use candle_core::Device;

use super::config::ExperimentConfig;
use super::given::{self, Given};
use super::learning_curve;
use super::stages::{Failure, Stages, Todo, settings};
use crate::episode::Case;
use crate::episode::Row;
use crate::files::{Keeper, keep, reason, remove_leftovers, write_whole};
use crate::lab::dataset::schema::GIT_REVISION;
use crate::lab::dataset::{CollectError, CollectOptions, Dataset, DatasetError, collect};
use crate::lab::evaluation::report::Provenance;
use crate::lab::evaluation::rows::{RowsError, read_csv};
use crate::lab::evaluation::suite;
use crate::lab::evaluation::{CurvePoint, OutputError, Outputs, SuiteConfig, SuiteError};
use crate::lab::progress;
use crate::lab::rl::policy_file;
use crate::lab::training::rl::{Begin, checkpoint_path};
use crate::lab::training::{self, TrainingError};
use crate::n3p::{FORESIGHT, Models, ModelsError};
use crate::selectors::artefact::ArtefactError;
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
    /// Something was given that the experiment has no use for.
    #[error("{option}: no method of this experiment has a use for it; leave it out")]
    Useless {
        /// The option.
        option: &'static str,
    },
    /// A part of the learning curve cannot be trained from or planned with.
    #[error("learning_curve.parts[{part}]: {error}")]
    Part {
        /// Its index.
        part: usize,
        /// Why.
        error: Box<ExperimentError>,
    },
    /// The models given cannot be used.
    #[error("{option}: {error}")]
    GivenModels {
        /// The option that gave them.
        option: &'static str,
        /// What is wrong with one.
        error: ArtefactError,
    },
    /// The worker threads could not be started.
    #[error("collect: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl ExperimentError {
    /// Whether the caller's input is at fault, not the disk or this crate.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Io { .. } | Self::Suite(_) => true,
            Self::GivenData(_) | Self::OtherData { .. } => true,
            Self::GivenModels { .. } | Self::Models(_) | Self::Useless { .. } => true,
            Self::Part { error, .. } => error.is_bad_input(),
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

/// A run of an experiment into a folder.
struct Runner<'a> {
    config: &'a ExperimentConfig,
    given: &'a Given,
    out: &'a Path,
    stages: Stages,
}

/// What an evaluation needs, checked: models, scenes and settings.
type Ready = (Models, Vec<Case>, SuiteConfig);

/// Runs `config` into the folder `out`, going on with what an earlier run left there.
/// Returns the rows. Progress and what is skipped go to stderr.
pub fn run(
    config: &ExperimentConfig,
    given: &Given,
    out: &Path,
) -> Result<Vec<Row>, ExperimentError> {
    given.check(config)?;
    let runner = Runner { config, given, out, stages: Stages::new(out) };
    if given.models.is_some() {
        // All that can be refused is, before anything is written.
        let ready = runner.ready()?;
        let trained = given::checksums(&runner.model_files())?;
        let _keeper = runner.prepare(Some(&trained))?;
        return runner.evaluate(ready, &settings(("models", trained)), &runner.known_curve());
    }
    let data = given.data.as_ref().map(|folder| given::data(config, folder)).transpose()?;
    let policies = given.policies.is_some().then(|| runner.policy_files());
    if let Some(files) = &policies {
        Models::load(files).map_err(|error| runner.model_error(error))?;
    }
    let policies = policies.map(|files| given::checksums(&files)).transpose()?;
    let _keeper = runner.prepare(policies.as_deref())?;
    let (mut data_id, mut curve) = (String::new(), Vec::new());
    if config.learns() {
        data_id = match data {
            Some(data) => data,
            None => runner.collect()?,
        };
        let mut read = None;
        runner.train(&data_id, &mut read)?;
        curve = runner.learning_curve(&data_id, &mut read)?;
    }
    if policies.is_none() {
        runner.train_policies()?;
    }
    let rl = config.courses().next().map(|_| &config.train.rl);
    let trained = settings((
        &data_id,
        &config.train.knn,
        &config.train.mlp,
        &config.train.foresight,
        rl,
        &policies,
    ));
    runner.evaluate(runner.ready()?, &trained, &curve)
}

/// The differences between the rows of two runs, times aside; one line each. Columns that the format
/// got later are not held against rows on record without them.
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
            let unrecorded = old.is_empty() && Row::added().contains(column);
            if old != new && !unrecorded {
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

    /// Makes the folders, keeps them for this process and records what is about to happen, with the checksums
    /// of models given.
    fn prepare(&self, models: Option<&[String]>) -> Result<Keeper, ExperimentError> {
        self.make_folder(self.out.to_owned())?;
        let keeper = keep(self.out)
            .map_err(|error| ExperimentError::Io { path: self.out.to_owned(), error })?;
        self.make_folder(self.path("stages"))?;
        self.write("config.toml", self.config.to_toml())?;
        let run = serde_json::json!({
            "crate_version": env!("CARGO_PKG_VERSION"),
            "git_revision": GIT_REVISION,
            "seed": self.config.seed,
            "scene_seed": self.config.evaluate.seed,
            "data": self.given.data,
            "models": self.given.models,
            "policies": self.given.policies,
            "models_sha256": models,
        });
        self.write("run.json", format!("{run:#}\n"))?;
        Ok(keeper)
    }

    /// Makes a folder, and removes what killed runs left in it.
    fn make_folder(&self, path: PathBuf) -> Result<(), ExperimentError> {
        std::fs::create_dir_all(&path)
            .and_then(|()| remove_leftovers(&path))
            .map_err(|error| ExperimentError::Io { path, error })
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

    /// Collects the data set; what identifies it.
    fn collect(&self) -> Result<String, ExperimentError> {
        let settings = self.collect_settings();
        let folder = self.path("dataset");
        match self.stages.begin("collect", &settings, folder.exists())? {
            Todo::Nothing => return Ok(settings),
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
            log::info!("collect: {}: {} of {} samples solved", r.kind, r.solved, r.rows);
        }
        self.stages.finish("collect", &settings)?;
        Ok(settings)
    }

    /// Trains from the data set that `data` identifies.
    fn train(&self, data: &str, read: &mut Option<Dataset>) -> Result<(), ExperimentError> {
        self.make_folder(self.path("models"))?;
        let kinds = &self.config.evaluate.types;
        let knn = self.model("knn.bin");
        let config = &self.config.train.knn;
        let knn_settings = settings(("knn", data, config));
        if self.stages.begin("train-knn", &knn_settings, knn.exists())? != Todo::Nothing {
            let set = self.dataset(read)?;
            let config = config.to_owned().into();
            training::knn::train(&set.metadata, &set.samples, kinds, &config, &knn)?;
            self.stages.finish("train-knn", &knn_settings)?;
        }
        self.train_foresight(&knn, &knn_settings)?;
        if !self.config.needs_mlp() {
            return Ok(());
        }
        for &kind in kinds {
            let (stage, out) = (format!("train-mlp-{kind}"), self.mlp_model(kind));
            let mlp = &self.config.train.mlp;
            let mlp_settings = settings((&stage, data, mlp));
            if self.stages.begin(&stage, &mlp_settings, out.exists())? == Todo::Nothing {
                continue;
            }
            let set = self.dataset(read)?;
            let log = training::mlp::train(&set.metadata, &set.samples, kind, mlp, &out)?;
            log::info!(
                "{stage}: best of {} epochs is {}, median error {:.2} m on unseen rows",
                log.losses.len(),
                log.best_epoch,
                log.validation.position_median_m
            );
            self.stages.finish(&stage, &mlp_settings)?;
        }
        Ok(())
    }

    /// Trains foresight with the manoeuvres of `knn`, if the experiment wants its own.
    fn train_foresight(&self, knn: &Path, knn_settings: &str) -> Result<(), ExperimentError> {
        let Some(config) = &self.config.train.foresight else { return Ok(()) };
        let (stage, out) = ("train-foresight", self.model(FORESIGHT));
        let settings = settings((stage, knn_settings, config));
        if self.stages.begin(stage, &settings, out.exists())? != Todo::Nothing {
            let models = training::foresight::load(&[knn]).map_err(ModelsError::from)?;
            let log = training::foresight::train(models, config, &out)?;
            log::info!("{stage}: best of {} epochs is {}", log.losses.len(), log.best_epoch);
            self.stages.finish(stage, &settings)?;
        }
        Ok(())
    }

    /// Trains the policies of the evaluation.
    fn train_policies(&self) -> Result<(), ExperimentError> {
        for course in self.config.courses() {
            self.make_folder(self.path("models"))?;
            let stage = format!("train-rl-{}", course.name());
            let (out, config) =
                (self.model(&policy_file::usual_name(course)), &self.config.train.rl);
            let rl_settings = settings((&stage, config));
            match self.stages.begin(&stage, &rl_settings, out.exists())? {
                Todo::Nothing => continue,
                Todo::GoOn if out.exists() => {}
                _ => remove(&checkpoint_path(&out))?,
            }
            let log = training::rl::train(course, config, &out, Begin::Resume, &Device::Cpu)?;
            log::info!("{stage}: the best policy is that of {} episodes", log.best().episodes);
            remove(&checkpoint_path(&out))?;
            self.stages.finish(&stage, &rl_settings)?;
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
            let scenes = (&curve.methods, curve.count, curve.seed, &c.vehicle, &e.generator);
            let work = (e.max_expansions, e.effort, e.standstill_steering);
            let planning = (&e.types, &e.levels, work, &e.planner, &e.n3p);
            let settings = settings((&stage, data, part, scenes, planning, &c.train.mlp));
            let known = read_points(&file);
            let todo = self.stages.begin(&stage, &settings, known.is_some())?;
            if let (Todo::Nothing, Some(known)) = (todo, known) {
                points.extend(known);
                continue;
            }
            log::info!("{stage}: part {} of {}", i + 1, curve.parts.len());
            self.make_folder(folder.clone())?;
            let new = learning_curve::points(c, curve, self.dataset(read)?, part, &folder)
                .map_err(|error| ExperimentError::Part { part: i, error: Box::new(error) })?;
            self.write(&format!("learning-curve/{i}/points.json"), to_json(&new))?;
            self.stages.finish(&stage, &settings)?;
            points.extend(new);
        }
        self.write(CURVE, to_json(&points))?;
        Ok(points)
    }

    /// The learning curve that an earlier run left, where the experiment has one.
    fn known_curve(&self) -> Vec<CurvePoint> {
        let wanted = self.config.learning_curve.is_some();
        wanted.then(|| read_points(&self.path(CURVE))).flatten().unwrap_or_default()
    }

    /// The data set, read at most once.
    fn dataset<'d>(&self, read: &'d mut Option<Dataset>) -> Result<&'d Dataset, ExperimentError> {
        if read.is_none() {
            let kinds = &self.config.evaluate.types;
            *read = Some(match &self.given.data {
                Some(folder) => {
                    Dataset::read_types(folder, kinds).map_err(ExperimentError::GivenData)?
                }
                None => Dataset::read_types(&self.path("dataset"), kinds)?,
            });
        }
        Ok(read.as_ref().expect("just read"))
    }

    /// The files of the models that the evaluation needs.
    fn model_files(&self) -> Vec<PathBuf> {
        let made = self.path("models");
        let folder = self.given.models.as_ref().unwrap_or(&made);
        let mut files = Vec::new();
        if self.config.plans_with_models() {
            // Angled bays have a file of their own where models are given.
            let angled = folder.join("knn-angled.bin");
            let is_angled = |kind: &ParkingType| *kind == ParkingType::Angled;
            let kinds = &self.config.evaluate.types;
            let is_apart = kinds.iter().any(is_angled) && angled.exists();
            if !(is_apart && kinds.iter().all(is_angled)) {
                files.push(folder.join("knn.bin"));
            }
            files.extend(is_apart.then_some(angled));
            let foresight = folder.join(FORESIGHT);
            files.extend(foresight.exists().then_some(foresight));
        }
        if self.config.needs_mlp() {
            let network = |kind| folder.join(format!("mlp-{kind}.safetensors"));
            files.extend(self.config.evaluate.types.iter().map(network));
        }
        files.extend(self.policy_files());
        files
    }

    /// The files of the policies that the evaluation needs.
    fn policy_files(&self) -> Vec<PathBuf> {
        let made = self.path("models");
        let Given { policies, models, .. } = self.given;
        let folder = policies.as_ref().or(models.as_ref()).unwrap_or(&made);
        self.config.courses().map(|c| folder.join(policy_file::usual_name(c))).collect()
    }

    /// Says that what cannot be loaded was given, if it was.
    fn model_error(&self, error: ModelsError) -> ExperimentError {
        let option = match self.given {
            Given { models: Some(_), .. } => Some("--models"),
            Given { policies: Some(_), .. } => Some("--policies"),
            _ => None,
        };
        match (error, option) {
            (ModelsError::Load(error), Some(option)) => {
                ExperimentError::GivenModels { option, error }
            }
            (error, _) => error.into(),
        }
    }

    /// Models, scenes and settings of the evaluation, checked.
    fn ready(&self) -> Result<Ready, ExperimentError> {
        let e = &self.config.evaluate;
        let models = Models::load(&self.model_files()).map_err(|error| self.model_error(error))?;
        let suite_config = e.suite(&e.methods);
        let mut cases = Vec::new();
        for &world in &e.worlds {
            cases.extend(e.drawn(&self.config.vehicle).cases(world)?);
        }
        for folder in self.config.scene_folders() {
            let found = suite::from_folder(&folder, None, suite_config.terms)?;
            // A record is of all its scenes or of none.
            if let Some(first) = found.unusable.first() {
                return Err(SuiteError::NoScenes(first.clone()).into());
            }
            cases.extend(found.cases);
        }
        suite::check(&cases, &models, &suite_config)?;
        Ok((models, cases, suite_config))
    }

    /// Runs the methods with the models that `trained` identifies.
    fn evaluate(
        &self,
        (models, cases, suite_config): Ready,
        trained: &str,
        curve: &[CurvePoint],
    ) -> Result<Vec<Row>, ExperimentError> {
        let (e, name) = (&self.config.evaluate, &self.config.name);
        // Files may change; the report shows the curve, too.
        let files: Vec<_> =
            cases.iter().filter(|c| !e.generates(&c.set)).map(|c| &c.scene).collect();
        let vehicle = &self.config.vehicle;
        let settings = settings(("evaluate", trained, vehicle, e, &files, name, curve));
        let rows_csv = self.path("rows.csv");
        match self.stages.begin("evaluate", &settings, rows_csv.exists())? {
            Todo::Nothing => return Ok(read_csv(&rows_csv)?),
            Todo::GoOn => {}
            Todo::BeginAnew => remove(&rows_csv)?,
        }
        let (mut outputs, mut rows) =
            Outputs::resume(self.out, None, &cases, &suite_config.methods)?;
        let bar = progress::bar((cases.len() * e.methods.len()) as u64, "evaluate");
        bar.set_position(rows.len() as u64);
        let new = suite::run(&cases, &models, &suite_config, rows.len(), |case, episode| {
            bar.inc(1);
            outputs.take(case, episode, &models, None).map_err(ExperimentError::from)
        })?;
        bar.finish_and_clear();
        rows.extend(new);
        let generated = (!e.worlds.is_empty())
            .then(|| e.drawn(&self.config.vehicle).title(cases.len() - files.len(), &e.worlds));
        let read = (!files.is_empty()).then(|| format!("{} from files", files.len()));
        let scenes = format!(
            "{}; {}",
            generated.into_iter().chain(read).collect::<Vec<_>>().join("; "),
            match (&self.given.models, &self.given.data) {
                (Some(models), _) => format!("models from {}", models.display()),
                (None, Some(data)) => {
                    format!("data set from {}, training seed {}", data.display(), self.config.seed)
                }
                (None, None) => format!("data set and training seed {}", self.config.seed),
            }
        );
        let provenance = Provenance::here(scenes, e.seed, e.budget(), 1);
        let title = format!("Experiment {}", self.config.name);
        outputs.finish(&title, &cases, &mut rows, curve, &provenance)?;
        self.stages.finish("evaluate", &settings)?;
        Ok(rows)
    }
}

/// The points of the learning curve, all parts together: what reports show, and what is worth
/// keeping.
const CURVE: &str = "learning-curve.json";

/// The points in a file; `None` where it is missing or damaged.
fn read_points(path: &Path) -> Option<Vec<CurvePoint>> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

fn to_json(points: &[CurvePoint]) -> String {
    serde_json::to_string_pretty(points).expect("plain data") + "\n"
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
