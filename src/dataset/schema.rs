//! One row of a data set, and what the files say about themselves.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::planners::HybridAStarConfig;
use crate::vehicle::Vehicle;
use crate::world::cell::{Cell, Grid};

/// How solving a sample ended. Failed solves are rows too, so that coverage is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Solved; the Reeds-Shepp columns are valid.
    Solved,
    /// The expansion budget ended the search.
    BudgetSpent,
    /// No path exists at the search's resolution.
    NoPath,
    /// No free start pose was found in the cell (or its goal is not free).
    NoStart,
}

/// One solved (or failed) sample: one row.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The environment, parking type included.
    pub cell: Cell,
    /// Its index in the grid.
    pub cell_index: u32,
    /// Index of the sample in its cell.
    pub sample_index: u32,
    /// Rear-axle start, spot frame.
    pub start: Pose,
    /// How it ended.
    pub status: Status,
    /// Where the Reeds-Shepp curve begins (x_rs of the paper), spot frame; NaN if unsolved.
    pub rs_start: Pose,
    /// The curve's word, such as `L+R-S-`; empty if unsolved.
    pub rs_word: String,
    /// Signed segment lengths of the curve, metres, zero-padded.
    pub rs_lengths: [f64; 5],
    /// Signed length of the entry straight after the curve, metres.
    pub entry: f64,
    /// Length of the whole path, metres.
    pub path_length: f64,
    /// Direction changes of the whole path.
    pub direction_changes: u32,
    /// Node expansions spent.
    pub expansions: u32,
    /// Seed of the collection.
    pub seed: u64,
}

/// Provenance, stored in every Parquet file's metadata and in the manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metadata {
    /// Version of this format.
    pub format_version: u32,
    /// The vehicle driven.
    pub vehicle: Vehicle,
    /// The grid of cells.
    pub grid: Grid,
    /// The planner's settings.
    pub planner: HybridAStarConfig,
    /// Expansion budget per sample.
    pub max_expansions: usize,
    /// Samples per cell.
    pub samples_per_cell: u32,
    /// Start headings are uniform in ± this angle, radians.
    pub start_heading_max: f64,
    /// Seed.
    pub seed: u64,
    /// Version of this crate.
    pub crate_version: String,
    /// Git revision of the build, `unknown` outside a checkout.
    pub git_revision: String,
}
