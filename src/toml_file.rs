//! Files of settings.

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::de::DeserializeOwned;

use crate::files::reason;
use crate::vehicle::{Vehicle, VehicleError};

/// A file of settings that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TomlError {
    /// The file cannot be read.
    #[error("{path}: cannot be read: {}; expected a TOML file", reason(error))]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The file is no TOML, or has an unknown or ill-typed key.
    #[error("{path}: line {line} (`{text}`): {message}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What stands there.
        text: String,
        /// What is wrong with it.
        message: String,
    },
}

/// Reads a TOML file; what it says is not checked.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, TomlError> {
    let text = fs::read_to_string(path)
        .map_err(|error| TomlError::Read { path: path.to_owned(), error })?;
    toml::from_str(&text).map_err(|e| {
        let start = e.span().map_or(0, |span| span.start.min(text.len()));
        let line = text.as_bytes()[..start].iter().filter(|b| **b == b'\n').count();
        TomlError::Parse {
            path: path.to_owned(),
            line: line + 1,
            text: text.lines().nth(line).unwrap_or_default().trim().to_owned(),
            message: e.message().replace('\n', " "),
        }
    })
}

/// A vehicle file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum VehicleFileError {
    /// It cannot be read, or is no TOML of a vehicle.
    #[error(transparent)]
    File(#[from] TomlError),
    /// A field is out of range.
    #[error("{}: {error}", .path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// The field.
        error: VehicleError,
    },
}

impl Vehicle {
    /// Reads and checks a TOML file with the fields of a vehicle.
    pub fn read(path: &Path) -> Result<Self, VehicleFileError> {
        let vehicle: Self = read_toml(path)?;
        let invalid = |error| VehicleFileError::Invalid { path: path.to_owned(), error };
        vehicle.validate().map_err(invalid)?;
        Ok(vehicle)
    }
}
