//! What settings of trainings share: reading a file, and checks that name setting, value and range.

use std::ops::RangeInclusive;
use std::path::Path;

use serde::de::DeserializeOwned;

use super::TrainingError;
use crate::toml_file::{Setting, read_settings};

/// Reads settings of a TOML file, overridden by those of `set`, and checks them; absent ones keep their
/// defaults.
pub(super) fn read<T: DeserializeOwned>(
    file: Option<&Path>,
    set: &[Setting],
    validate: impl FnOnce(&T) -> Result<(), TrainingError>,
) -> Result<T, TrainingError> {
    let config: T = read_settings(file, set)?;
    validate(&config).map_err(|e| match file {
        Some(path) => TrainingError::ConfigFile { path: path.to_owned(), problem: e.to_string() },
        None => e,
    })?;
    Ok(config)
}

/// Refuses a setting that is not `ok`.
pub(super) fn check(
    field: &'static str,
    ok: bool,
    value: String,
    expected: &'static str,
) -> Result<(), TrainingError> {
    if ok { Ok(()) } else { Err(TrainingError::Config { field, value, expected }) }
}

/// Refuses a number outside of `range`, NaN included.
pub(super) fn real(
    field: &'static str,
    v: f64,
    range: RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), TrainingError> {
    check(field, range.contains(&v), v.to_string(), expected)
}

/// Refuses a whole number that is 0 or above `most`.
pub(super) fn whole(
    field: &'static str,
    v: usize,
    most: usize,
    expected: &'static str,
) -> Result<(), TrainingError> {
    check(field, (1..=most).contains(&v), v.to_string(), expected)
}
