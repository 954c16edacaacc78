//! The methods of the tables, by name.
//!
//! A method is one [`Entry`]: its names, and how its planner is made. To add one, write its planner
//! and put an entry into the list that it belongs to (`SEARCHES`, `PAPER`, `OURS`).

use std::fmt;
use std::hash::{Hash, Hasher};
use std::str::FromStr;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::RolloutConfig;
use super::by_vehicle::ByVehicle;
use super::guided::{GuidedPlanner, RankedConfig};
use super::models::{Models, VehicleModels};
use crate::planners::{
    HybridAStar, HybridAStarConfig, MultiHeuristicHybridAStar, PlainHybridAStar, Planner,
    ScenarioHybridAStar,
};
use crate::selectors::PoseSelector;
use crate::world::UnknownName;

/// A row of the paper's tables, or our own.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Method(&'static Entry);

/// What makes a method.
pub struct Entry {
    /// The name used in rows, files and on the command line.
    pub name: &'static str,
    /// The name in the paper's tables; `None` for our own rows.
    pub paper_name: Option<&'static str>,
    /// How its planner is made.
    pub make: Make,
}

/// How a method's planner is made, and of what.
pub enum Make {
    /// Of its settings alone: it searches a graph and learns nothing.
    Search(fn(&HybridAStarConfig) -> Boxed),
    /// With a selector of preparatory poses, trained from a data set.
    Guided(Learnt, fn(&str, Arc<dyn PoseSelector>, &MethodSettings) -> GuidedPlanner),
    /// Around a policy that learnt in the course of this name.
    Trained(&'static str),
    /// Around a policy from outside.
    Outside,
}

/// What a method's selector is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Learnt {
    /// The nearest neighbour.
    Knn,
    /// The network.
    Mlp,
    /// The nearest neighbour, or else the network.
    Either,
}

type Boxed = Box<dyn Planner + Send>;

/// How many solutions the paper's HA* Hold compares.
const HOLD_SOLUTIONS: usize = 5;

/// Graph searches.
const SEARCHES: &[Method] =
    &[Method::HA, Method::HA_RS, Method::HA_HOLD, Method::MHHA, Method::SHA];
/// The paper's policies.
const TRAINED: &[Method] = &[Method::RL_SIMPLE, Method::RL_EVAL];
/// The paper's N3P.
const PAPER: &[Method] = &[Method::MLP_N3P, Method::KNN_N3P];
/// Policies from elsewhere.
const OUTSIDE: &[Method] = &[Method::POLICY];
/// Our own.
const OURS: &[Method] = &[Method::N3P];

impl Method {
    /// Hybrid A* without Reeds-Shepp expansion.
    pub const HA: Self = Self(&Entry {
        name: "ha",
        paper_name: Some("HA*"),
        make: Make::Search(|config| Box::new(PlainHybridAStar::new(*config))),
    });
    /// Hybrid A* with Reeds-Shepp expansion.
    pub const HA_RS: Self = Self(&Entry {
        name: "ha-rs",
        paper_name: Some("HA* with RS"),
        make: Make::Search(|config| Box::new(HybridAStar::new(*config))),
    });
    /// The best of the first five solutions of Hybrid A*.
    pub const HA_HOLD: Self = Self(&Entry {
        name: "ha-hold",
        paper_name: Some("HA* Hold"),
        make: Make::Search(|config| Box::new(HybridAStar::hold(*config, HOLD_SOLUTIONS))),
    });
    /// Multi-heuristic A* over the hybrid lattice, with Reeds-Shepp expansion.
    pub const MHHA: Self = Self(&Entry {
        name: "mhha",
        paper_name: Some("MHHA*"),
        make: Make::Search(|config| Box::new(MultiHeuristicHybridAStar::new(*config))),
    });
    /// Hybrid A* to the end of a geometric exit manoeuvre (parallel only).
    pub const SHA: Self = Self(&Entry {
        name: "sha",
        paper_name: Some("SHA*"),
        make: Make::Search(|config| Box::new(ScenarioHybridAStar::new(*config))),
    });
    /// A policy that learnt in abstracted environments.
    pub const RL_SIMPLE: Self = Self(&Entry {
        name: "rl-simple",
        paper_name: Some("RL Simple"),
        make: Make::Trained("simple"),
    });
    /// A policy that learnt in generated scenes.
    pub const RL_EVAL: Self =
        Self(&Entry { name: "rl-eval", paper_name: Some("RL Eval"), make: Make::Trained("eval") });
    /// A policy from outside.
    pub const POLICY: Self = Self(&Entry { name: "policy", paper_name: None, make: Make::Outside });
    /// The paper's N3P with a pose from the MLP.
    pub const MLP_N3P: Self = Self(&Entry {
        name: "mlp-n3p",
        paper_name: Some("MLP-N3P"),
        make: Make::Guided(Learnt::Mlp, |n, s, c| GuidedPlanner::paper(n, s, c.planner)),
    });
    /// The paper's N3P with a pose from KNN.
    pub const KNN_N3P: Self = Self(&Entry {
        name: "knn-n3p",
        paper_name: Some("KNN-N3P"),
        make: Make::Guided(Learnt::Knn, |n, s, c| GuidedPlanner::paper(n, s, c.planner)),
    });
    /// Our N3P: known manoeuvres and ranked candidates, no search where curves suffice.
    pub const N3P: Self = Self(&Entry {
        name: "n3p",
        paper_name: None,
        make: Make::Guided(Learnt::Either, |n, s, c| GuidedPlanner::ranked(n, s, c.planner, c.n3p)),
    });

    /// All methods, in the order of the paper's tables, ours last.
    pub fn all() -> impl Iterator<Item = Method> {
        [SEARCHES, TRAINED, PAPER, OUTSIDE, OURS].into_iter().flatten().copied()
    }

    /// The name used in rows, files and on the command line.
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// The name in the paper's tables; `None` for our own rows.
    pub fn paper_name(self) -> Option<&'static str> {
        self.0.paper_name
    }

    /// Whether it searches a graph and learns nothing: the rows that speed-ups refer to.
    pub fn is_graph_search(self) -> bool {
        matches!(self.0.make, Make::Search(_))
    }

    /// Whether it needs a trained model, which is bound to its vehicle and those it covers.
    pub fn needs_model(self) -> bool {
        self.needs_selector() || self.course().is_some()
    }

    /// Whether it needs a selector of preparatory poses, trained from a data set.
    pub fn needs_selector(self) -> bool {
        self.learnt().is_some()
    }

    /// Its selector, for methods that need one.
    pub fn learnt(self) -> Option<Learnt> {
        match self.0.make {
            Make::Guided(learnt, _) => Some(learnt),
            _ => None,
        }
    }

    /// The course that its policy learnt in, for methods of reinforcement learning.
    pub fn course(self) -> Option<&'static str> {
        match self.0.make {
            Make::Trained(course) => Some(course),
            _ => None,
        }
    }

    /// Whether it drives step by step.
    pub fn is_policy(self) -> bool {
        matches!(self.0.make, Make::Trained(_) | Make::Outside)
    }

    /// Every method that can be built from `models`.
    pub fn available(models: &Models) -> Vec<Method> {
        let settings = MethodSettings::default();
        Self::all().filter(|m| m.build(models, &settings).is_ok()).collect()
    }

    /// The planner of this method.
    pub fn build(self, models: &Models, settings: &MethodSettings) -> Result<Boxed, MethodError> {
        match self.0.make {
            Make::Search(make) => Ok(make(&settings.planner)),
            Make::Outside => {
                let driver = models.outside_policy().ok_or(MethodError::NoPolicy)?;
                driver.planner(self.name(), settings).map_err(MethodError::Policy)
            }
            Make::Guided(..) | Make::Trained(_) => {
                let planner =
                    |own: &VehicleModels| Ok((*own.vehicle(), self.with(own, models, settings)?));
                let planners = models.for_method(self).map(planner).collect::<Result<_, _>>()?;
                let any =
                    models.fleet(self).map(|selector| self.guided(selector, models, settings));
                ByVehicle::new(planners, any).ok_or_else(|| self.no_model())
            }
        }
    }

    /// The planner of a learnt method with the models of one vehicle, which hold what it needs.
    fn with(
        self,
        own: &VehicleModels,
        models: &Models,
        settings: &MethodSettings,
    ) -> Result<Boxed, MethodError> {
        if let Some(driver) = self.course().and_then(|course| own.driver(course)) {
            return driver.planner(self.name(), settings).map_err(MethodError::Policy);
        }
        let selector = own.selector(self).expect("models that serve the method");
        Ok(self.guided(selector, models, settings))
    }

    /// The planner of a guided method with its selector.
    fn guided(
        self,
        selector: Arc<dyn PoseSelector>,
        models: &Models,
        settings: &MethodSettings,
    ) -> Boxed {
        let Make::Guided(_, make) = self.0.make else { unreachable!("only these have selectors") };
        let foresight = models.foresight().filter(|_| settings.n3p.foresight);
        Box::new(make(self.name(), selector, settings).with_foresight(foresight.cloned()))
    }

    /// That there is no model, and how to get one.
    fn no_model(self) -> MethodError {
        let (model, example) = match (self.course(), self.learnt()) {
            (Some(course), _) => return MethodError::NoTrainedPolicy { course },
            (_, Some(Learnt::Mlp)) => ("mlp", "mlp-TYPE.safetensors"),
            _ => ("knn", "knn.bin"),
        };
        MethodError::NoModel { method: self, model, example }
    }
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
    /// A policy cannot be started.
    #[error("--policy: {0}")]
    Policy(String),
}

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

impl PartialEq for Method {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Method {}

impl Hash for Method {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name().hash(state);
    }
}

impl fmt::Debug for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Method({})", self.name())
    }
}

impl FromStr for Method {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::all().find(|m| m.name() == name).ok_or_else(|| UnknownName {
            what: "method",
            name: name.to_owned(),
            expected: Self::all().map(Self::name).collect::<Vec<_>>().join(", "),
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
        for m in Method::all() {
            assert_eq!(m.name().parse(), Ok(m));
        }
        let message = "a-star".parse::<Method>().unwrap_err().to_string();
        assert!(Method::all().all(|m| message.contains(m.name())), "{message}");
    }

    #[test]
    fn without_a_model_the_error_says_what_to_do() {
        let build = |m: &str| {
            let method: Method = m.parse().unwrap();
            method.build(&Models::default(), &MethodSettings::default()).err().unwrap().to_string()
        };
        let message = build("n3p");
        assert!(message.contains("--model") && message.contains("n3p-train knn"), "{message}");
        for (method, part) in
            [("rl-eval", "n3p-train rl --env eval"), ("policy", "--policy FILE.onnx")]
        {
            assert!(build(method).contains(part), "{}", build(method));
        }
        let available = Method::available(&Models::default());
        assert_eq!(available, SEARCHES);
        assert!(available.iter().all(|m| m.is_graph_search()));
    }
}
