//! The methods of the tables, by name.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::by_vehicle::ByVehicle;
use super::guided::{GuidedPlanner, RankedConfig};
use super::models::{Models, VehicleModels};
use crate::lab::rl::actor::ActorPolicy;
use crate::lab::rl::courses::Course;
use crate::lab::rl::rollout::{PolicyPlanner, RolloutConfig};
use crate::planners::{
    HybridAStar, HybridAStarConfig, MultiHeuristicHybridAStar, PlainHybridAStar, Planner,
    ScenarioHybridAStar,
};
use crate::selectors::PoseSelector;
use crate::world::UnknownName;

/// A row of the paper's tables, or our own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Method {
    /// Hybrid A* without Reeds-Shepp expansion.
    Ha,
    /// Hybrid A* with Reeds-Shepp expansion.
    HaRs,
    /// The best of the first five solutions of Hybrid A*.
    HaHold,
    /// Multi-heuristic A* over the hybrid lattice, with Reeds-Shepp expansion.
    Mhha,
    /// Hybrid A* to the end of a geometric exit manoeuvre (parallel only).
    Sha,
    /// A policy that learnt in abstracted environments.
    RlSimple,
    /// A policy that learnt in generated scenes.
    RlEval,
    /// The paper's N3P with a pose from the MLP.
    MlpN3p,
    /// The paper's N3P with a pose from KNN.
    KnnN3p,
    /// A policy from outside.
    Policy,
    /// Our N3P: ranked candidates, no search where Reeds-Shepp curves suffice.
    N3p,
}

/// A method that cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MethodError {
    /// It needs a model that was not given.
    #[error(
        "method {method} needs a trained {model} model: give --model FILE (such as --model \
         {example}), or train one with `n3p-train {model} --type TYPE`"
    )]
    NoModel {
        /// The method.
        method: Method,
        /// `knn` or `mlp`.
        model: &'static str,
        /// A file name to try.
        example: &'static str,
    },
    /// It needs a trained policy that was not given.
    #[error(
        "method rl-{course} needs a trained policy: give --model FILE (such as --model \
         rl-{course}.safetensors), or train one with `n3p-train rl --env {course}`"
    )]
    NoTrainedPolicy {
        /// Where the policy should have learnt.
        course: &'static str,
    },
    /// It needs a policy from outside that was not given.
    #[error(
        "method policy needs your policy: give --policy FILE.onnx, or --policy \"COMMAND\" of a \
         program (see docs/policies.md)"
    )]
    NoPolicy,
    /// A policy from outside cannot be started.
    #[error("--policy: {0}")]
    Policy(String),
}

/// How many solutions the paper's HA* Hold compares.
const HOLD_SOLUTIONS: usize = 5;

/// Settings of the planners that methods are built with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MethodSettings {
    /// Of every search.
    pub planner: HybridAStarConfig,
    /// Of the method `n3p`.
    pub n3p: RankedConfig,
    /// Of every policy.
    pub rl: RolloutConfig,
}

impl Method {
    /// All methods, in the order of the paper's tables, ours last.
    pub const ALL: [Method; 11] = [
        Self::Ha,
        Self::HaRs,
        Self::HaHold,
        Self::Mhha,
        Self::Sha,
        Self::RlSimple,
        Self::RlEval,
        Self::MlpN3p,
        Self::KnnN3p,
        Self::Policy,
        Self::N3p,
    ];

    /// The name used in rows, files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ha => "ha",
            Self::HaRs => "ha-rs",
            Self::HaHold => "ha-hold",
            Self::Mhha => "mhha",
            Self::Sha => "sha",
            Self::RlSimple => "rl-simple",
            Self::RlEval => "rl-eval",
            Self::MlpN3p => "mlp-n3p",
            Self::KnnN3p => "knn-n3p",
            Self::Policy => "policy",
            Self::N3p => "n3p",
        }
    }

    /// The name in the paper's tables; `None` for our own rows.
    pub fn paper_name(self) -> Option<&'static str> {
        match self {
            Self::Ha => Some("HA*"),
            Self::HaRs => Some("HA* with RS"),
            Self::HaHold => Some("HA* Hold"),
            Self::Mhha => Some("MHHA*"),
            Self::Sha => Some("SHA*"),
            Self::RlSimple => Some("RL Simple"),
            Self::RlEval => Some("RL Eval"),
            Self::MlpN3p => Some("MLP-N3P"),
            Self::KnnN3p => Some("KNN-N3P"),
            Self::Policy | Self::N3p => None,
        }
    }

    /// Whether it searches a graph and learns nothing: the rows that speed-ups refer to.
    pub fn is_graph_search(self) -> bool {
        matches!(self, Self::Ha | Self::HaRs | Self::HaHold | Self::Mhha | Self::Sha)
    }

    /// Whether it needs a trained model, which is bound to its vehicle and those it covers.
    pub fn needs_model(self) -> bool {
        self.needs_selector() || self.course().is_some()
    }

    /// Whether it needs a selector of preparatory poses, trained from a data set.
    pub fn needs_selector(self) -> bool {
        matches!(self, Self::MlpN3p | Self::KnnN3p | Self::N3p)
    }

    /// Where its policy learns, for the methods of reinforcement learning.
    pub fn course(self) -> Option<Course> {
        match self {
            Self::RlSimple => Some(Course::Simple),
            Self::RlEval => Some(Course::Eval),
            _ => None,
        }
    }

    /// Every method that can be built from `models`.
    pub fn available(models: &Models) -> Vec<Method> {
        let settings = MethodSettings::default();
        Self::ALL.into_iter().filter(|m| m.build(models, &settings).is_ok()).collect()
    }

    /// The planner of a learnt method with the models of one vehicle, which hold what it needs.
    fn learnt(self, models: &VehicleModels, settings: &MethodSettings) -> Box<dyn Planner + Send> {
        let MethodSettings { planner: config, rl, .. } = settings;
        if let Some(actor) = self.course().and_then(|course| models.actor(course)) {
            let policy = ActorPolicy::new(actor.clone(), rl.choice);
            return Box::new(PolicyPlanner::new(self.name(), policy, *rl, *config));
        }
        let selector = models.selector(self).expect("models that serve the method");
        Box::new(self.guided(selector, settings))
    }

    /// The planner of this method with a selector.
    fn guided(self, selector: Arc<dyn PoseSelector>, settings: &MethodSettings) -> GuidedPlanner {
        let MethodSettings { planner: config, n3p, .. } = *settings;
        match self {
            Self::N3p => GuidedPlanner::ranked(self.name(), selector, config, n3p),
            _ => GuidedPlanner::paper(self.name(), selector, config),
        }
    }

    /// That there is no model, and how to get one.
    fn no_model(self) -> MethodError {
        let (model, example) = match (self, self.course()) {
            (_, Some(course)) => {
                return MethodError::NoTrainedPolicy { course: course.name() };
            }
            (Self::MlpN3p, _) => ("mlp", "mlp-TYPE.safetensors"),
            _ => ("knn", "knn.bin"),
        };
        MethodError::NoModel { method: self, model, example }
    }

    /// The planner of this method.
    pub fn build(
        self,
        models: &Models,
        settings: &MethodSettings,
    ) -> Result<Box<dyn Planner + Send>, MethodError> {
        let MethodSettings { planner: config, rl, .. } = settings;
        match self {
            Self::Ha => Ok(Box::new(PlainHybridAStar::new(*config))),
            Self::HaRs => Ok(Box::new(HybridAStar::new(*config))),
            Self::HaHold => Ok(Box::new(HybridAStar::hold(*config, HOLD_SOLUTIONS))),
            Self::Mhha => Ok(Box::new(MultiHeuristicHybridAStar::new(*config))),
            Self::Sha => Ok(Box::new(ScenarioHybridAStar::new(*config))),
            Self::KnnN3p | Self::MlpN3p | Self::N3p | Self::RlSimple | Self::RlEval => {
                let planners = models.for_method(self).map(|of_vehicle| {
                    let planner = self.learnt(of_vehicle, settings);
                    (*of_vehicle.vehicle(), planner)
                });
                let any = models.fleet(self).map(|selector| {
                    Box::new(self.guided(selector, settings)) as Box<dyn Planner + Send>
                });
                ByVehicle::new(planners.collect(), any).ok_or_else(|| self.no_model())
            }
            Self::Policy => {
                let source = models.outside_policy().ok_or(MethodError::NoPolicy)?;
                let policy = source.open().map_err(|e| MethodError::Policy(e.to_string()))?;
                Ok(Box::new(PolicyPlanner::new(self.name(), policy, *rl, *config)))
            }
        }
    }
}

impl FromStr for Method {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| UnknownName {
            what: "method",
            name: name.to_owned(),
            expected: "ha, ha-rs, ha-hold, mhha, sha, rl-simple, rl-eval, mlp-n3p, knn-n3p, \
                       policy, n3p",
        })
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl TryFrom<String> for Method {
    type Error = UnknownName;

    fn try_from(name: String) -> Result<Self, UnknownName> {
        name.parse()
    }
}

impl From<Method> for String {
    fn from(method: Method) -> String {
        method.name().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_round_and_unknown_ones_list_all() {
        for m in Method::ALL {
            assert_eq!(m.name().parse(), Ok(m));
        }
        let message = "a-star".parse::<Method>().unwrap_err().to_string();
        assert!(Method::ALL.iter().all(|m| message.contains(m.name())), "{message}");
    }

    #[test]
    fn without_a_model_the_error_says_what_to_do() {
        let build = |m: Method| m.build(&Models::default(), &MethodSettings::default());
        let message = build(Method::N3p).err().unwrap().to_string();
        assert!(message.contains("--model") && message.contains("n3p-train knn"), "{message}");
        let message = build(Method::RlEval).err().unwrap().to_string();
        assert!(message.contains("n3p-train rl --env eval"), "{message}");
        let message = build(Method::Policy).err().unwrap().to_string();
        assert!(message.contains("--policy FILE.onnx"), "{message}");
        let available = Method::available(&Models::default());
        assert_eq!(available, Method::ALL[..5]);
        assert!(available.iter().all(|m| m.is_graph_search()));
    }
}
