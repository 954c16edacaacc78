//! What is collected: the settings of `n3p-collect --config FILE.toml`.

use std::f64::consts::PI;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::schema::{FORMAT_VERSION, GIT_REVISION, Metadata};
use crate::planners::HybridAStarConfig;
use crate::toml_file::{Setting, TomlError, read_settings};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;
use crate::world::cell::Grid;

/// Settings of a collection. Every field may be left out of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CollectConfig {
    /// The vehicle driven.
    pub vehicle: Vehicle,
    /// The grid of cells; each cell gets its samples.
    pub grid: Grid,
    /// The planner's settings.
    pub planner: HybridAStarConfig,
    /// Expansion budget per sample, 1 to 10⁹.
    pub max_expansions: usize,
    /// Solutions of a sample's search to choose the cheapest from, 1 to 10⁶.
    pub solutions: u32,
    /// Samples per cell, 1 to 10⁶.
    pub samples_per_cell: u32,
    /// The first so many samples of a cell keep how their paths end, 0 to 10⁶: the library of
    /// manoeuvres needs no more, and they take as much space as all other columns.
    pub manoeuvres_per_cell: u32,
    /// How far behind a cell's lane starts may lie, metres, 0 to 50; the lane is taken to go on
    /// there. Cars come along it, from farther than the cell reaches.
    pub start_behind: f64,
    /// Start headings are uniform in ± this angle, radians, 0 to π.
    pub start_heading_max: f64,
    /// Consecutive cells per file; a file holds at most 2²⁰ rows.
    pub cells_per_shard: u32,
    /// Seed of the start poses.
    pub seed: u64,
}

impl Default for CollectConfig {
    fn default() -> Self {
        Self {
            vehicle: Vehicle::default(),
            grid: Grid::default(),
            planner: HybridAStarConfig::default(),
            max_expansions: 50_000,
            solutions: 20,
            samples_per_cell: 100,
            manoeuvres_per_cell: 100,
            start_behind: 8.0,
            start_heading_max: PI / 3.0,
            cells_per_shard: 16,
            seed: 1,
        }
    }
}

/// Settings that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read, or is no TOML of these settings.
    #[error(transparent)]
    File(#[from] TomlError),
    /// A value is out of range; the message says field, value and range.
    #[error("{0}")]
    Value(String),
}

impl CollectConfig {
    /// The most rows of one file: they are held in memory, and make one row group.
    pub const MAX_SHARD_ROWS: u64 = 1 << 20;

    /// Reads a TOML file, or the defaults, with the settings of `set` instead of theirs, and checks
    /// them.
    pub fn read(file: Option<&Path>, set: &[Setting]) -> Result<Self, ConfigError> {
        let config: Self = read_settings(file, set)?;
        config.validate().map_err(|e| match file {
            Some(path) => ConfigError::Value(format!("{}: {e}", path.display())),
            None => e,
        })?;
        Ok(config)
    }

    /// Checks every field.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let bad = ConfigError::Value;
        self.vehicle.validate().map_err(|e| bad(e.to_string()))?;
        self.grid.validate().map_err(|e| bad(e.to_string()))?;
        self.planner.validate().map_err(|e| bad(format!("planner.{e}")))?;
        for (field, value, max) in [
            ("max_expansions", self.max_expansions as u64, 1_000_000_000),
            ("solutions", self.solutions.into(), 1_000_000),
            ("samples_per_cell", self.samples_per_cell.into(), 1_000_000),
            ("cells_per_shard", self.cells_per_shard.into(), Self::MAX_SHARD_ROWS),
        ] {
            if !(1..=max).contains(&value) {
                return Err(bad(format!("{field} is {value}; expected 1 to {max}")));
            }
        }
        let kept = self.manoeuvres_per_cell;
        if kept > 1_000_000 {
            return Err(bad(format!("manoeuvres_per_cell is {kept}; expected 0 to 1000000")));
        }
        let rows = u64::from(self.samples_per_cell) * u64::from(self.cells_per_shard);
        if rows > Self::MAX_SHARD_ROWS {
            return Err(bad(format!(
                "samples_per_cell · cells_per_shard is {rows}; expected at most {} rows in a file",
                Self::MAX_SHARD_ROWS
            )));
        }
        let behind = self.start_behind;
        if !(0.0..=50.0).contains(&behind) {
            return Err(bad(format!("start_behind is {behind}; expected 0 to 50 metres")));
        }
        let heading = self.start_heading_max;
        if !(0.0..=PI).contains(&heading) {
            return Err(bad(format!("start_heading_max is {heading}; expected 0 to π radians")));
        }
        Ok(())
    }

    /// The grid of cells whose lanes go on to where starts may lie.
    pub(super) fn grid_with_lane_behind(&self) -> Grid {
        self.grid.with_lane_behind(self.start_behind)
    }

    /// What files collected with these settings by this build say about themselves.
    pub fn metadata(&self) -> Metadata {
        Metadata {
            format_version: FORMAT_VERSION,
            vehicle: self.vehicle,
            grid: self.grid,
            planner: self.planner,
            max_expansions: self.max_expansions,
            solutions: self.solutions,
            samples_per_cell: self.samples_per_cell,
            manoeuvres_per_cell: self.manoeuvres_per_cell,
            start_behind: self.start_behind,
            start_heading_max: self.start_heading_max,
            cells_per_shard: self.cells_per_shard,
            seed: self.seed,
            crate_version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: GIT_REVISION.to_owned(),
        }
    }

    /// Number of rows that a type gets.
    pub fn rows(&self, kind: ParkingType) -> u64 {
        self.grid.cell_count(kind) as u64 * u64::from(self.samples_per_cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(text: &str) -> String {
        let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        std::fs::write(file.path(), text).unwrap();
        CollectConfig::read(Some(file.path()), &[]).unwrap_err().to_string()
    }

    #[test]
    fn the_defaults_are_valid() {
        CollectConfig::default().validate().unwrap();
    }

    #[test]
    fn errors_name_file_line_and_key() {
        let e = error_of("seed = 3\nsamples = 5\n");
        assert!(e.contains(".toml: line 2 (`samples = 5`): unknown field `samples`"), "{e}");
        let e = error_of("seed = \"x\"");
        assert!(e.contains("line 1 (`seed = \"x\"`)"), "{e}");
        let e = error_of("max_expansions = 0");
        assert!(e.contains("max_expansions is 0; expected 1 to 1000000000"), "{e}");
        let e = error_of("start_heading_max = nan");
        assert!(e.contains("start_heading_max is NaN"), "{e}");
        let e = error_of("[planner.goal_region]\nposition = nan");
        assert!(e.contains(".toml: planner.goal_region.position is NaN"), "{e}");
        let e = error_of("[planner.cost]\nforward = -1.0");
        assert!(e.contains(".toml: planner.cost.forward is -1"), "{e}");
        let e = error_of("cells_per_shard = 100000");
        assert!(e.contains("rows in a file"), "{e}");
    }
}
