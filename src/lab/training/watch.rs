//! What a training does, for programs that watch it: one JSON object in a line for each epoch or point.
//!
//! The lines lie beside the model ([`path`]), are written while the training goes on, and are begun anew
//! with it. They say seconds, so two trainings leave different ones; logs and cards do not.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use crate::selectors::artefact::{ArtefactError, Fault};

/// The lines of the model `out`: `.training.jsonl` in place of its extension.
pub fn path(out: &Path) -> PathBuf {
    out.with_extension("training.jsonl")
}

/// A file of lines.
pub(super) struct Watch {
    path: PathBuf,
    file: File,
    begin: Instant,
}

/// A line, and when it was written.
#[derive(Serialize)]
struct Line<'a, T> {
    /// Seconds since the training began, or went on.
    seconds: f64,
    #[serde(flatten)]
    what: &'a T,
}

impl Watch {
    /// Begins the lines of the model `out`, making its folder; `resume` keeps those of before.
    pub fn begin(out: &Path, resume: bool) -> Result<Self, ArtefactError> {
        let path = path(out);
        let folder = crate::files::folder_of(&path);
        let mut options = OpenOptions::new();
        options.create(true).write(true).append(resume).truncate(!resume);
        let file = std::fs::create_dir_all(folder).and_then(|()| options.open(&path));
        match file {
            Ok(file) => Ok(Self { path, file, begin: Instant::now() }),
            Err(error) => Err(ArtefactError { path, fault: Fault::Unwritable(error) }),
        }
    }

    /// Writes a line.
    pub fn tell(&mut self, what: &impl Serialize) -> Result<(), ArtefactError> {
        let seconds = self.begin.elapsed().as_secs_f64();
        let mut line = serde_json::to_vec(&Line { seconds, what }).expect("plain data");
        line.push(b'\n');
        let written = self.file.write_all(&line);
        written.map_err(|error| ArtefactError {
            path: self.path.clone(),
            fault: Fault::Unwritable(error),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_for_each_and_those_of_before_where_it_goes_on() {
        #[derive(Serialize)]
        struct Epoch {
            epoch: usize,
        }
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("new/m.safetensors");
        for (resume, expected) in [(false, 2), (true, 4), (false, 2)] {
            let mut watch = Watch::begin(&out, resume).unwrap();
            (1..=2).for_each(|epoch| watch.tell(&Epoch { epoch }).unwrap());
            let text = std::fs::read_to_string(path(&out)).unwrap();
            let lines: Vec<serde_json::Value> =
                text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
            assert_eq!(lines.len(), expected);
            assert_eq!(lines[expected - 1]["epoch"], 2);
            assert!(lines[0]["seconds"].is_f64());
        }
        assert!(Watch::begin(&dir.path().join("new/m.training.jsonl/x"), false).is_err());
    }
}
