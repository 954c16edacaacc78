//! Rows of a data set → model files.
//!
//! [`knn`] stores samples and a [`library`] of their manoeuvres and of those of many [`worlds`]; [`mlp`] trains a network
//! (`targets` says what it is to learn, `regression` fits it). Both take samples and metadata of
//! one data set; [`fleet`] does both for the data sets of several vehicles.
//! [`foresight`] learns in generated scenes what manoeuvres are worth; [`onnx`] writes networks for other runtimes. All write an artefact
//! that [`crate::selectors`] loads. Beside it they leave what programs
//! and people want to know of it: a log ([`log_path`]), with its [`quality`], and a model card
//! ([`card_path`]). While they train they tell what they do, line by line ([`watch`]).

mod card;
pub mod curve;
pub mod fleet;
pub mod foresight;
pub mod knn;
mod leave_one_out;
pub mod library;
pub mod mlp;
mod mlp_config;
pub mod onnx;
pub mod quality;
mod regression;
pub mod rl;
mod settings;
mod targets;
pub mod watch;
pub mod worlds;

pub use mlp_config::{Loss, MlpConfig, Schedule, Targets, Validation};

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::lab::dataset::{Sample, Status};
use crate::selectors::artefact::{self, ArtefactError};
use crate::toml_file::TomlError;
use crate::world::ParkingType;
use crate::world::generate::GeneratorError;

/// A training that cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// Nothing to learn from.
    #[error("the data set has no solved sample of type {0}; collect some: n3p-collect --type {0}")]
    NoSamples(ParkingType),
    /// No scene to learn from.
    #[error("no world drawn has room for the vehicle; ask for more worlds")]
    NoWorlds,
    /// Too few to train and validate.
    #[error("the data set has {samples} solved samples of type {kind}; at least {needed} needed")]
    TooFew {
        /// The parking type.
        kind: ParkingType,
        /// Solved samples found.
        samples: usize,
        /// The least number.
        needed: usize,
    },
    /// A sample that cannot be.
    #[error("sample {sample} of {kind} cell {cell}: {problem}; the data set is damaged")]
    BadSample {
        /// The parking type.
        kind: ParkingType,
        /// Index of the cell.
        cell: u32,
        /// Index of the sample in its cell.
        sample: u32,
        /// What is wrong.
        problem: &'static str,
    },
    /// A file of settings that cannot be read, or is no TOML of these settings.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A file with a setting outside its range.
    #[error("{}: {problem}", .path.display())]
    ConfigFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// A setting outside its range.
    #[error("{field} is {value}; expected {expected}")]
    Config {
        /// Name of the setting.
        field: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// The loss left the numbers.
    #[error("the training loss became {loss} in epoch {epoch}; try a smaller learning_rate")]
    Diverged {
        /// The epoch, from 1.
        epoch: usize,
        /// The loss.
        loss: f32,
    },
    /// A checkpoint where a training is to begin anew.
    #[error(
        "{}: a checkpoint is here already: go on from it with --resume, remove it, or choose \
         another --out", .0.display()
    )]
    CheckpointInTheWay(PathBuf),
    /// A checkpoint of a training with other settings.
    #[error(
        "{}: the checkpoint is of a training with other settings; give the same settings (only \
         episodes may differ), or choose another --out", .0.display()
    )]
    OtherCheckpoint(PathBuf),
    /// A vehicle that does not fit the spots to learn in.
    #[error("vehicle: no problems for this vehicle: {0}")]
    Vehicle(GeneratorError),
    /// A checkpoint whose policy is gone.
    #[error(
        "{}: no such file, but its checkpoint is here; put the policy back, or remove the \
         checkpoint to begin anew", .0.display()
    )]
    PolicyGone(PathBuf),
    /// A checkpoint that cannot be read.
    #[error("{0}")]
    Checkpoint(ArtefactError),
    /// A training that ended before anything was learnt.
    #[error("all episodes went by while warming up; expected more episodes or a smaller warm_up")]
    OnlyWarmUp,
    /// The model file.
    #[error(transparent)]
    Artefact(#[from] ArtefactError),
    /// The tensor library.
    #[error("tensor computation failed: {0}")]
    Candle(#[from] candle_core::Error),
    /// The picture of the loss.
    #[error("cannot draw the loss curve: {0}")]
    Curve(String),
}

impl TrainingError {
    /// Whether other data or settings would help, as against our bug or the disk.
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Artefact(_) | Self::Candle(_) | Self::Curve(_))
    }
}

/// Keeps candle to one thread unless `RAYON_NUM_THREADS` says otherwise: its pool waits
/// actively, and at this network's size more threads are slower.
///
/// This variable is the only setting that both its matrix products and its own pool obey; they do
/// not ask rayon's global pool.
///
/// # Safety
///
/// No other thread may be running: another one could read the environment while it changes. To be
/// called first thing in `main`.
pub unsafe fn single_threaded() {
    const THREADS: &str = "RAYON_NUM_THREADS";
    if std::env::var_os(THREADS).is_none() {
        // SAFETY: the caller vouches for it.
        unsafe { std::env::set_var(THREADS, "1") };
    }
}

/// The training log of the model `out`: `.training.json` in place of its extension.
pub fn log_path(out: &Path) -> PathBuf {
    out.with_extension("training.json")
}

/// The model card of the model `out`: `.card.md` in place of its extension.
pub fn card_path(out: &Path) -> PathBuf {
    out.with_extension("card.md")
}

/// Writes log and card of the model `out`.
fn write_beside(out: &Path, log: &impl Serialize, card: String) -> Result<(), TrainingError> {
    let mut json = serde_json::to_string_pretty(log).expect("a log is plain data");
    json.push('\n');
    artefact::write(&log_path(out), json.as_bytes())?;
    Ok(artefact::write(&card_path(out), card.as_bytes())?)
}

/// The solved samples of a type, by cell and then by index, whatever the order of `samples`.
fn solved(
    samples: &[Sample],
    kind: ParkingType,
    cells: usize,
) -> Result<Vec<&Sample>, TrainingError> {
    let wanted = |s: &&Sample| s.cell.kind() == kind && s.status == Status::Solved;
    let mut solved: Vec<&Sample> = samples.iter().filter(wanted).collect();
    solved.sort_by_key(|s| (s.cell_index, s.sample_index));
    for s in &solved {
        let problem = if !s.start.is_finite() {
            "its start is not finite"
        } else if !s.rs_start.is_finite() {
            "it is solved, but its rs_start is not finite"
        } else if s.cell_index as usize >= cells {
            "its cell is not in the grid"
        } else {
            continue;
        };
        let (cell, sample) = (s.cell_index, s.sample_index);
        return Err(TrainingError::BadSample { kind, cell, sample, problem });
    }
    Ok(solved)
}
