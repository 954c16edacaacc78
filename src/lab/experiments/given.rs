//! What an experiment takes as it is instead of making it, checked before anything is written.

use std::path::{Path, PathBuf};

use super::config::ExperimentConfig;
use super::runner::ExperimentError;
use super::stages::settings;
use crate::files::sha256_hex;
use crate::lab::dataset::read::{read_manifest, read_metadata};

/// Data set or models that need not be made.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// Folder of the data set, collected with the experiment's settings.
    pub data: Option<PathBuf>,
    /// Folder of the models, with the names that an experiment gives them. Nothing is collected
    /// or trained; of the learning curve, the results' folder may hold the points already.
    pub models: Option<PathBuf>,
    /// Folder of the policies, where only these are not to be trained.
    pub policies: Option<PathBuf>,
}

impl Given {
    /// Refuses what the experiment has no use for.
    pub(super) fn check(&self, config: &ExperimentConfig) -> Result<(), ExperimentError> {
        let useless = |option| Err(ExperimentError::Useless { option });
        if self.data.is_some() && !config.learns() {
            return useless("--data");
        }
        let has_policies = config.courses().next().is_some();
        if self.models.is_some() && !config.plans_with_models() && !has_policies {
            return useless("--models");
        }
        if self.policies.is_some() && !has_policies {
            return useless("--policies");
        }
        Ok(())
    }
}

/// Checks that the data set in `folder` is the one that `config` describes; what identifies it.
pub(super) fn data(config: &ExperimentConfig, folder: &Path) -> Result<String, ExperimentError> {
    let found = read_metadata(folder).map_err(ExperimentError::GivenData)?;
    if let Some(d) = found.content_difference(&config.collect.metadata()) {
        let (path, field, found, wanted) = (folder.to_owned(), d.field, d.stored, d.current);
        return Err(ExperimentError::OtherData { path, field, found, wanted });
    }
    let mut sums = Vec::new();
    for &kind in &config.evaluate.types {
        let manifest = read_manifest(folder, &found, kind).map_err(ExperimentError::GivenData)?;
        sums.extend(manifest.shards.into_iter().map(|shard| shard.sha256));
    }
    Ok(settings(("given", sums)))
}

/// SHA-256 of model files, in their order.
pub(super) fn checksums(files: &[PathBuf]) -> Result<Vec<String>, ExperimentError> {
    let sum = |path: &PathBuf| match std::fs::read(path) {
        Ok(bytes) => Ok(sha256_hex(&[&bytes])),
        Err(error) => Err(ExperimentError::Io { path: path.clone(), error }),
    };
    files.iter().map(sum).collect()
}
