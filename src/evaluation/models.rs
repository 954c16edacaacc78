//! The trained models of one run, whichever files they come from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::method::Method;
use crate::rl::actor::Actor;
use crate::rl::courses::Course;
use crate::rl::policy_file;
use crate::rl::source::PolicySource;
use crate::selectors::PoseSelector;
use crate::selectors::artefact::{self, ArtefactError, Fault, Model, find_model};
use crate::selectors::mlp::MlpSelector;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// At most one KNN and one MLP selector and one policy of each course, all trained for one
/// vehicle; and a policy from outside.
#[derive(Clone, Default)]
pub struct Models {
    knn: Option<Arc<dyn PoseSelector>>,
    mlp: Option<Arc<dyn PoseSelector>>,
    actors: BTreeMap<Course, Actor>,
    outside: Option<PolicySource>,
    origin: Option<Origin>,
}

/// Where the first model comes from, and whom it was trained for.
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
    /// Two KNN files were given.
    #[error("--model {0}: a KNN model was given before; one file holds all types: give one")]
    TwoKnn(PathBuf),
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
    /// then in `models/`. Networks of several parking types join into one selector.
    pub fn load<P: AsRef<Path>>(names: &[P]) -> Result<Self, ModelsError> {
        let mut models = Self::default();
        let mut networks: Option<MlpSelector> = None;
        for name in names {
            let path = find_model(name);
            let model = match Model::load(&path) {
                Err(ArtefactError { fault: Fault::Policy, .. }) => {
                    models.add_policy(path)?;
                    continue;
                }
                model => model?,
            };
            models.add_origin(Origin::of(&model))?;
            match model {
                Model::Knn(knn) if models.knn.is_some() => {
                    return Err(ModelsError::TwoKnn(knn.path().to_owned()));
                }
                Model::Knn(knn) => models.knn = Some(Arc::new(knn)),
                Model::Mlp(mlp) => {
                    networks = Some(match networks {
                        Some(others) => others.combine(mlp)?,
                        None => mlp,
                    });
                }
            }
        }
        models.mlp = networks.map(|n| Arc::new(n) as Arc<dyn PoseSelector>);
        Ok(models)
    }

    fn add_policy(&mut self, path: PathBuf) -> Result<(), ModelsError> {
        let (header, actor) = policy_file::load(&path)?;
        let course = header.course;
        if self.actors.insert(course, actor).is_some() {
            return Err(ModelsError::TwoPolicies { path, course: course.name() });
        }
        let training = artefact::policy_training(course.name());
        self.add_origin(Origin { path, training, vehicle: header.vehicle })
    }

    /// The first one's vehicle is everyone's.
    fn add_origin(&mut self, new: Origin) -> Result<(), ModelsError> {
        match &self.origin {
            Some(first) => {
                let Origin { path, training, vehicle } = &new;
                artefact::check_vehicle(path, training, vehicle, &first.vehicle)?;
            }
            None => self.origin = Some(new),
        }
        Ok(())
    }

    /// The same with a policy from outside.
    pub fn with_policy(self, outside: Option<PolicySource>) -> Self {
        Self { outside, ..self }
    }

    /// The trained policy of a course, if any.
    pub fn actor(&self, course: Course) -> Option<&Actor> {
        self.actors.get(&course)
    }

    /// The policy from outside, if any.
    pub fn outside_policy(&self) -> Option<&PolicySource> {
        self.outside.as_ref()
    }

    /// Loads what `method` needs from the usual files (`knn.bin`, `mlp-TYPE.safetensors`),
    /// as far as they exist.
    pub fn usual(method: Method) -> Result<Self, ModelsError> {
        let names: Vec<String> = match method {
            Method::KnnN3p | Method::N3p => vec!["knn.bin".to_owned()],
            Method::MlpN3p => {
                ParkingType::ALL.iter().map(|k| format!("mlp-{k}.safetensors")).collect()
            }
            _ => method.course().map(policy_file::usual_name).into_iter().collect(),
        };
        let found: Vec<PathBuf> =
            names.iter().map(find_model).filter(|path| path.exists()).collect();
        Self::load(&found)
    }

    /// The KNN selector, if any.
    pub fn knn(&self) -> Option<Arc<dyn PoseSelector>> {
        self.knn.clone()
    }

    /// The MLP selector, if any.
    pub fn mlp(&self) -> Option<Arc<dyn PoseSelector>> {
        self.mlp.clone()
    }

    /// The selector that `method` plans with; `None` where it needs none or has none.
    pub fn selector(&self, method: Method) -> Option<Arc<dyn PoseSelector>> {
        match method {
            Method::KnnN3p => self.knn(),
            Method::MlpN3p => self.mlp(),
            Method::N3p => self.knn().or_else(|| self.mlp()),
            _ => None,
        }
    }

    /// The vehicle that the models were trained for; `None` without models.
    pub fn vehicle(&self) -> Option<Vehicle> {
        self.origin.as_ref().map(|o| o.vehicle)
    }

    /// Refuses a scene with another vehicle than the models'.
    pub fn check_vehicle(&self, scene: &str, vehicle: &Vehicle) -> Result<(), ModelsError> {
        let Some(Origin { path, training, vehicle: trained }) = &self.origin else {
            return Ok(());
        };
        artefact::check_vehicle(path, training, trained, vehicle)
            .map_err(|error| ModelsError::Vehicle { scene: scene.to_owned(), error })
    }

    /// Refuses a parking type that `method`'s model was not trained for.
    pub fn check_kind(&self, method: Method, kind: ParkingType) -> Result<(), ModelsError> {
        let Some(selector) = self.selector(method) else { return Ok(()) };
        let kinds = selector.kinds();
        if kinds.contains(&kind) {
            return Ok(());
        }
        let known = kinds.iter().map(|k| k.name()).collect::<Vec<_>>().join(", ");
        Err(ModelsError::Kind { method, kind, known })
    }
}

impl Origin {
    fn of(model: &Model) -> Self {
        let (path, vehicle) = (model.path().to_owned(), *model.vehicle());
        Self { path, training: model.training(), vehicle }
    }
}
