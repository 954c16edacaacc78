//! Files of settings, and settings given apart from them.

use std::path::{Path, PathBuf};
use std::str::FromStr;
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
    /// A setting given apart from the file cannot be one.
    #[error("--set {setting}: {message}")]
    Set {
        /// As it was given.
        setting: String,
        /// What is wrong with it.
        message: String,
    },
}

/// One setting apart from a file, `KEY=VALUE`: the key with dots where a table holds it, the value as a
/// TOML file has it, quotes left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    key: Vec<String>,
    value: toml::Value,
    text: String,
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = "expected KEY=VALUE, such as epochs=5 or grid.back=7.0";
        let (key, value) = text.split_once('=').ok_or(expected)?;
        let key: Vec<String> = key.split('.').map(|part| part.trim().to_owned()).collect();
        if key.iter().any(String::is_empty) {
            return Err(expected.to_owned());
        }
        let value = value.trim();
        let parsed = toml::from_str(&format!("value = {value}"));
        let value = parsed
            .ok()
            .and_then(|table: toml::Table| table.get("value").cloned().filter(|_| table.len() == 1))
            .unwrap_or_else(|| toml::Value::String(value.to_owned()));
        Ok(Self { key, value, text: text.to_owned() })
    }
}

impl Setting {
    /// Puts the value where the key says.
    fn apply(&self, settings: &mut toml::Table) -> Result<(), TomlError> {
        let (last, tables) = self.key.split_last().expect("a key has a part");
        let mut at = settings;
        for name in tables {
            let table = at.entry(name).or_insert_with(|| toml::Table::new().into());
            let toml::Value::Table(table) = table else {
                let (setting, message) = (self.text.clone(), format!("{name} is no table"));
                return Err(TomlError::Set { setting, message });
            };
            at = table;
        }
        at.insert(last.clone(), self.value.clone());
        Ok(())
    }
}

/// Reads the settings of a file, or the usual ones, and puts those of `set` in their place, the last of
/// a key last; what they say is not checked.
pub fn read_settings<T: DeserializeOwned>(
    file: Option<&Path>,
    set: &[Setting],
) -> Result<T, TomlError> {
    let mut table = toml::Table::new();
    if let Some(path) = file {
        // By itself first: then an error has its line.
        let settings = read_toml(path)?;
        if set.is_empty() {
            return Ok(settings);
        }
        table = read_toml(path)?;
    }
    set.iter().try_for_each(|setting| setting.apply(&mut table))?;
    T::deserialize(table).map_err(|e| TomlError::Set {
        setting: set.iter().map(|s| &s.text[..]).collect::<Vec<_>>().join(" --set "),
        message: e.message().replace('\n', " "),
    })
}

/// Reads a TOML file; what it says is not checked.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, TomlError> {
    let text = fs::read_to_string(path)
        .map_err(|error| TomlError::Read { path: path.to_owned(), error })?;
    parse_toml(&text, path)
}

/// The same of a text; `path` is where it comes from, for messages.
pub fn parse_toml<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T, TomlError> {
    toml::from_str(text).map_err(|e| {
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
        Self::checked(read_toml(path)?, path)
    }

    /// The same of a text; `path` is where it comes from, for messages.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, VehicleFileError> {
        Self::checked(parse_toml(text, path)?, path)
    }

    fn checked(vehicle: Self, path: &Path) -> Result<Self, VehicleFileError> {
        let invalid = |error| VehicleFileError::Invalid { path: path.to_owned(), error };
        vehicle.validate().map_err(invalid)?;
        Ok(vehicle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(text: &str) -> Setting {
        text.parse().unwrap()
    }

    #[test]
    fn settings_override_those_of_the_file_one_after_the_other() {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), "seed = 1\n[grid]\nback = 7.0\nname = \"a\"\n").unwrap();
        let settings = ["seed=2", "grid.back = 8.5", "seed=3", "grid.name=b=c", "grid.list=[1, 2]"];
        let table: toml::Table = read_settings(Some(file.path()), &settings.map(set)).unwrap();
        let expected = "seed = 3\n[grid]\nback = 8.5\nname = \"b=c\"\nlist = [1, 2]\n";
        assert_eq!(table, toml::from_str(expected).unwrap());
        let table: toml::Table = read_settings(None, &[set("a.b.c=true")]).unwrap();
        assert_eq!(table, toml::from_str("a.b.c = true").unwrap());
    }

    #[test]
    fn what_is_no_setting_is_named() {
        for text in ["seed", "=1", "a..b=1", ""] {
            assert!(text.parse::<Setting>().unwrap_err().contains("KEY=VALUE"), "{text}");
        }
        let error = |settings: &[Setting]| {
            read_settings::<Vehicle>(None, settings).unwrap_err().to_string()
        };
        assert!(error(&[set("lenght=4")]).starts_with("--set lenght=4: unknown field `lenght`"));
        assert!(error(&[set("width=1"), set("width.x=1")]).contains("width is no table"));
        // A key is no way to write a second one.
        assert_eq!(set("a=1\nb=2").value, toml::Value::String("1\nb=2".to_owned()));
    }
}
