//! Where a policy from outside comes from.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::Policy;
use super::onnx::{OnnxError, OnnxPolicy};
use super::process::{ProcessError, ProcessPolicy};

/// A policy from outside, to be opened as often as there are threads.
#[derive(Clone, Debug)]
pub enum PolicySource {
    /// An ONNX file.
    Onnx(PathBuf),
    /// A program.
    Program {
        /// Its command line.
        command: String,
        /// How long an answer may take.
        limit: Duration,
    },
}

/// A policy from outside that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The ONNX file.
    #[error(transparent)]
    Onnx(#[from] OnnxError),
    /// The program.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// A policy trained here.
    #[error("policy {}: it was trained by n3p-train; give it with --model", .0.display())]
    TrainedHere(PathBuf),
}

impl PolicySource {
    /// What ends in `.onnx` is a file, anything else a command line, whose answers may take
    /// `limit_s` seconds each. It is opened once, to see that it can be.
    pub fn new(spec: &str, limit_s: f64) -> Result<Self, SourceError> {
        // A command may name such a file, too.
        let one_word = Path::new(spec).is_file() || !spec.contains(char::is_whitespace);
        let ends_in = |extension| {
            let own = Path::new(spec).extension();
            one_word && own.is_some_and(|e| e.eq_ignore_ascii_case(extension))
        };
        if ends_in("safetensors") {
            return Err(SourceError::TrainedHere(spec.into()));
        }
        let source = if ends_in("onnx") {
            Self::Onnx(spec.into())
        } else {
            let (command, limit) = (spec.to_owned(), Duration::from_secs_f64(limit_s));
            Self::Program { command, limit }
        };
        source.open()?;
        Ok(source)
    }

    /// Loads the file or starts the program.
    pub fn open(&self) -> Result<Box<dyn Policy + Send>, SourceError> {
        Ok(match self {
            Self::Onnx(path) => Box::new(OnnxPolicy::load(path)?),
            Self::Program { command, limit } => Box::new(ProcessPolicy::start(command, *limit)?),
        })
    }
}
