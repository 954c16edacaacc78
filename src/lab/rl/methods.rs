//! The methods that drive step by step, and their policies as the planner's layer knows them.

use std::path::Path;
use std::sync::Arc;

use super::actor::{Actor, ActorPolicy};
use super::courses::Course;
use super::policy_file;
use super::rollout::PolicyPlanner;
use super::source::PolicySource;
use crate::n3p::method::{Entry, Make};
use crate::n3p::{Driver, Method, MethodSettings, TrainedPolicy};
use crate::planners::Planner;
use crate::selectors::artefact::ArtefactError;

/// A policy that learnt in abstracted environments.
pub const RL_SIMPLE: Method = Method::new(&Entry {
    name: "rl-simple",
    paper_name: Some("RL Simple"),
    make: Make::Trained(Course::Simple.name()),
});
/// A policy that learnt in generated scenes.
pub const RL_EVAL: Method = Method::new(&Entry {
    name: "rl-eval",
    paper_name: Some("RL Eval"),
    make: Make::Trained(Course::Eval.name()),
});
/// A policy from outside.
pub const POLICY: Method =
    Method::new(&Entry { name: "policy", paper_name: None, make: Make::Outside });

/// The paper's policies.
pub(crate) const TRAINED: &[Method] = &[RL_SIMPLE, RL_EVAL];
/// Policies from elsewhere.
pub(crate) const OUTSIDE: &[Method] = &[POLICY];

/// Reads a policy that was trained here.
pub(crate) fn read_policy(path: &Path) -> Result<TrainedPolicy, ArtefactError> {
    let (header, actor) = policy_file::load(path)?;
    let (course, vehicle) = (header.course.name(), header.vehicle);
    Ok(TrainedPolicy { course, vehicle, driver: Arc::new(actor) })
}

impl Driver for Actor {
    fn planner(
        &self,
        name: &'static str,
        settings: &MethodSettings,
    ) -> Result<Box<dyn Planner + Send>, String> {
        let MethodSettings { planner, rl, .. } = settings;
        let policy = ActorPolicy::new(self.clone(), rl.choice);
        Ok(Box::new(PolicyPlanner::new(name, policy, *rl, *planner)))
    }
}

impl Driver for PolicySource {
    fn planner(
        &self,
        name: &'static str,
        settings: &MethodSettings,
    ) -> Result<Box<dyn Planner + Send>, String> {
        let MethodSettings { planner, rl, .. } = settings;
        let policy = self.open().map_err(|e| e.to_string())?;
        Ok(Box::new(PolicyPlanner::new(name, policy, *rl, *planner)))
    }
}
