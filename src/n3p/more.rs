//! What the laboratory adds to the methods: the one place that looks up at it.

#[cfg(feature = "lab")]
pub(super) use crate::lab::rl::methods::{OUTSIDE, TRAINED, read_policy};

#[cfg(not(feature = "lab"))]
pub(super) use without::{OUTSIDE, TRAINED, read_policy};

/// A build of the planner alone drives with no policy.
#[cfg(not(feature = "lab"))]
mod without {
    use std::path::Path;

    use crate::n3p::{Method, TrainedPolicy};
    use crate::selectors::artefact::{ArtefactError, Fault};

    pub const TRAINED: &[Method] = &[];
    pub const OUTSIDE: &[Method] = &[];

    pub fn read_policy(path: &Path) -> Result<TrainedPolicy, ArtefactError> {
        Err(Fault::NoPolicies.of(path))
    }
}
