//! What a volume run plans: a TOML file.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::files::sha256_hex;
use crate::lab::experiments::ConfigError;
use crate::planners::{Budget, Effort};
use crate::toml_file::{Setting, read_settings};
use crate::world::Scene;

/// The version of the format.
pub const VERSION: u32 = 1;

/// Where scenes come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VolumeWorld {
    /// Parking lots as in the paper.
    Home,
    /// The same with sizes drawn far wider.
    Wide,
    /// Whole car parks and streets.
    Lots,
    /// Vehicles among anything; not every scene has a path.
    Clutter,
}

impl VolumeWorld {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Home => "home",
            Self::Wide => "wide",
            Self::Lots => "lots",
            Self::Clutter => "clutter",
        }
    }
}

/// Which scenes are planned. Unknown keys are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VolumeConfig {
    /// Of this format.
    pub version: u32,
    /// Seed of the scenes.
    pub seed: u64,
    /// How many scenes.
    pub count: u64,
    /// Scenes of a shard, the least that a killed run loses.
    #[serde(default = "default_per_shard")]
    pub scenes_per_shard: u64,
    /// Where scenes come from, in turn.
    #[serde(default = "default_worlds")]
    pub worlds: Vec<VolumeWorld>,
    /// How far from the origin every other scene is put, metres, turned by any angle and every other one of
    /// these mirrored; 0: scenes stay where they were drawn.
    #[serde(default)]
    pub map_coordinates: f64,
    /// Expansion budget of a scene.
    #[serde(default = "default_expansions")]
    pub max_expansions: usize,
    /// What becomes of first paths.
    #[serde(default)]
    pub effort: Effort,
}

fn default_per_shard() -> u64 {
    1000
}

fn default_worlds() -> Vec<VolumeWorld> {
    vec![VolumeWorld::Home, VolumeWorld::Wide, VolumeWorld::Lots, VolumeWorld::Clutter]
}

fn default_expansions() -> usize {
    Budget::default().max_expansions
}

impl VolumeConfig {
    /// Reads a file, with the settings of `set` instead of its own, and checks it.
    pub fn read(path: &Path, set: &[Setting]) -> Result<Self, ConfigError> {
        let config: Self = read_settings(Some(path), set)?;
        let value = |message| ConfigError::Value { path: path.to_owned(), message };
        config.validate().map_err(value)?;
        Ok(config)
    }

    fn validate(&self) -> Result<(), String> {
        let most = Scene::MAX_COORDINATE / 2.0;
        if self.version != VERSION {
            return Err(format!("version is {}; this program reads {VERSION}", self.version));
        }
        for (field, value) in [("count", self.count), ("scenes_per_shard", self.scenes_per_shard)] {
            if !(1..=1_000_000_000).contains(&value) {
                return Err(format!("{field} is {value}; expected 1 to 1000000000"));
            }
        }
        if self.worlds.is_empty() {
            return Err("worlds is []; expected some of home, wide, lots, clutter".to_owned());
        }
        let twice = (1..self.worlds.len()).find(|&i| self.worlds[..i].contains(&self.worlds[i]));
        if let Some(i) = twice {
            return Err(format!("worlds names {} twice; once is enough", self.worlds[i].name()));
        }
        if !(0.0..=most).contains(&self.map_coordinates) {
            let found = self.map_coordinates;
            return Err(format!("map_coordinates is {found}; expected 0 to {most:.0} m"));
        }
        Ok(())
    }

    /// Number of shards.
    pub fn shards(&self) -> u64 {
        self.count.div_ceil(self.scenes_per_shard)
    }

    /// Budget of a scene.
    pub fn budget(&self) -> Budget {
        Budget { max_expansions: self.max_expansions, effort: self.effort }
    }

    /// As a file.
    #[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("plain data")
    }

    /// What tells it from others.
    pub fn sha256(&self) -> String {
        sha256_hex(&[self.to_toml().as_bytes()])
    }
}
