//! Which stages of an experiment are done: `stages/NAME.json` in the results' folder.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::files::{sha256_hex, write_whole};
use crate::lab::dataset::schema::GIT_REVISION;

/// The records of one results' folder.
pub(super) struct Stages {
    folder: PathBuf,
}

/// The record of a stage.
#[derive(PartialEq, Serialize, Deserialize)]
struct Stage {
    /// Over everything that decides the stage's output, builds aside.
    settings_sha256: String,
    /// The build that began it.
    git_revision: String,
    finished: bool,
}

/// What to do with a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Todo {
    /// It is finished.
    Nothing,
    /// This build began it, with the same settings.
    GoOn,
    /// It was never begun, or with other settings, or by another build.
    BeginAnew,
}

/// Where a record cannot be written.
pub(super) type Failure = (PathBuf, std::io::Error);

impl Stages {
    pub fn new(out: &Path) -> Self {
        Self { folder: out.join("stages") }
    }

    /// Compares a stage's record with `settings`, and records that it begins. A finished stage
    /// whose output is not `present` begins anew.
    pub fn begin(&self, stage: &str, settings: &str, present: bool) -> Result<Todo, Failure> {
        let record = std::fs::read(self.path(stage))
            .ok()
            .and_then(|bytes| serde_json::from_slice::<Stage>(&bytes).ok())
            .filter(|s| s.settings_sha256 == settings);
        let todo = match record {
            Some(s) if s.finished && present => Todo::Nothing,
            Some(s) if !s.finished && s.git_revision == GIT_REVISION => Todo::GoOn,
            _ => Todo::BeginAnew,
        };
        match todo {
            Todo::Nothing => log::info!("{stage}: finished before, nothing to do"),
            _ => self.record(stage, settings, false)?,
        }
        Ok(todo)
    }

    /// Records that a stage is finished.
    pub fn finish(&self, stage: &str, settings: &str) -> Result<(), Failure> {
        self.record(stage, settings, true)
    }

    fn record(&self, stage: &str, settings: &str, finished: bool) -> Result<(), Failure> {
        let (settings_sha256, git_revision) = (settings.to_owned(), GIT_REVISION.to_owned());
        let record = Stage { settings_sha256, git_revision, finished };
        let json = serde_json::to_string_pretty(&record).expect("plain data") + "\n";
        let path = self.path(stage);
        write_whole(&path, json.as_bytes()).map_err(|error| (path, error))
    }

    fn path(&self, stage: &str) -> PathBuf {
        self.folder.join(format!("{stage}.json"))
    }
}

/// A checksum over settings.
pub(super) fn settings(parts: impl Serialize) -> String {
    let json = serde_json::to_vec(&parts).expect("settings are plain values");
    sha256_hex(&[&json])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_is_done_once_for_its_settings() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("stages")).unwrap();
        let stages = Stages::new(dir.path());
        let (a, b) = (settings(("train", 1)), settings(("train", 2)));
        assert_eq!(stages.begin("train", &a, true).unwrap(), Todo::BeginAnew);
        assert_eq!(stages.begin("train", &a, true).unwrap(), Todo::GoOn);
        stages.finish("train", &a).unwrap();
        assert_eq!(stages.begin("train", &a, true).unwrap(), Todo::Nothing);
        assert_eq!(stages.begin("train", &a, false).unwrap(), Todo::BeginAnew, "output is gone");
        assert_eq!(stages.begin("train", &a, true).unwrap(), Todo::GoOn, "and being redone");
        assert_eq!(stages.begin("train", &b, true).unwrap(), Todo::BeginAnew, "other settings");
        std::fs::write(dir.path().join("stages/train.json"), "{").unwrap();
        assert_eq!(stages.begin("train", &a, true).unwrap(), Todo::BeginAnew, "a damaged record");
    }
}
