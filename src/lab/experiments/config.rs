//! What an experiment is: `experiments/NAME.toml`.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::curves::smoothing::StandstillSteering;
use crate::environment::courses::Course;
use crate::lab::dataset::{CollectConfig, Subset};
use crate::lab::evaluation::SuiteConfig;
use crate::lab::evaluation::suite::{self, Drawn, MAX_COUNT, World};
use crate::lab::training::MlpConfig;
use crate::lab::training::foresight::ForesightConfig;
use crate::lab::training::rl::RlConfig;
use crate::lab::training::worlds::WorldsConfig;
use crate::n3p::RolloutConfig;
use crate::n3p::guided::RankedConfig;
use crate::n3p::{Method, MethodSettings};
use crate::planners::goals::Terms;
use crate::planners::{Budget, Effort, HybridAStarConfig};
use crate::toml_file::{Setting, TomlError, read_settings};
use crate::vehicle::Vehicle;
use crate::world::generate::GeneratorConfig;
use crate::world::{Level, ParkingType};

/// The version of the format that this crate reads.
pub const VERSION: u32 = 1;

/// One experiment. Unknown keys are refused, absent sections keep their defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentConfig {
    /// Version of the format: 1.
    pub version: u32,
    /// Name; the results' folder is called so.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Seed of the collection and the training. Their sections have none of their own.
    pub seed: u64,
    /// The vehicle collected, trained and evaluated with.
    #[serde(default)]
    pub vehicle: Vehicle,
    /// The collection, as in `n3p-collect --config`, without `seed` and `vehicle`.
    #[serde(default)]
    pub collect: CollectConfig,
    /// The trainings.
    #[serde(default)]
    pub train: TrainConfig,
    /// Whether, and how, to see how much data is enough.
    #[serde(default)]
    pub learning_curve: Option<LearningCurveConfig>,
    /// The evaluation.
    pub evaluate: EvaluateConfig,
    /// Where the file lies: folders of scenes are seen from there.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// What is trained.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrainConfig {
    /// The worlds in which manoeuvres are learnt for the KNN, without `seed`.
    pub knn: WorldsConfig,
    /// The networks, as in `n3p-train mlp --config`, without `seed`.
    pub mlp: MlpConfig,
    /// Foresight, as in `n3p-train foresight --config`, without `seed`; the usual one serves where this is
    /// left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foresight: Option<ForesightConfig>,
    /// The policies, as in `n3p-train rl --config`, without `seed` and `vehicle`.
    pub rl: RlConfig,
}

/// Models from parts of the data set, planning in scenes that nothing else uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearningCurveConfig {
    /// Methods that plan with a model. Networks are trained only if one needs them.
    pub methods: Vec<Method>,
    /// Scenes per type and level.
    pub count: usize,
    /// Seed of the scenes, another one than the evaluation's.
    pub seed: u64,
    /// The parts of the data.
    pub parts: Vec<Subset>,
}

impl LearningCurveConfig {
    /// Whether some method needs the networks.
    pub fn needs_mlp(&self) -> bool {
        self.methods.contains(&Method::MLP_N3P)
    }

    fn validate(&self, reported_seed: u64) -> Result<(), String> {
        distinct("methods", &self.methods, |m| m.name())?;
        if let Some(other) = self.methods.iter().find(|m| !m.needs_selector()) {
            return Err(format!(
                "methods names {other}, which learns nothing of data; leave it out"
            ));
        }
        if !(1..=MAX_COUNT).contains(&self.count) {
            return Err(format!("count is {}; expected 1 to {MAX_COUNT}", self.count));
        }
        if self.seed == reported_seed {
            return Err(format!(
                "seed is {reported_seed}, that of the evaluation; choose another one, so that data \
                 is not chosen by the scenes reported on"
            ));
        }
        if self.parts.is_empty() {
            return Err("parts is empty; expected at least one".to_owned());
        }
        let mut parts = self.parts.iter().enumerate();
        parts.try_for_each(|(i, p)| p.validate().map_err(|e| format!("parts[{i}].{e}")))
    }
}

/// Which methods run on which scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvaluateConfig {
    /// The methods, in the order of the rows.
    pub methods: Vec<Method>,
    /// Parking types; collected and trained for, too.
    #[serde(default = "all_types")]
    pub types: Vec<ParkingType>,
    /// Where the generated scenes lie, each world a set of its own; may be empty where there are
    /// `scenes`.
    #[serde(default = "home")]
    pub worlds: Vec<World>,
    /// Folders of scene files, relative to the experiment's file, each a set of its own.
    #[serde(default)]
    pub scenes: Vec<PathBuf>,
    /// Levels of the scenes at home.
    #[serde(default = "all_levels")]
    pub levels: Vec<Level>,
    /// Generated scenes per type, at home per type and level.
    pub count: usize,
    /// Seed of the scenes and of the bootstrap intervals.
    pub seed: u64,
    /// What scenes are drawn from.
    #[serde(default)]
    pub generator: GeneratorConfig,
    /// Expansion budget per episode.
    #[serde(default = "max_expansions")]
    pub max_expansions: usize,
    /// What becomes of first paths.
    #[serde(default)]
    pub effort: Effort,
    /// Where the steering wheel may be turned while the car stands.
    #[serde(default, skip_serializing_if = "is_anywhere")]
    pub standstill_steering: StandstillSteering,
    /// Settings of every search.
    #[serde(default)]
    pub planner: HybridAStarConfig,
    /// Settings of the method `n3p`.
    #[serde(default)]
    pub n3p: RankedConfig,
    /// How policies are driven.
    #[serde(default)]
    pub rl: RolloutConfig,
}

impl EvaluateConfig {
    /// The budget of an episode.
    pub(super) fn budget(&self) -> Budget {
        Budget { max_expansions: self.max_expansions, effort: self.effort }
    }

    /// What generated scenes are drawn from.
    pub(super) fn drawn<'a>(&'a self, vehicle: &'a Vehicle) -> Drawn<'a> {
        Drawn {
            generator: &self.generator,
            vehicle,
            kinds: &self.types,
            levels: &self.levels,
            count: self.count,
            seed: self.seed,
        }
    }

    /// Whether the scenes of this set are generated.
    pub(super) fn generates(&self, set: &str) -> bool {
        self.worlds.iter().any(|w| w.name() == set)
    }

    /// These settings for `methods`, one thread.
    pub(super) fn suite(&self, methods: &[Method]) -> SuiteConfig {
        SuiteConfig {
            methods: methods.to_vec(),
            settings: MethodSettings { planner: self.planner, n3p: self.n3p, rl: self.rl },
            budget: self.budget(),
            terms: Terms { standstill: self.standstill_steering, ..Terms::default() },
            threads: 1,
        }
    }
}

/// Left out of files where it is as usual, so that those of before stay what they are.
fn is_anywhere(standstill: &StandstillSteering) -> bool {
    *standstill == StandstillSteering::Anywhere
}

fn all_types() -> Vec<ParkingType> {
    ParkingType::SQUARE.to_vec()
}

fn home() -> Vec<World> {
    vec![World::Home]
}

fn all_levels() -> Vec<Level> {
    Level::ALL.to_vec()
}

fn max_expansions() -> usize {
    200_000
}

/// An experiment that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read, or is no TOML of these settings.
    #[error(transparent)]
    File(#[from] TomlError),
    /// A value is out of range.
    #[error("{path}: {message}")]
    Value {
        /// The file.
        path: PathBuf,
        /// Field, value, and what would be right.
        message: String,
    },
}

impl ExperimentConfig {
    /// Reads an experiment, with the settings of `set` instead of its own, resolves and checks it.
    pub fn read(path: &Path, set: &[Setting]) -> Result<Self, ConfigError> {
        let value = |message| ConfigError::Value { path: path.to_owned(), message };
        let config = Self { folder: path.with_file_name(""), ..read_settings(Some(path), set)? };
        let config = config.resolved();
        config.validate().map_err(value)?;
        let written: toml::Table = read_settings(Some(path), set)?;
        if let Some(key) = misplaced(&written, &config) {
            let top = key.rsplit('.').next().unwrap_or(key);
            return Err(value(format!("{key}: set {top} once, at the top of the file, not here")));
        }
        Ok(config)
    }

    /// The same experiment with another vehicle; its name says so.
    pub fn with_vehicle(self, vehicle: Vehicle, name: &str) -> Self {
        let name = format!("{}-{name}", self.name);
        Self { vehicle, name, ..self }.resolved()
    }

    /// The same with the common settings copied to where they are used.
    fn resolved(mut self) -> Self {
        self.collect.vehicle = self.vehicle;
        self.collect.seed = self.seed;
        self.train.knn.seed = self.seed;
        self.train.mlp.seed = self.seed;
        if let Some(foresight) = &mut self.train.foresight {
            foresight.seed = self.seed;
        }
        self.train.rl.seed = self.seed;
        self.train.rl.vehicle = self.vehicle;
        self
    }

    fn validate(&self) -> Result<(), String> {
        if self.version != VERSION {
            return Err(format!("version is {}; this program reads {VERSION}", self.version));
        }
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if self.name.is_empty() || !self.name.chars().all(plain) {
            return Err(format!(
                "name is \"{}\"; expected letters, digits, - and _ (it becomes a folder)",
                self.name
            ));
        }
        self.vehicle.validate().map_err(|e| e.to_string())?;
        self.collect.validate().map_err(|e| format!("collect: {e}"))?;
        self.train.knn.validate().map_err(|e| format!("train.knn: {e}"))?;
        self.train.mlp.validate().map_err(|e| format!("train.mlp: {e}"))?;
        if let Some(foresight) = &self.train.foresight {
            foresight.validate().map_err(|e| format!("train.foresight: {e}"))?;
        }
        if self.courses().next().is_some() {
            self.train.rl.validate().map_err(|e| format!("train.rl: {e}"))?;
        }
        let e = &self.evaluate;
        if e.methods.contains(&Method::POLICY) {
            return Err("evaluate.methods names policy, which only n3p-eval and n3p-plan know; \
                        leave it out"
                .to_owned());
        }
        if self.courses().next().is_some() {
            for (field, seed) in
                [("seed", self.seed), ("train.rl.validation_seed", self.train.rl.validation_seed)]
            {
                if seed == e.seed {
                    return Err(format!(
                        "evaluate.seed is {seed}, that of {field}; choose another one, so that \
                         policies are not evaluated in scenes they learnt in"
                    ));
                }
            }
        }
        e.generator.validate(&self.vehicle).map_err(|m| format!("evaluate.{m}"))?;
        e.planner.validate().map_err(|m| format!("evaluate.planner.{m}"))?;
        e.n3p.validate().map_err(|m| format!("evaluate.n3p.{m}"))?;
        e.rl.validate().map_err(|m| format!("evaluate.rl.{m}"))?;
        if let Some(curve) = &self.learning_curve {
            curve.validate(e.seed).map_err(|m| format!("learning_curve.{m}"))?;
        }
        distinct("evaluate.methods", &e.methods, |m| m.name())?;
        distinct("evaluate.types", &e.types, |t| t.name())?;
        distinct("evaluate.levels", &e.levels, |l| l.name())?;
        if e.scenes.is_empty() || !e.worlds.is_empty() {
            distinct("evaluate.worlds", &e.worlds, |w| w.name())?;
        }
        let folders = self.scene_folders().map(|folder| suite::set_of(&folder));
        let sets: Vec<_> = e.worlds.iter().map(|w| w.name().to_owned()).chain(folders).collect();
        if let Some((_, twice)) = sets.iter().enumerate().find(|(i, s)| sets[..*i].contains(s)) {
            return Err(format!(
                "evaluate: two sets of scenes are called \"{twice}\"; rename a folder, or leave one out"
            ));
        }
        for (field, value, max) in [
            ("evaluate.count", e.count, MAX_COUNT),
            ("evaluate.max_expansions", e.max_expansions, 1_000_000_000),
        ] {
            if !(1..=max).contains(&value) {
                return Err(format!("{field} is {value}; expected 1 to {max}"));
            }
        }
        Ok(())
    }

    /// The folders of scene files evaluated.
    pub(super) fn scene_folders(&self) -> impl Iterator<Item = PathBuf> + '_ {
        self.evaluate.scenes.iter().map(|folder| self.folder.join(folder))
    }

    /// Whether anything is collected and trained for.
    pub fn learns(&self) -> bool {
        self.learning_curve.is_some() || self.plans_with_models()
    }

    /// Whether some method of the evaluation needs a model.
    pub fn plans_with_models(&self) -> bool {
        self.evaluate.methods.iter().any(|m| m.needs_selector())
    }

    /// Where policies learn for the evaluation.
    pub fn courses(&self) -> impl Iterator<Item = Course> {
        self.evaluate.methods.iter().filter_map(|m| Course::named(m.course()?))
    }

    /// Whether some method needs the networks.
    pub fn needs_mlp(&self) -> bool {
        self.evaluate.methods.contains(&Method::MLP_N3P)
    }

    /// The file with every setting spelt out.
    #[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("settings are plain values")
    }
}

/// A setting that belongs to the top of the file, found in a section with another value: a file with every
/// setting spelt out has them in both places.
fn misplaced(written: &toml::Table, config: &ExperimentConfig) -> Option<&'static str> {
    let in_section = |path: &str| {
        let mut parts = path.split('.');
        let first = parts.next().and_then(|p| written.get(p));
        parts.try_fold(first?, |table, part| table.get(part))
    };
    let seed = toml::Value::try_from(config.seed).ok();
    let vehicle = toml::Value::try_from(config.vehicle).ok();
    let misplaced = [
        ("collect.seed", &seed),
        ("collect.vehicle", &vehicle),
        ("train.knn.seed", &seed),
        ("train.mlp.seed", &seed),
        ("train.foresight.seed", &seed),
        ("train.rl.seed", &seed),
        ("train.rl.vehicle", &vehicle),
    ];
    let differs = |(path, top): &(&str, &Option<toml::Value>)| {
        in_section(path).is_some_and(|value| Some(value) != top.as_ref())
    };
    misplaced.into_iter().find(differs).map(|(path, _)| path)
}

fn distinct<T: PartialEq>(
    field: &str,
    values: &[T],
    name: impl Fn(&T) -> &'static str,
) -> Result<(), String> {
    if values.is_empty() {
        return Err(format!("{field} is empty; expected at least one"));
    }
    match values.iter().enumerate().find(|(i, v)| values[..*i].contains(v)) {
        Some((_, twice)) => Err(format!("{field} names {} twice; once is enough", name(twice))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINIMAL: &str = "version = 1\nname = \"a\"\nseed = 7\n\
        [evaluate]\nmethods = [\"ha-rs\", \"n3p\"]\ncount = 2\nseed = 3\n";

    fn read(text: &str) -> Result<ExperimentConfig, ConfigError> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.toml");
        std::fs::write(&path, text).unwrap();
        ExperimentConfig::read(&path, &[])
    }

    #[test]
    fn defaults_fill_in_and_the_resolved_file_says_the_same() {
        let config = read(MINIMAL).unwrap();
        assert_eq!((config.collect.seed, config.train.mlp.seed), (7, 7));
        assert_eq!(config.evaluate.types.len(), 3);
        assert!(config.learns() && !config.needs_mlp());
        let again = read(&config.to_toml()).unwrap();
        assert_eq!(ExperimentConfig { folder: config.folder.clone(), ..again }, config);
        let other = config.to_toml().replacen("seed = 7", "seed = 8", 1);
        let error = read(&other).unwrap_err().to_string();
        assert!(error.contains("collect.seed: set seed once, at the top of the file"), "{error}");
    }

    #[test]
    fn folders_of_scenes_are_seen_from_the_file_and_written_as_they_are() {
        let with = MINIMAL.replace("count = 2", "scenes = [\"../lot\"]\ncount = 2");
        let config = read(&with).unwrap();
        assert!(config.to_toml().contains("scenes = [\"../lot\"]"), "{}", config.to_toml());
        let folder = config.scene_folders().next().unwrap();
        assert!(folder.ends_with("../lot") && folder.starts_with(&config.folder), "{folder:?}");
    }

    #[test]
    fn refusals_name_the_field() {
        let curve = |method, seed| {
            format!(
                "[learning_curve]\nmethods = [\"{method}\"]\ncount = 1\nseed = {seed}\n\
                 parts = [{{ samples_per_cell = 2 }}]\n[evaluate]"
            )
        };
        for (change, expected) in [
            (("version = 1", "version = 2"), "version is 2"),
            (("\"a\"", "\"a/b\""), "name is"),
            (("count = 2", "count = 0"), "evaluate.count is 0"),
            (("count = 2", "conut = 2"), "line 6"),
            (("\"n3p\"", "\"n4p\""), "unknown method"),
            (("\"n3p\"", "\"ha-rs\""), "twice"),
            (("[evaluate]", "[collect]\nseed = 1\n[evaluate]"), "collect.seed"),
            (("[evaluate]", "[train.knn]\nseed = 1\n[evaluate]"), "train.knn.seed"),
            (("count = 2", "worlds = [\"moon\"]\ncount = 2"), "moon"),
            (("count = 2", "worlds = []\ncount = 2"), "evaluate.worlds is empty"),
            (("count = 2", "scenes = [\"a/home\"]\ncount = 2"), "called \"home\""),
            (("[evaluate]", &curve("n3p", 3)), "learning_curve.seed is 3"),
            (("[evaluate]", &curve("ha", 4)), "learning_curve.methods names ha"),
        ] {
            let message = read(&MINIMAL.replace(change.0, change.1)).unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains("a.toml"), "{message}");
        }
    }
}
