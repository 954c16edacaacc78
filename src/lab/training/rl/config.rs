//! Settings of a policy's training.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::environment::parking_env::EnvConfig;
use crate::lab::rl::sac::SacConfig;
use crate::lab::training::TrainingError;
use crate::lab::training::settings::{self, check, real, whole};
use crate::toml_file::Setting;
use crate::vehicle::Vehicle;
use crate::world::generate::GeneratorConfig;

/// Settings of the training; where it learns is said apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RlConfig {
    /// Episodes after which training ends.
    pub episodes: usize,
    /// Seed of everything random: problems, weights, noise, what is replayed.
    pub seed: u64,
    /// Environments driven side by side.
    pub environments: usize,
    /// Steps with random actions before anything is learnt. They also decide how inputs are
    /// scaled.
    pub warm_up: usize,
    /// Steps per update.
    pub steps_per_update: usize,
    /// Transitions remembered.
    pub replay: usize,
    /// Episodes between points of the curve; each validates and leaves a checkpoint.
    pub report_every: usize,
    /// Validation problems of each stratum, and their seed.
    pub validation_count: usize,
    /// Seed of the validation problems, another one than the training's.
    pub validation_seed: u64,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Rules of the episodes.
    pub env: EnvConfig,
    /// The algorithm.
    pub sac: SacConfig,
}

impl Default for RlConfig {
    fn default() -> Self {
        Self {
            episodes: 10_000,
            seed: 4711,
            environments: 8,
            warm_up: 10_240,
            steps_per_update: 4,
            replay: 100_000,
            report_every: 250,
            validation_count: 40,
            validation_seed: 79,
            vehicle: Vehicle::default(),
            env: EnvConfig::default(),
            sac: SacConfig::default(),
        }
    }
}

impl RlConfig {
    /// Reads a TOML file, or the defaults, with the settings of `set` instead of theirs, and checks
    /// them; absent settings keep their defaults.
    pub fn read(file: Option<&Path>, set: &[Setting]) -> Result<Self, TrainingError> {
        settings::read(file, set, Self::validate)
    }

    /// Checks every setting.
    pub fn validate(&self) -> Result<(), TrainingError> {
        whole("episodes", self.episodes, 10_000_000, "a whole number from 1 to 10000000")?;
        whole("environments", self.environments, 1024, "a whole number from 1 to 1024")?;
        whole("warm_up", self.warm_up, 10_000_000, "a whole number from 1 to 10000000")?;
        whole("steps_per_update", self.steps_per_update, 10_000, "a whole number from 1 to 10000")?;
        whole("replay", self.replay, 10_000_000, "a whole number from 1 to 10000000")?;
        whole("report_every", self.report_every, 1_000_000, "a whole number from 1 to 1000000")?;
        whole("validation_count", self.validation_count, 10_000, "a whole number from 1 to 10000")?;
        let seeds_differ = self.validation_seed != self.seed;
        let seed = self.validation_seed.to_string();
        check("validation_seed", seeds_differ, seed, "another seed than that of the training")?;
        self.vehicle.validate().map_err(|e| TrainingError::Config {
            field: e.field,
            value: e.value.to_string(),
            expected: e.expected,
        })?;
        GeneratorConfig::default().validate(&self.vehicle).map_err(TrainingError::Vehicle)?;
        let (env, sac) = (&self.env, &self.sac);
        whole("env.horizon", env.horizon as usize, 100_000, "a whole number from 1 to 100000")?;
        real("env.parked_overlap", env.parked_overlap, 0.01..=1.0, "a number from 0.01 to 1")?;
        real("env.curve_distance", env.curve_distance, 0.0..=1000.0, "a number from 0 to 1000")?;
        real("env.reach", env.reach, 0.0..=1000.0, "a number from 0 to 1000")?;
        real("env.reward_scale", env.reward_scale, 1e-6..=1e3, "a number from 1e-6 to 1000")?;
        real("sac.discount", sac.discount, 0.0..=1.0, "a number from 0 to 1")?;
        real("sac.follow", sac.follow, 1e-6..=1.0, "a number from 1e-6 to 1")?;
        real("sac.average", sac.average, 1e-6..=1.0, "a number from 1e-6 to 1")?;
        real("sac.learning_rate", sac.learning_rate, 1e-8..=1.0, "a number from 1e-8 to 1")?;
        whole("sac.batch", sac.batch, 65_536, "a whole number from 1 to 65536")?;
        real(
            "sac.target_entropy",
            sac.target_entropy,
            -100.0..=100.0,
            "a number from -100 to 100",
        )?;
        real("sac.temperature", sac.temperature, 1e-6..=100.0, "a number from 1e-6 to 100")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_which_setting_is_wrong() {
        assert!(RlConfig::default().validate().is_ok());
        let refused = |config: RlConfig| config.validate().unwrap_err().to_string();
        let default = RlConfig::default();
        let e = refused(RlConfig { validation_seed: default.seed, ..default.clone() });
        assert!(e.starts_with("validation_seed is 4711; expected another seed"), "{e}");
        let vehicle = Vehicle { width: 2.5, ..default.vehicle };
        let e = refused(RlConfig { vehicle, ..default.clone() });
        assert!(e.contains("no problems for this vehicle") && e.contains("bay_spot_width"), "{e}");
        let sac = SacConfig { discount: f64::NAN, ..SacConfig::default() };
        let e = refused(RlConfig { sac, ..default });
        assert!(e.starts_with("sac.discount is NaN; expected"), "{e}");
    }
}
