//! The trained models of one run, whichever files they come from.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::method::{Learnt, Method};
use super::{Driver, TrainedPolicy, more};
use crate::files::sha256_hex;
use crate::selectors::artefact::{self, ArtefactError, Fault, find_model};
use crate::selectors::by_kind::ByKind;
use crate::selectors::foresight::Foresight;
use crate::selectors::mlp::MlpSelector;
use crate::selectors::model::Model;
use crate::selectors::{PoseSelector, shipped};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// The usual name of foresight.
pub const FORESIGHT: &str = "foresight.safetensors";

/// Trained models of any number of vehicles, and a policy from outside.
#[derive(Clone, Default)]
pub struct Models {
    /// In the order of their first files.
    vehicles: Vec<VehicleModels>,
    /// For vehicles that none of them serves.
    fleet: Option<Arc<dyn PoseSelector>>,
    /// What manoeuvres are worth in a scene.
    foresight: Option<Arc<Foresight>>,
    outside: Option<Arc<dyn Driver>>,
    /// Whence all of them come.
    files: Vec<PathBuf>,
}

/// The models of one vehicle: for each parking type at most one KNN and one MLP selector, and one
/// policy of each course.
#[derive(Clone)]
pub struct VehicleModels {
    origin: Origin,
    knn: Option<Arc<dyn PoseSelector>>,
    mlp: Option<Arc<MlpSelector>>,
    drivers: BTreeMap<&'static str, Arc<dyn Driver>>,
}

/// Where a vehicle's first model comes from, and whom it was trained for.
#[derive(Clone, Debug)]
struct Origin {
    path: PathBuf,
    training: String,
    vehicle: Vehicle,
}

/// Models that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelsError {
    /// A file cannot be loaded, or was trained for another vehicle than those before it.
    #[error("--model: {0}")]
    Load(#[from] ArtefactError),
    /// Two KNN files of one parking type were given.
    #[error("--model {0}: a KNN model of its types was given before: give one")]
    TwoKnn(PathBuf),
    /// Two models for any vehicle were given.
    #[error("--model {0}: a model for any vehicle was given before; give one")]
    TwoFleets(PathBuf),
    /// Two files of foresight were given.
    #[error("--model {0}: foresight was given before; give one")]
    TwoForesights(PathBuf),
    /// Two policies of one course were given.
    #[error("--model {path}: a policy of rl-{course} was given before; give one")]
    TwoPolicies {
        /// The second file.
        path: PathBuf,
        /// Where both learnt.
        course: &'static str,
    },
    /// The scene's vehicle is not the one trained for.
    #[error("scene {scene}: vehicle: {error}; or plan with ha-rs")]
    Vehicle {
        /// Name of the scene.
        scene: String,
        /// Which field differs, and how to train for it.
        error: ArtefactError,
    },
    /// A method's model knows nothing of a parking type.
    #[error(
        "method {method}: no model for type {kind}: give one more with --model, or choose a \
         --type that its models know ({known})"
    )]
    Kind {
        /// The method.
        method: Method,
        /// The parking type it was asked to plan.
        kind: ParkingType,
        /// The types it knows.
        known: String,
    },
}

impl Models {
    /// Loads every file of `names`; bare names are looked for in the working folder,
    /// then in `models/`. Networks of several parking types join into one selector. Where no foresight is
    /// given, the usual one serves: `foresight.safetensors`.
    pub fn load<P: AsRef<Path>>(names: &[P]) -> Result<Self, ModelsError> {
        let mut models = Self::default();
        for name in names {
            let path = find_model(name);
            match Model::load(&path) {
                Err(ArtefactError { fault: Fault::Policy, .. }) => models.add_policy(path)?,
                Err(ArtefactError { fault: Fault::Foresight, .. }) => {
                    models.add_foresight(&path)?
                }
                model => models.add_selector(model?)?,
            }
        }
        let usual = find_model(FORESIGHT);
        if models.foresight.is_none() && artefact::exists(&usual) {
            models.add_foresight(&usual)?;
        }
        Ok(models)
    }

    fn add_foresight(&mut self, path: &Path) -> Result<(), ModelsError> {
        if self.foresight.is_some() {
            return Err(ModelsError::TwoForesights(path.to_owned()));
        }
        self.foresight = Some(Arc::new(Foresight::load(path)?));
        self.files.push(path.to_owned());
        Ok(())
    }

    fn add_selector(&mut self, model: Model) -> Result<(), ModelsError> {
        let file = model.path().to_owned();
        let Some(&vehicle) = model.vehicle() else {
            if self.fleet.is_some() {
                return Err(ModelsError::TwoFleets(model.path().to_owned()));
            }
            self.fleet = Some(model.into_selector());
            self.files.push(file);
            return Ok(());
        };
        let (path, training) = (model.path().to_owned(), model.training());
        let own = self.of_exactly(Origin { path, training, vehicle });
        match model {
            Model::Fleet(_) => unreachable!("it has no vehicle"),
            Model::Knn(knn) if own.knows_one_of(&knn.kinds()) => {
                return Err(ModelsError::TwoKnn(knn.path().to_owned()));
            }
            Model::Knn(knn) => {
                let new: Arc<dyn PoseSelector> = Arc::new(knn);
                own.knn = Some(match own.knn.take() {
                    Some(other) => Arc::new(ByKind(other, new)),
                    None => new,
                });
            }
            Model::Mlp(mlp) => {
                own.mlp = Some(Arc::new(match own.mlp.take() {
                    Some(others) => Arc::unwrap_or_clone(others).combine(mlp)?,
                    None => mlp,
                }));
            }
        }
        self.files.push(file);
        Ok(())
    }

    fn add_policy(&mut self, path: PathBuf) -> Result<(), ModelsError> {
        let TrainedPolicy { course, vehicle, driver } = more::read_policy(&path)?;
        let training = artefact::policy_training(course);
        let own = self.of_exactly(Origin { path: path.clone(), training, vehicle });
        if own.drivers.insert(course, driver).is_some() {
            return Err(ModelsError::TwoPolicies { path, course });
        }
        self.files.push(path);
        Ok(())
    }

    /// The models of the very vehicle of `origin`, none so far if it is new.
    fn of_exactly(&mut self, origin: Origin) -> &mut VehicleModels {
        let known = |m: &VehicleModels| m.origin.vehicle.is_like(&origin.vehicle);
        let at = self.vehicles.iter().position(known).unwrap_or_else(|| {
            let drivers = BTreeMap::new();
            self.vehicles.push(VehicleModels { origin, knn: None, mlp: None, drivers });
            self.vehicles.len() - 1
        });
        &mut self.vehicles[at]
    }

    /// SHA-256 of each file, in lower-case hexadecimal, in the order in which they were loaded: read anew.
    pub fn checksums(&self) -> Result<Vec<String>, ArtefactError> {
        let sum = |path: &PathBuf| Ok(sha256_hex(&[&artefact::read(path)?]));
        self.files.iter().map(sum).collect()
    }

    /// The same with one more selector of preparatory poses.
    pub fn with_selector(mut self, model: Model) -> Result<Self, ModelsError> {
        self.add_selector(model)?;
        Ok(self)
    }

    /// The same with a policy from outside.
    pub fn with_policy(self, outside: Option<Arc<dyn Driver>>) -> Self {
        Self { outside, ..self }
    }

    /// The policy from outside, if any.
    pub fn outside_policy(&self) -> Option<&Arc<dyn Driver>> {
        self.outside.as_ref()
    }

    /// Loads what `methods` need from the usual files, as far as they exist: `knn.bin` and, for other
    /// types and vehicles, `knn-….bin`, `mlp-TYPE.safetensors`, `rl-COURSE.safetensors`, `fleet.safetensors`. The last,
    /// which is for any vehicle, is left out where others serve the `vehicle` that is asked for.
    pub fn usual(methods: &[Method], vehicle: Option<&Vehicle>) -> Result<Self, ModelsError> {
        let knn = methods.iter().any(|m| matches!(m.learnt(), Some(Learnt::Knn | Learnt::Either)));
        let mut found = Vec::new();
        if knn {
            found.push(find_model("knn.bin"));
        }
        if methods.iter().any(|m| m.learnt() == Some(Learnt::Mlp)) {
            let network = |kind| find_model(format!("mlp-{kind}.safetensors"));
            found.extend(ParkingType::ALL.map(network));
        }
        let courses = methods.iter().filter_map(|m| m.course());
        found.extend(courses.map(|course| find_model(format!("rl-{course}.safetensors"))));
        found.retain(|path| artefact::exists(path));
        let mut models = Self::load(&found)?;
        if knn {
            for path in further_knn() {
                let model = Model::load(&path)?;
                let known = |m: &VehicleModels| {
                    m.knows_one_of(&model.kinds())
                        && model.vehicle().is_some_and(|v| m.vehicle().is_like(v))
                };
                if models.vehicles.iter().any(known) {
                    log::warn!("{}: left out: its vehicle has a model", path.display());
                } else {
                    models.add_selector(model)?;
                }
            }
        }
        let serves = |&&m: &&Method| {
            let own = vehicle.and_then(|v| models.serving(m, v));
            let known = own.and_then(|own| own.selector(m)).map_or(Vec::new(), |s| s.kinds());
            ParkingType::SQUARE.iter().all(|kind| known.contains(kind))
        };
        let any = find_model("fleet.safetensors");
        let mut use_it = methods.iter().filter(|m| uses_networks(**m));
        if artefact::exists(&any) && !use_it.all(|m| serves(&m)) {
            models.add_selector(Model::load(&any)?)?;
        }
        Ok(models)
    }

    /// The models compiled in that serve `vehicle`, for `n3p`: those of a vehicle that covers it, or
    /// else the one for any. None without the feature `models`.
    pub fn compiled_in(vehicle: &Vehicle) -> Result<Self, ModelsError> {
        let mut models = Self::default();
        let is_knn = |name: &str| name.starts_with("knn") && name.ends_with(".bin");
        if shipped::find(Path::new(FORESIGHT)).is_some() {
            models.add_foresight(Path::new(FORESIGHT))?;
        }
        let of = |wanted: fn(&str) -> bool| shipped::FILES.iter().filter(move |(n, _)| wanted(n));
        for (name, bytes) in of(is_knn) {
            models.add_selector(Model::from_bytes(Path::new(name), Cow::Borrowed(bytes))?)?;
        }
        if models.serving(Method::N3P, vehicle).is_none() {
            for (name, bytes) in of(|name| name == "fleet.safetensors") {
                models.add_selector(Model::from_bytes(Path::new(name), Cow::Borrowed(bytes))?)?;
            }
        }
        Ok(models)
    }

    /// What manoeuvres are worth in a scene.
    pub fn foresight(&self) -> Option<&Arc<Foresight>> {
        self.foresight.as_ref()
    }

    /// The models that `method` plans with, vehicle by vehicle.
    pub fn for_method(&self, method: Method) -> impl Iterator<Item = &VehicleModels> {
        self.vehicles.iter().filter(move |m| m.serve(method))
    }

    /// The models that `method` plans with for `vehicle`: its own, or else the first that were
    /// trained for one that covers it ([`Vehicle::covers`]).
    pub fn serving(&self, method: Method, vehicle: &Vehicle) -> Option<&VehicleModels> {
        if method.course().is_some() {
            // A policy's steps are as long as its speeds say.
            return self.for_method(method).find(|m| m.vehicle().drives_like(vehicle));
        }
        let own = self.for_method(method).find(|m| m.vehicle().is_like(vehicle));
        own.or_else(|| self.for_method(method).find(|m| m.vehicle().covers(vehicle)))
    }

    /// The model that `method` plans with for vehicles that no other model serves.
    pub fn fleet(&self, method: Method) -> Option<Arc<dyn PoseSelector>> {
        self.fleet.clone().filter(|_| uses_networks(method))
    }

    /// The selector that `method` plans with for `vehicle`; `None` where it needs none or has
    /// none.
    pub fn selector(&self, method: Method, vehicle: &Vehicle) -> Option<Arc<dyn PoseSelector>> {
        match self.serving(method, vehicle) {
            Some(models) => models.selector(method),
            None => self.fleet(method),
        }
    }

    /// The vehicle that the first model was trained for; `None` without models.
    pub fn vehicle(&self) -> Option<Vehicle> {
        self.vehicles.first().map(|m| m.origin.vehicle)
    }

    /// Refuses a scene whose vehicle no model of `method` serves.
    pub fn check_vehicle(
        &self,
        method: Method,
        scene: &str,
        vehicle: &Vehicle,
    ) -> Result<(), ModelsError> {
        let Some(any) = self.for_method(method).next() else { return Ok(()) };
        if self.serving(method, vehicle).is_some() || self.fleet(method).is_some() {
            return Ok(());
        }
        let Origin { path, training, vehicle: trained } = &any.origin;
        let check = match method.course() {
            Some(_) => artefact::check_driving(path, training, trained, vehicle),
            None => artefact::check_vehicle(path, training, trained, vehicle),
        };
        check.map_err(|error| ModelsError::Vehicle { scene: scene.to_owned(), error })
    }

    /// Refuses a parking type that `method`'s model for `vehicle` was not trained for.
    pub fn check_kind(
        &self,
        method: Method,
        vehicle: &Vehicle,
        kind: ParkingType,
    ) -> Result<(), ModelsError> {
        let Some(selector) = self.selector(method, vehicle) else { return Ok(()) };
        let kinds = selector.kinds();
        if kinds.contains(&kind) {
            return Ok(());
        }
        let known = kinds.iter().map(|k| k.name()).collect::<Vec<_>>().join(", ");
        Err(ModelsError::Kind { method, kind, known })
    }
}

/// Whether a method may plan with networks.
fn uses_networks(method: Method) -> bool {
    matches!(method.learnt(), Some(Learnt::Mlp | Learnt::Either))
}

/// Files `models/knn-….bin`, and those compiled in, by name.
fn further_knn() -> Vec<PathBuf> {
    named(|name| name.starts_with("knn-") && name.ends_with(".bin"))
}

/// Models in `models/` and those compiled in whose names pass, by name; files come before what is
/// compiled in.
pub(super) fn named(passes: impl Fn(&str) -> bool) -> Vec<PathBuf> {
    let entries = std::fs::read_dir("models").into_iter().flatten();
    let in_folder = entries.filter_map(|e| e.ok()?.file_name().into_string().ok());
    let compiled_in = shipped::FILES.iter().map(|(name, _)| (*name).to_owned());
    let names: BTreeSet<String> = in_folder.chain(compiled_in).filter(|n| passes(n)).collect();
    names.into_iter().map(find_model).collect()
}

impl VehicleModels {
    /// The vehicle they were trained for.
    pub fn vehicle(&self) -> &Vehicle {
        &self.origin.vehicle
    }

    /// The selector that `method` plans with, if there is one.
    pub fn selector(&self, method: Method) -> Option<Arc<dyn PoseSelector>> {
        let mlp = || self.mlp.clone().map(|m| m as Arc<dyn PoseSelector>);
        match method.learnt()? {
            Learnt::Knn => self.knn.clone(),
            Learnt::Mlp => mlp(),
            Learnt::Either => self.knn.clone().or_else(mlp),
        }
    }

    /// The trained policy of a course, if there is one.
    pub fn driver(&self, course: &str) -> Option<&Arc<dyn Driver>> {
        self.drivers.get(course)
    }

    /// Whether the KNN selector knows one of these types.
    fn knows_one_of(&self, kinds: &[ParkingType]) -> bool {
        self.knn.as_ref().is_some_and(|knn| knn.kinds().iter().any(|kind| kinds.contains(kind)))
    }

    /// Whether they hold what `method` plans with.
    fn serve(&self, method: Method) -> bool {
        self.selector(method).is_some() || method.course().is_some_and(|c| self.driver(c).is_some())
    }
}
