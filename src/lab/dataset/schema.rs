//! One row of a data set, its Parquet columns, and what the files say about themselves.

use arrow_schema::{DataType, Field, Schema};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::curves::Segment;
use crate::geometry::Pose;
use crate::planners::HybridAStarConfig;
use crate::vehicle::Vehicle;
use crate::world::cell::{Cell, Grid};

/// Version of the data format that this crate writes and reads.
pub const FORMAT_VERSION: u32 = 4;

/// Git revision of this build; `unknown` outside a checkout.
pub const GIT_REVISION: &str = env!("N3P_GIT_REVISION");

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
    /// A path was found, but no pose along it is one curve away from the goal.
    NoCurve,
    /// Not tried: none of the first samples of the cell was solved.
    GivenUp,
    /// No free start pose was found in the cell (or its goal is not free).
    NoStart,
}

impl Status {
    /// Every status.
    pub const ALL: [Status; 6] = [
        Self::Solved,
        Self::BudgetSpent,
        Self::NoPath,
        Self::NoCurve,
        Self::GivenUp,
        Self::NoStart,
    ];

    /// The name used in the files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::BudgetSpent => "budget_spent",
            Self::NoPath => "no_path",
            Self::NoCurve => "no_curve",
            Self::GivenUp => "given_up",
            Self::NoStart => "no_start",
        }
    }

    /// The status of a name in a file.
    pub fn from_name(name: &str) -> Option<Status> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
}

/// One solved (or failed) sample: one row.
///
/// Unsolved rows have NaN in every column that a path would fill; rows of
/// [`Status::NoStart`] and [`Status::GivenUp`] have NaN starts as well.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The environment, parking type included.
    pub cell: Cell,
    /// Its index in the grid.
    pub cell_index: u32,
    /// Index of the sample in its cell.
    pub sample_index: u32,
    /// Rear-axle start, spot frame; a multiple of [`Sample::START_STEP`].
    pub start: Pose,
    /// How it ended.
    pub status: Status,
    /// Where the Reeds-Shepp curve begins (x_rs of the paper), spot frame; NaN if unsolved.
    /// Rounded to f32.
    pub rs_start: Pose,
    /// The curve's word, such as `L+R-S-`; empty if unsolved, or if the search ended on the
    /// goal without a curve (`rs_start` is the goal then).
    pub rs_word: String,
    /// Signed segment lengths of the curve, metres, zero-padded; NaN if unsolved. Rounded to
    /// [`Sample::LENGTH_STEP`]: the exact ones follow from `rs_start` and `rs_word`.
    pub rs_lengths: [f64; 5],
    /// Signed length of the entry straight after the curve, metres; rounded like the curve's.
    pub entry: f64,
    /// How the path ends: the motions from a pose that one curve from the start reaches, to
    /// the goal. Empty where one curve reaches the goal itself, and beyond the first
    /// `manoeuvres_per_cell` samples of a cell. Rounded to f32; the pose follows by driving
    /// back from the goal.
    pub manoeuvre: Vec<Segment>,
    /// Length of the whole path, metres; rounded like the curve's.
    pub path_length: f64,
    /// Direction changes of the whole path.
    pub direction_changes: u32,
    /// Node expansions spent.
    pub expansions: u32,
    /// Seed of the collection.
    pub seed: u64,
}

impl Sample {
    /// Start poses are multiples of this, metres and radians: a power of two, so that the
    /// low bytes of an f32 are zero and compress away.
    pub const START_STEP: f64 = 1.0 / 4096.0;

    /// Lengths are stored as multiples of this, metres.
    pub const LENGTH_STEP: f64 = 1.0 / 1024.0;

    /// A row without path.
    pub fn unsolved(
        cell: Cell,
        cell_index: u32,
        sample_index: u32,
        start: Pose,
        status: Status,
        seed: u64,
    ) -> Self {
        let nan = f64::NAN;
        Self {
            cell,
            cell_index,
            sample_index,
            start,
            status,
            rs_start: Pose::new(nan, nan, nan),
            rs_word: String::new(),
            rs_lengths: [nan; 5],
            entry: nan,
            manoeuvre: Vec::new(),
            path_length: nan,
            direction_changes: 0,
            expansions: 0,
            seed,
        }
    }

    /// This row as the file holds it: writing and reading it back changes nothing.
    pub fn rounded(mut self) -> Self {
        let length = |v: f64| to_f32(to_multiple(v, Self::LENGTH_STEP));
        self.start = to_step(self.start);
        let p = self.rs_start;
        self.rs_start = Pose::new(to_f32(p.x), to_f32(p.y), to_f32(p.heading));
        self.rs_lengths = self.rs_lengths.map(length);
        self.entry = length(self.entry);
        for s in &mut self.manoeuvre {
            *s = Segment { curvature: to_f32(s.curvature), length: to_f32(s.length) };
        }
        self.path_length = length(self.path_length);
        self
    }
}

/// Segments as text: `curvature:length` pairs (1/m, m), blanks between.
pub(super) fn manoeuvre_text(segments: &[Segment]) -> String {
    let pair = |s: &Segment| format!("{}:{}", s.curvature as f32, s.length as f32);
    segments.iter().map(pair).collect::<Vec<_>>().join(" ")
}

/// Reads [`manoeuvre_text`]; `None` unless every number is finite.
pub(super) fn parse_manoeuvre(text: &str) -> Option<Vec<Segment>> {
    let number = |v: &str| v.parse::<f32>().ok().filter(|v| v.is_finite()).map(f64::from);
    let pair = |pair: &str| {
        let (curvature, length) = pair.split_once(':')?;
        Some(Segment { curvature: number(curvature)?, length: number(length)? })
    };
    text.split_whitespace().map(pair).collect()
}

/// `pose` on the raster of start poses.
pub(super) fn to_step(pose: Pose) -> Pose {
    let v = |v: f64| to_f32(to_multiple(v, Sample::START_STEP));
    Pose::new(v(pose.x), v(pose.y), v(pose.heading))
}

fn to_multiple(v: f64, step: f64) -> f64 {
    (v / step).round() * step
}

fn to_f32(v: f64) -> f64 {
    f64::from(v as f32)
}

/// The Parquet columns in file order; none is nullable.
pub fn columns() -> Schema {
    use DataType::{Float32, Float64, UInt32, UInt64, Utf8};
    let columns = [
        ("parking_type", Utf8),
        ("cell_index", UInt32),
        ("sample_index", UInt32),
        ("lane_width_m", Float64),
        ("spot_width_m", Float64),
        ("dead_end_m", Float64),
        ("start_x_m", Float32),
        ("start_y_m", Float32),
        ("start_heading_rad", Float32),
        ("status", Utf8),
        ("rs_x_m", Float32),
        ("rs_y_m", Float32),
        ("rs_heading_rad", Float32),
        ("rs_word", Utf8),
        ("rs_length_1_m", Float32),
        ("rs_length_2_m", Float32),
        ("rs_length_3_m", Float32),
        ("rs_length_4_m", Float32),
        ("rs_length_5_m", Float32),
        ("entry_m", Float32),
        ("manoeuvre", Utf8),
        ("path_length_m", Float32),
        ("direction_changes", UInt32),
        ("expansions", UInt32),
        ("seed", UInt64),
    ];
    Schema::new(
        columns.into_iter().map(|(name, kind)| Field::new(name, kind, false)).collect::<Vec<_>>(),
    )
}

/// Provenance, stored in every Parquet file's metadata and beside the files.
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
    /// Solutions of a search to choose the cheapest from.
    pub solutions: u32,
    /// Samples per cell.
    pub samples_per_cell: u32,
    /// The first samples of each cell, which keep their manoeuvres.
    pub manoeuvres_per_cell: u32,
    /// How far behind a cell's lane starts lie, metres.
    pub start_behind: f64,
    /// Start headings are uniform in ± this angle, radians.
    pub start_heading_max: f64,
    /// Consecutive cells per file.
    pub cells_per_shard: u32,
    /// Seed.
    pub seed: u64,
    /// Version of this crate.
    pub crate_version: String,
    /// Git revision of the build, `unknown` outside a checkout.
    pub git_revision: String,
}

impl Metadata {
    /// The fields that say which program ran, not what it was asked for.
    const BUILD: [&str; 2] = ["crate_version", "git_revision"];

    /// What decides the rows: neither `BUILD` nor how they are cut into files.
    pub(super) fn settings(&self) -> Value {
        let mut value = serde_json::to_value(self).expect("metadata is plain data");
        let fields = value.as_object_mut().expect("a struct is a JSON object");
        fields.retain(|field, _| Self::decides_rows(field));
        value
    }

    /// The first setting that differs between the two, `BUILD` aside.
    pub fn settings_difference(&self, current: &Metadata) -> Option<Difference> {
        self.difference(current, |field| !Self::BUILD.contains(&field))
    }

    /// The first setting that differs between the two and decides rows: how they are cut into
    /// files does not.
    pub fn content_difference(&self, current: &Metadata) -> Option<Difference> {
        self.difference(current, Self::decides_rows)
    }

    fn decides_rows(field: &str) -> bool {
        field != "cells_per_shard" && !Self::BUILD.contains(&field)
    }

    /// The first field of the build that differs between the two.
    pub fn build_difference(&self, current: &Metadata) -> Option<Difference> {
        self.difference(current, |field| Self::BUILD.contains(&field))
    }

    fn difference(&self, current: &Metadata, of: impl Fn(&str) -> bool) -> Option<Difference> {
        let value = |m| serde_json::to_value(m).expect("metadata is plain data");
        let (Value::Object(stored), Value::Object(current)) = (value(self), value(current)) else {
            unreachable!("a struct is a JSON object");
        };
        stored
            .iter()
            .filter(|(field, _)| of(field))
            .find_map(|(field, v)| first_difference(field, v, &current[field]))
    }
}

/// A field with two values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} was {stored}, now {current}")]
pub struct Difference {
    /// Its name, nested ones with dots.
    pub field: String,
    /// The value in the files.
    pub stored: String,
    /// The value asked for.
    pub current: String,
}

/// The first leaf at or below `field` that differs.
pub(super) fn first_difference(field: &str, stored: &Value, current: &Value) -> Option<Difference> {
    if let (Value::Object(a), Value::Object(b)) = (stored, current) {
        let missing = Value::Null;
        // What is usual may be left out of either.
        let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
        return keys.into_iter().find_map(|key| {
            let name = if field.is_empty() { key.clone() } else { format!("{field}.{key}") };
            let [stored, current] = [a, b].map(|of| of.get(key).unwrap_or(&missing));
            first_difference(&name, stored, current)
        });
    }
    (stored != current).then(|| Difference {
        field: field.to_owned(),
        stored: stored.to_string(),
        current: current.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::dataset::CollectConfig;

    #[test]
    fn names_the_nested_field_that_differs() {
        let stored = CollectConfig::default().metadata();
        let mut current = stored.clone();
        assert_eq!(stored.settings_difference(&current), None);
        current.git_revision = "elsewhere".to_owned();
        assert_eq!(stored.settings_difference(&current), None);
        assert_eq!(stored.build_difference(&current).unwrap().field, "git_revision");
        current.grid.lane_width.max = 8.0;
        let difference = stored.settings_difference(&current).unwrap();
        assert_eq!(difference.to_string(), "grid.lane_width.max was 7.0, now 8.0");
    }

    #[test]
    fn start_steps_are_exact_in_f32() {
        let p = to_step(Pose::new(-9.999, 11.0001, 0.7777));
        for v in <[f64; 3]>::from(p) {
            assert_eq!((v / Sample::START_STEP).fract(), 0.0);
            assert_eq!(f64::from(v as f32), v);
        }
    }
}
