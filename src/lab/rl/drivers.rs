//! Policies as the planner's layer knows them: what makes a method's planner around itself.

use std::path::Path;
use std::sync::Arc;

use super::actor::{Actor, ActorPolicy};
use super::policy_file;
use super::rollout::PolicyPlanner;
use super::source::PolicySource;
use crate::n3p::{Driver, MethodSettings, TrainedPolicy};
use crate::planners::Planner;
use crate::selectors::artefact::ArtefactError;

/// Reads a policy that was trained here.
pub(crate) fn read_policy(path: &Path) -> Result<TrainedPolicy, ArtefactError> {
    let (header, actor) = policy_file::load(path)?;
    let (course, vehicle) = (header.course.name(), header.vehicle);
    Ok(TrainedPolicy { course, vehicle, driver: Arc::new(actor) })
}

/// Opens a policy from outside, once to see that it can be ([`PolicySource::new`]).
pub(crate) fn open_policy(spec: &str, limit_s: f64) -> Result<Arc<dyn Driver>, String> {
    let source = PolicySource::new(spec, limit_s).map_err(|e| e.to_string())?;
    Ok(Arc::new(source))
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
