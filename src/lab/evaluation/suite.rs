//! Many episodes: every method on every scene, in a fixed order whatever the threads.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use serde::{Deserialize, Serialize};

use super::oracle;
use crate::episode::{self, Case, Episode, EpisodeConfig, Row};
use crate::n3p::{Method, MethodError, MethodSettings};
use crate::n3p::{Models, ModelsError};
use crate::planners::goals::{self, Terms};
use crate::planners::{Budget, Planner, ProblemError};
use crate::vehicle::Vehicle;
use crate::world::generate::{GeneratorConfig, GeneratorError, generate, some_wide};
use crate::world::lots::lot;
use crate::world::scene::SceneError;
use crate::world::{Level, ParkingType, Scene};

/// What to run on the scenes.
#[derive(Clone, Debug)]
pub struct SuiteConfig {
    /// The methods, in the order of the rows.
    pub methods: Vec<Method>,
    /// Settings of the planners.
    pub settings: MethodSettings,
    /// Budget of an episode.
    pub budget: Budget,
    /// What plans keep to.
    pub terms: Terms,
    /// Worker threads. More than one disturbs the times, never the results.
    pub threads: usize,
}

/// A suite that cannot run.
#[derive(Debug, thiserror::Error)]
pub enum SuiteError {
    /// A scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// There is nothing to evaluate.
    #[error("{0}")]
    NoScenes(String),
    /// Two scenes share a name, so their rows could not be told apart.
    #[error("scene name \"{0}\" occurs twice; give every scene a name of its own")]
    SameName(String),
    /// A method is named twice, so its rows and paths could not be told apart.
    #[error("--methods names {0} twice; once is enough")]
    SameMethod(Method),
    /// A scene has no solution by its own data.
    #[error("scene {scene}: {error}; move it, or leave this scene out")]
    Unsolvable {
        /// Name of the scene.
        scene: String,
        /// What is wrong with it.
        error: ProblemError,
    },
    /// A method cannot be built.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// No scenes can be generated for the vehicle.
    #[error("no scenes for this vehicle: {0}")]
    Generator(#[from] GeneratorError),
    /// A model does not fit.
    #[error(transparent)]
    Models(#[from] ModelsError),
}

/// Where generated scenes lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum World {
    /// Parking lots as in the paper, of three levels: those of the tables.
    Home,
    /// As at home, with sizes drawn far wider than those of any level: what methods learn in and, of
    /// other seeds, are chosen by.
    Wide,
    /// Whole car parks and streets, for which nothing is trained or chosen.
    Lots,
}

impl World {
    /// The name used in files, in rows and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Home => "home",
            Self::Wide => "wide",
            Self::Lots => "lots",
        }
    }
}

/// The most scenes of one type and level: they are held in memory.
pub const MAX_COUNT: usize = 100_000;

/// What generated scenes are drawn from, for one vehicle: a function of the fields alone.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// What the world [`World::Home`] is drawn from.
    pub generator: &'a GeneratorConfig,
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// Parking types.
    pub kinds: &'a [ParkingType],
    /// Levels; only scenes at home have any.
    pub levels: &'a [Level],
    /// Scenes of each type, at home of each type and level.
    pub count: usize,
    /// Seed.
    pub seed: u64,
}

impl Drawn<'_> {
    /// The scenes of a world.
    pub fn cases(&self, world: World) -> Result<Vec<Case>, SuiteError> {
        let Self { generator, vehicle, kinds, levels, count, seed } = *self;
        if world == World::Home {
            generator.validate(vehicle)?;
        }
        let set = || world.name().to_owned();
        let mut cases = Vec::new();
        for &kind in kinds {
            let indices = || 0..count as u64;
            let mut add = |scene, level| {
                cases.push(Case { scene, kind: Some(kind), level, set: set() });
            };
            match world {
                World::Home => levels.iter().for_each(|&level| {
                    let of = |index| generate(generator, vehicle, kind, level, seed, index);
                    indices().for_each(|index| add(of(index), Some(level)));
                }),
                World::Wide => {
                    for scene in some_wide(vehicle, kind, seed, count)? {
                        add(scene, None);
                    }
                }
                World::Lots => indices().for_each(|i| add(lot(vehicle, kind, seed, i), None)),
            }
        }
        Ok(cases)
    }

    /// What `total` scenes of these worlds are, for reports.
    pub fn title(&self, total: usize, worlds: &[World]) -> String {
        let Self { count, seed, .. } = self;
        let each = if worlds.contains(&World::Home) { "type and level" } else { "type" };
        let names: Vec<&str> = worlds.iter().map(|w| w.name()).collect();
        let names = match &names[..] {
            ["home"] => String::new(),
            names => format!(" ({})", names.join(" and ")),
        };
        format!("{total} generated{names}, {count} of each {each}, seed {seed}")
    }
}

/// Scenes at home, as the default generator draws them.
pub fn at_home(
    vehicle: &Vehicle,
    kinds: &[ParkingType],
    levels: &[Level],
    count: usize,
    seed: u64,
) -> Result<Vec<Case>, SuiteError> {
    let generator = &GeneratorConfig::default();
    Drawn { generator, vehicle, kinds, levels, count, seed }.cases(World::Home)
}

/// What a folder of scene files holds.
#[derive(Debug)]
pub struct Folder {
    /// The scenes that can be planned.
    pub cases: Vec<Case>,
    /// Why other files cannot be used, one line each.
    pub unusable: Vec<String>,
    /// How many scene files there are.
    pub files: usize,
}

impl Folder {
    /// How many files could not be used, in words; `None` if all could.
    pub fn complaint(&self) -> Option<String> {
        let (bad, files) = (self.unusable.len(), self.files);
        let noun = if files == 1 { "file" } else { "files" };
        (bad > 0).then(|| format!("{bad} of {files} {noun} could not be used"))
    }
}

/// The name of the set of scenes in a folder: the folder's.
pub fn set_of(dir: &Path) -> String {
    let real = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    real.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The scenes of a folder, of one parking type if `kind` is given. Files that hold no scene, or one
/// whose start or goal is not free on these `terms`, are left out and named. Where that leaves
/// nothing, or there is nothing, it is an error. Their set has the folder's name.
#[allow(clippy::missing_panics_doc, reason = "a folder without scenes has a complaint")]
pub fn from_folder(
    dir: &Path,
    kind: Option<ParkingType>,
    terms: Terms,
) -> Result<Folder, SuiteError> {
    let read = Scene::read_each(dir)?;
    let set = set_of(dir);
    let mut folder = Folder { cases: Vec::new(), unusable: Vec::new(), files: read.len() };
    for (path, scene) in read {
        let scene = match scene {
            Ok(scene) if kind.is_some() && scene.parking_type != kind => continue,
            Ok(scene) => scene,
            Err(error) => {
                folder.unusable.push(error.to_string());
                continue;
            }
        };
        match goals::first_problem(&scene, terms) {
            Ok(_) => {
                let kind = scene.parking_type;
                folder.cases.push(Case { kind, level: None, set: set.clone(), scene });
            }
            Err(error) => {
                let scene = format!("{} ({})", scene.name, path.display());
                folder.unusable.push(SuiteError::Unsolvable { scene, error }.to_string());
            }
        }
    }
    match (&folder.cases[..], &folder.unusable[..]) {
        ([], []) => {
            let what = kind.map_or(String::new(), |k| format!(" of type {k}"));
            Err(SuiteError::NoScenes(format!(
                "{}: holds no scenes{what}; expected .json or .csv scene files",
                dir.display()
            )))
        }
        ([], [first, ..]) => {
            let what = kind.map_or(String::new(), |k| format!("no other is of type {k}; "));
            let complaint = folder.complaint().expect("one is named");
            Err(SuiteError::NoScenes(format!("{complaint}; {what}the first: {first}")))
        }
        _ => Ok(folder),
    }
}

/// Checks, before anything runs, that every method can be built and every scene planned.
pub fn check(cases: &[Case], models: &Models, config: &SuiteConfig) -> Result<(), SuiteError> {
    let mut names = std::collections::HashSet::new();
    config.build_all(models)?;
    for (i, method) in config.methods.iter().enumerate() {
        if config.methods[..i].contains(method) {
            return Err(SuiteError::SameMethod(*method));
        }
    }
    for case in cases {
        let scene = &case.scene;
        if !names.insert(&scene.name) {
            return Err(SuiteError::SameName(scene.name.clone()));
        }
        for &method in &config.methods {
            models.check_vehicle(method, &scene.name, &scene.vehicle)?;
            if let Some(kind) = case.kind {
                models.check_kind(method, &scene.vehicle, kind)?;
            }
        }
        goals::first_problem(scene, config.terms)
            .map_err(|error| SuiteError::Unsolvable { scene: scene.name.clone(), error })?;
    }
    Ok(())
}

impl SuiteConfig {
    /// The planners of all methods, in their order.
    pub fn build_all(&self, models: &Models) -> Result<Vec<Box<dyn Planner + Send>>, MethodError> {
        self.methods.iter().map(|m| m.build(models, &self.settings)).collect()
    }
}

/// Runs every method on every case and hands each episode to `sink`, scene by scene and
/// method by method, as soon as it and all before it are done. The first `skip` episodes
/// of that order are left out: those an interrupted run has done already.
///
/// Returns the rows of this run, or the first error of `sink`.
///
/// # Panics
///
/// Where a case is no problem on the terms of `config`: [`from_folder`] leaves such out.
pub fn run<E>(
    cases: &[Case],
    models: &Models,
    config: &SuiteConfig,
    skip: usize,
    mut sink: impl FnMut(&Case, &Episode) -> Result<(), E>,
) -> Result<Vec<Row>, E>
where
    E: From<SuiteError>,
{
    check(cases, models, config)?;
    // Here and not in the workers: what was built for the check can fail the next time, such as a
    // program that is started anew.
    let planners = (0..config.threads.max(1)).map(|_| config.build_all(models));
    let planners: Vec<_> = planners.collect::<Result<_, _>>().map_err(SuiteError::from)?;
    let per_case = config.methods.len();
    let total = cases.len() * per_case;
    let next = AtomicUsize::new(skip);
    let (send, receive) = mpsc::channel();
    std::thread::scope(|scope| {
        for mut planners in planners {
            let (send, next) = (send.clone(), &next);
            scope.spawn(move || {
                let usual = EpisodeConfig::new(config.budget);
                let episodes = EpisodeConfig { terms: config.terms, ..usual };
                loop {
                    let job = next.fetch_add(1, Ordering::Relaxed);
                    if job >= total {
                        break;
                    }
                    let (case, planner) = (&cases[job / per_case], &mut planners[job % per_case]);
                    let episode = episode::run(case, planner.as_mut(), &episodes, &oracle::JUDGE)
                        .expect("the problem was made once before");
                    if send.send((job, episode)).is_err() {
                        break; // The sink failed: nobody listens any more.
                    }
                }
            });
        }
        drop(send);
        let mut waiting = BTreeMap::new();
        let mut rows = Vec::new();
        for (job, episode) in receive {
            waiting.insert(job, episode);
            while let Some(episode) = waiting.remove(&(skip + rows.len())) {
                sink(&cases[(skip + rows.len()) / per_case], &episode)?;
                rows.push(episode.row);
            }
        }
        Ok(rows)
    })
}
