//! Settings of the training of foresight.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::lab::training::settings::{self, real, whole};
use crate::lab::training::{Schedule, TrainingError};
use crate::toml_file::Setting;

/// Settings of the training. Every one may be left out of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ForesightConfig {
    /// Worlds of each parking type for a vehicle that a model was trained for.
    pub worlds: usize,
    /// The same for each vehicle of a model for any vehicle.
    pub fleet_worlds: usize,
    /// Share of worlds in which the car begins somewhere along a plan.
    pub on_the_way: f64,
    /// Passes over the examples.
    pub epochs: usize,
    /// Examples per step.
    pub batch: usize,
    /// Learning rate of AdamW at the start; it falls by half a cosine to a hundredth.
    pub learning_rate: f64,
    /// Decoupled weight decay of AdamW.
    pub weight_decay: f64,
    /// Manoeuvres that cost so many turning radii more than the best one are wanted 1/e as much.
    pub temperature: f64,
    /// By how much the error of the foreseen cost counts beside that of the ranking.
    pub value_weight: f64,
    /// Examples to validate with for every one learnt from.
    pub validation_share: f64,
    /// Seed of worlds, weights and shuffling.
    pub seed: u64,
}

impl Default for ForesightConfig {
    fn default() -> Self {
        Self {
            worlds: 30_000,
            fleet_worlds: 4_000,
            on_the_way: 0.25,
            epochs: 24,
            batch: 128,
            learning_rate: 2e-3,
            weight_decay: 1e-4,
            temperature: 0.1,
            value_weight: 4.0,
            validation_share: 0.1,
            seed: 2,
        }
    }
}

impl ForesightConfig {
    /// Reads a TOML file, or the defaults, with the settings of `set` instead of theirs, and checks
    /// them; absent settings keep their defaults.
    pub fn read(file: Option<&Path>, set: &[Setting]) -> Result<Self, TrainingError> {
        settings::read(file, set, Self::validate)
    }

    /// Checks every setting.
    pub fn validate(&self) -> Result<(), TrainingError> {
        whole("worlds", self.worlds, 1_000_000, "a whole number from 1 to 1000000")?;
        whole("fleet_worlds", self.fleet_worlds, 1_000_000, "a whole number from 1 to 1000000")?;
        whole("epochs", self.epochs, 100_000, "a whole number from 1 to 100000")?;
        whole("batch", self.batch, 65_536, "a whole number from 1 to 65536")?;
        real("on_the_way", self.on_the_way, 0.0..=1.0, "a number from 0 to 1")?;
        real("learning_rate", self.learning_rate, 1e-8..=1.0, "a number from 1e-8 to 1")?;
        real("weight_decay", self.weight_decay, 0.0..=1.0, "a number from 0 to 1")?;
        real("temperature", self.temperature, 1e-3..=100.0, "a number from 0.001 to 100")?;
        real("value_weight", self.value_weight, 0.0..=1e3, "a number from 0 to 1000")?;
        real("validation_share", self.validation_share, 0.01..=0.5, "a number from 0.01 to 0.5")
    }

    /// The learning rate of an epoch, counted from 0.
    pub(super) fn rate(&self, epoch: usize) -> f64 {
        self.learning_rate * Schedule::Cosine.share(epoch as f64 / self.epochs as f64)
    }
}
