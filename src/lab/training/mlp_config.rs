//! Settings of the network's training.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::TrainingError;
use super::settings::{self, real, whole};
use crate::toml_file::Setting;

/// How far off an output is, per normalised component.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// Squared error: tends to the mean of several good answers.
    Mse,
    /// Squared up to [`MlpConfig::huber_delta`], then linear: tends to the median, so that
    /// the more frequent of two good answers wins.
    Huber,
}

/// How the learning rate falls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Schedule {
    /// Half a cosine over all epochs, from the full rate to a hundredth of it.
    Cosine,
    /// Divided by ten after half and again after three quarters of the epochs.
    Step,
}

/// Which preparatory pose is learnt for a start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Targets {
    /// The sample's own.
    Stored,
    /// One for all starts of the cell, chosen for short paths and little search.
    PerCell,
}

/// What is kept from training to validate with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Validation {
    /// Some starts in every cell: what planning asks, for its cells are those of the grid.
    Starts,
    /// Whole cells: how well the network carries over to environments never seen.
    Cells,
}

/// Settings of the training. The network itself is the paper's and fixed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MlpConfig {
    /// Passes over the training rows at most.
    pub epochs: usize,
    /// Rows per step.
    pub batch: usize,
    /// Learning rate of AdamW at the start.
    pub learning_rate: f64,
    /// Decoupled weight decay of AdamW.
    pub weight_decay: f64,
    /// How the learning rate falls.
    pub schedule: Schedule,
    /// The loss.
    pub loss: Loss,
    /// Where the Huber loss turns linear, in standard deviations of the outputs.
    pub huber_delta: f64,
    /// Epochs without a better validation loss after which training ends.
    pub patience: usize,
    /// Which preparatory pose is learnt.
    pub targets: Targets,
    /// With one target per cell: every other row gets a new start behind the cell's lane, up to
    /// this far, metres; 0 leaves all samples theirs.
    pub behind: f64,
    /// What is kept for validation.
    pub validation: Validation,
    /// Share of the starts or cells kept for validation.
    pub validation_share: f64,
    /// Seed of initial weights, shuffling and validation cells.
    pub seed: u64,
}

impl Schedule {
    /// The share of the full rate when so much of the training is done, 0 to 1.
    pub(in crate::lab::training) fn share(self, done: f64) -> f64 {
        const LEAST: f64 = 0.01;
        match self {
            Schedule::Cosine => {
                LEAST + (1.0 - LEAST) * (1.0 + (std::f64::consts::PI * done).cos()) / 2.0
            }
            Schedule::Step if done < 0.5 => 1.0,
            Schedule::Step if done < 0.75 => 0.1,
            Schedule::Step => 0.01,
        }
    }
}

impl Default for MlpConfig {
    fn default() -> Self {
        Self {
            epochs: 30,
            batch: 256,
            learning_rate: 1e-3,
            weight_decay: 1e-4,
            schedule: Schedule::Cosine,
            loss: Loss::Huber,
            huber_delta: 0.1,
            patience: 30,
            targets: Targets::PerCell,
            behind: 8.0,
            validation: Validation::Starts,
            validation_share: 0.1,
            seed: 1,
        }
    }
}

impl MlpConfig {
    /// Reads a TOML file, or the defaults, with the settings of `set` instead of theirs, and checks
    /// them; absent settings keep their defaults.
    pub fn read(file: Option<&Path>, set: &[Setting]) -> Result<Self, TrainingError> {
        settings::read(file, set, Self::validate)
    }

    /// Checks every setting.
    pub fn validate(&self) -> Result<(), TrainingError> {
        whole("epochs", self.epochs, 100_000, "a whole number from 1 to 100000")?;
        whole("batch", self.batch, 65_536, "a whole number from 1 to 65536")?;
        whole("patience", self.patience, 100_000, "a whole number from 1 to 100000")?;
        real("learning_rate", self.learning_rate, 1e-8..=1.0, "a number from 1e-8 to 1")?;
        real("weight_decay", self.weight_decay, 0.0..=1.0, "a number from 0 to 1")?;
        real("huber_delta", self.huber_delta, 1e-4..=100.0, "a number from 1e-4 to 100")?;
        real("behind", self.behind, 0.0..=100.0, "a number from 0 to 100")?;
        real("validation_share", self.validation_share, 0.01..=0.5, "a number from 0.01 to 0.5")
    }

    /// The learning rate of an epoch, counted from 0.
    pub fn rate(&self, epoch: usize) -> f64 {
        self.learning_rate * self.schedule.share(epoch as f64 / self.epochs as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_which_setting_is_wrong() {
        assert!(MlpConfig::default().validate().is_ok());
        let config = MlpConfig { learning_rate: f64::NAN, ..MlpConfig::default() };
        let error = config.validate().unwrap_err().to_string();
        assert!(error.starts_with("learning_rate is NaN; expected"), "{error}");
    }

    #[test]
    fn a_bad_file_is_named_with_line_and_key() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("mlp.toml");
        for (text, told) in [
            ("epochs = 3\nepoch = 4", "mlp.toml: line 2 (`epoch = 4`): unknown field `epoch`"),
            ("loss = \"l3\"", "unknown variant `l3`"),
            ("batch = 0", "mlp.toml: batch is 0; expected"),
            ("batch = ", "mlp.toml: line 1 (`batch =`):"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = MlpConfig::read(Some(&path), &[]).unwrap_err().to_string();
            assert!(error.contains(told) && !error.contains('\n'), "{error}");
        }
        std::fs::write(&path, "loss = \"mse\"").unwrap();
        assert_eq!(MlpConfig::read(Some(&path), &[]).unwrap().loss, Loss::Mse);
    }

    #[test]
    fn both_schedules_end_at_a_hundredth() {
        for schedule in [Schedule::Cosine, Schedule::Step] {
            let config = MlpConfig { schedule, epochs: 1000, ..MlpConfig::default() };
            assert_eq!(config.rate(0), config.learning_rate);
            assert!((config.rate(999) / config.learning_rate - 0.01).abs() < 1e-4);
        }
    }
}
