//! Policies, which the laboratory has: the one place that looks up at it.

#[cfg(feature = "lab")]
pub(crate) use crate::lab::rl::drivers::{open_policy, read_policy};

#[cfg(all(feature = "plan", not(feature = "lab")))]
pub(crate) use without::open_policy;
#[cfg(not(feature = "lab"))]
pub(crate) use without::read_policy;

/// A build of the planner alone drives with no policy.
#[cfg(not(feature = "lab"))]
mod without {
    use std::path::Path;

    use crate::n3p::TrainedPolicy;
    use crate::selectors::artefact::{ArtefactError, Fault};

    pub fn read_policy(path: &Path) -> Result<TrainedPolicy, ArtefactError> {
        Err(Fault::NoPolicies.of(path))
    }

    #[cfg(feature = "plan")]
    pub fn open_policy(
        _spec: &str,
        _limit_s: f64,
    ) -> Result<std::sync::Arc<dyn crate::n3p::Driver>, String> {
        let text =
            "--policy: this program was built without policies; build it with --features lab";
        Err(text.to_owned())
    }
}
