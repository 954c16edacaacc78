//! Reads a data set back, and trusts nothing: checksum first, then schema, order and values.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, UInt32Type, UInt64Type};
use arrow_array::{ArrowPrimitiveType, PrimitiveArray, RecordBatch};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use rayon::prelude::*;
use serde_json::Value;

use super::identity::content_sha256;
use super::manifest::{Manifest, ShardRecord, manifest_path, metadata_path, shard_name};
use super::schema::{
    FORMAT_VERSION, Metadata, Sample, Status, columns, first_difference, parse_manoeuvre,
};
use super::write::METADATA_KEY;
use crate::files::reason;
use crate::geometry::Pose;
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// The rows of a complete data set, in memory.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// The settings it was collected with.
    pub metadata: Metadata,
    /// The rows: by type in the order of [`ParkingType::ALL`], then by cell and sample.
    pub samples: Vec<Sample>,
}

/// Why a data set cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// There is no data set.
    #[error("{path}: no data set here (no metadata.json); collect one with n3p-collect --out")]
    Missing {
        /// The folder.
        path: PathBuf,
    },
    /// The type asked for was never begun.
    #[error(
        "{path}: holds no {kind} samples; collect them with n3p-collect --type {kind} --out {path}"
    )]
    NoSuchType {
        /// The folder.
        path: PathBuf,
        /// The type asked for.
        kind: ParkingType,
    },
    /// A type lacks its manifest.
    #[error(
        "{path}: incomplete data set ({kind} has no manifest); finish it with n3p-collect \
         --resume --type {kind} --out {path}"
    )]
    Incomplete {
        /// The folder.
        path: PathBuf,
        /// The unfinished type.
        kind: ParkingType,
    },
    /// A file cannot be read.
    #[error("{path}: cannot be read: {}", reason(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A JSON file is damaged.
    #[error("{path}: damaged or no file of this format: {message}")]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A data set of another version of the format.
    #[error("{path}: format version {found}; this program reads version {expected}")]
    Version {
        /// The file.
        path: PathBuf,
        /// The version found.
        found: String,
        /// The version known.
        expected: u32,
    },
    /// A shard's bytes are not those that were collected.
    #[error(
        "{path}: does not match its checksum in the manifest: truncated or damaged; collect it \
         again with n3p-collect --resume"
    )]
    Checksum {
        /// The shard.
        path: PathBuf,
    },
    /// A shard has its checksum, yet not the expected content.
    #[error("{path}: {message}")]
    Content {
        /// The shard.
        path: PathBuf,
        /// What was expected, and what is there.
        message: String,
    },
    /// The data was collected with another vehicle.
    #[error("the data set's vehicle.{field} is {stored}, but {wanted} is asked for")]
    Vehicle {
        /// The first field that differs.
        field: String,
        /// The data set's value.
        stored: String,
        /// The value asked for.
        wanted: String,
    },
}

impl Dataset {
    /// Reads one parking type, or all types that the folder holds.
    pub fn read(folder: &Path, kind: Option<ParkingType>) -> Result<Dataset, DatasetError> {
        let kinds = match kind {
            Some(kind) => vec![kind],
            None => ParkingType::ALL.into_iter().filter(|k| begun(folder, *k)).collect(),
        };
        if kinds.is_empty() {
            read_metadata(folder)?;
            return Err(DatasetError::Incomplete {
                path: folder.to_owned(),
                kind: ParkingType::ALL[0],
            });
        }
        Self::read_types(folder, &kinds)
    }

    /// Reads these parking types.
    pub fn read_types(folder: &Path, kinds: &[ParkingType]) -> Result<Dataset, DatasetError> {
        let mut samples = Vec::new();
        let metadata = for_each_shard(folder, kinds, |_, shard| samples.extend(shard))?;
        Ok(Dataset { metadata, samples })
    }

    /// The checksum that names the rows of these types, [`content_sha256`].
    pub fn content_sha256(&self, kinds: &[ParkingType]) -> String {
        let of_kinds = self.samples.iter().filter(|s| kinds.contains(&s.cell.kind()));
        content_sha256(&self.metadata, of_kinds)
    }

    /// The parking types that have rows.
    pub fn kinds(&self) -> Vec<ParkingType> {
        let held = |kind: &ParkingType| self.samples.iter().any(|s| s.cell.kind() == *kind);
        ParkingType::ALL.into_iter().filter(held).collect()
    }

    /// The solved rows.
    pub fn solved(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|s| s.status == Status::Solved)
    }

    /// Checks that the data was collected with exactly this vehicle.
    #[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
    pub fn check_vehicle(&self, vehicle: &Vehicle) -> Result<(), DatasetError> {
        let value = |v| serde_json::to_value(v).expect("a vehicle is plain data");
        match first_difference("", &value(&self.metadata.vehicle), &value(vehicle)) {
            None => Ok(()),
            Some(d) => {
                Err(DatasetError::Vehicle { field: d.field, stored: d.stored, wanted: d.current })
            }
        }
    }
}

/// Hands over the rows of these types in order, shard by shard; as many shards are read at a time as there are
/// threads.
pub(super) fn for_each_shard(
    folder: &Path,
    kinds: &[ParkingType],
    mut take: impl FnMut(&Metadata, Vec<Sample>),
) -> Result<Metadata, DatasetError> {
    let metadata = read_metadata(folder)?;
    for &kind in kinds {
        let manifest = read_manifest(folder, &metadata, kind)?;
        let shards: Vec<(usize, &ShardRecord)> = manifest.shards.iter().enumerate().collect();
        for some in shards.chunks(rayon::current_num_threads()) {
            let read = some.par_iter().map(|&(index, record)| {
                let path = folder.join(&record.file);
                let file = open_checked(&path, record)?;
                decode(file, &metadata, kind, index)
                    .map_err(|message| DatasetError::Content { path, message })
            });
            let read: Vec<Vec<Sample>> = read.collect::<Result<_, _>>()?;
            read.into_iter().for_each(|samples| take(&metadata, samples));
        }
    }
    Ok(metadata)
}

/// Whether the folder has anything of a type.
fn begun(folder: &Path, kind: ParkingType) -> bool {
    manifest_path(folder, kind).exists()
        || fs::read_dir(folder).is_ok_and(|entries| {
            let prefix = format!("{kind}-");
            entries.flatten().any(|e| e.file_name().to_string_lossy().starts_with(&prefix))
        })
}

fn read_file(path: &Path) -> Result<Vec<u8>, DatasetError> {
    fs::read(path).map_err(|source| DatasetError::Io { path: path.to_owned(), source })
}

/// A shard whose bytes are those on record.
pub(super) fn open_checked(path: &Path, record: &ShardRecord) -> Result<File, DatasetError> {
    let failed = |source| DatasetError::Io { path: path.to_owned(), source };
    let mut file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    if !record.fits(&bytes) {
        return Err(DatasetError::Checksum { path: path.to_owned() });
    }
    Ok(file)
}

/// The settings of the data set in `folder`, finished or not.
pub fn read_metadata(folder: &Path) -> Result<Metadata, DatasetError> {
    let path = metadata_path(folder);
    if !path.exists() {
        return Err(DatasetError::Missing { path: folder.to_owned() });
    }
    let bytes = read_file(&path)?;
    let damaged = |path, e: serde_json::Error| DatasetError::Json { path, message: e.to_string() };
    let json: Value = serde_json::from_slice(&bytes).map_err(|e| damaged(path.clone(), e))?;
    if json["format_version"] != FORMAT_VERSION {
        return Err(DatasetError::Version {
            path,
            found: json["format_version"].to_string(),
            expected: FORMAT_VERSION,
        });
    }
    let metadata: Metadata = serde_json::from_value(json).map_err(|e| damaged(path.clone(), e))?;
    let bad = |message| DatasetError::Json { path: path.clone(), message };
    metadata.vehicle.validate().map_err(|e| bad(e.to_string()))?;
    metadata.grid.validate().map_err(|e| bad(e.to_string()))?;
    if metadata.cells_per_shard == 0 || metadata.samples_per_cell == 0 {
        return Err(bad("cells_per_shard and samples_per_cell must not be 0".to_owned()));
    }
    Ok(metadata)
}

/// Reads and checks a type's manifest.
pub(crate) fn read_manifest(
    folder: &Path,
    metadata: &Metadata,
    kind: ParkingType,
) -> Result<Manifest, DatasetError> {
    let path = manifest_path(folder, kind);
    if !path.exists() {
        let folder = folder.to_owned();
        return Err(if begun(&folder, kind) {
            DatasetError::Incomplete { path: folder, kind }
        } else {
            DatasetError::NoSuchType { path: folder, kind }
        });
    }
    let bytes = read_file(&path)?;
    let manifest: Manifest = serde_json::from_slice(&bytes)
        .map_err(|e| DatasetError::Json { path: path.clone(), message: e.to_string() })?;
    if !manifest.fits(metadata, kind) {
        let message = format!(
            "expected the shards {} to {} of metadata.json",
            shard_name(kind, 0),
            shard_name(kind, metadata.shard_count(kind) - 1)
        );
        return Err(DatasetError::Json { path, message });
    }
    Ok(manifest)
}

/// The rows of shard `index`, every one in its place; or why the file is not that shard.
pub(super) fn decode(
    file: File,
    metadata: &Metadata,
    kind: ParkingType,
    index: usize,
) -> Result<Vec<Sample>, String> {
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| e.to_string())?;
    let stored = builder.metadata().file_metadata().key_value_metadata();
    let stored = stored.and_then(|all| all.iter().find(|kv| kv.key == METADATA_KEY));
    let stored = stored.and_then(|kv| kv.value.as_deref()).unwrap_or_default();
    if serde_json::from_str(stored).ok().as_ref() != Some(metadata) {
        return Err("its metadata differs from metadata.json".to_owned());
    }
    let expected = columns();
    for (i, column) in expected.fields().iter().enumerate() {
        match builder.schema().fields().get(i) {
            Some(c) if c.name() == column.name() && c.data_type() == column.data_type() => {}
            other => {
                return Err(format!("column {i}: expected {column:?}, got {other:?}"));
            }
        }
    }
    let cells = metadata.shard_cells(kind, index);
    let expected_rows = cells.len() * metadata.samples_per_cell as usize;
    let mut samples = Vec::with_capacity(expected_rows);
    for batch in builder.build().map_err(|e| e.to_string())? {
        rows(&batch.map_err(|e| e.to_string())?, metadata, kind, cells.start, &mut samples)?;
    }
    if samples.len() != expected_rows {
        return Err(format!("expected {expected_rows} rows, got {}", samples.len()));
    }
    Ok(samples)
}

/// Appends the rows of a batch, checking each.
fn rows(
    batch: &RecordBatch,
    metadata: &Metadata,
    kind: ParkingType,
    first_cell: u32,
    samples: &mut Vec<Sample>,
) -> Result<(), String> {
    let number = |name: &str| primitive::<UInt32Type>(batch, name);
    let single = |name: &str| primitive::<Float32Type>(batch, name);
    let text = |name: &str| batch[name].as_string::<i32>();
    let (kinds, cells, indices) =
        (text("parking_type"), number("cell_index"), number("sample_index"));
    let pose = |[x, y, heading]: [&str; 3]| {
        let (x, y, heading) = (single(x), single(y), single(heading));
        move |i: usize| Pose::new(x.value(i).into(), y.value(i).into(), heading.value(i).into())
    };
    let start = pose(["start_x_m", "start_y_m", "start_heading_rad"]);
    let rs_start = pose(["rs_x_m", "rs_y_m", "rs_heading_rad"]);
    let (status, word, manoeuvre) = (text("status"), text("rs_word"), text("manoeuvre"));
    let lengths = [1, 2, 3, 4, 5].map(|n| single(&format!("rs_length_{n}_m")));
    let (entry, path_length) = (single("entry_m"), single("path_length_m"));
    let (changes, expansions) = (number("direction_changes"), number("expansions"));
    let seeds = primitive::<UInt64Type>(batch, "seed");

    for i in 0..batch.num_rows() {
        let row = samples.len() as u32;
        let at = |message: String| format!("row {row}: {message}");
        let cell_index = first_cell + row / metadata.samples_per_cell;
        let sample_index = row % metadata.samples_per_cell;
        let found = (kinds.value(i), cells.value(i), indices.value(i), seeds.value(i));
        let expected = (kind.name(), cell_index, sample_index, metadata.seed);
        if found != expected {
            return Err(at(format!(
                "expected type, cell, sample and seed {expected:?}, got {found:?}"
            )));
        }
        let sample = Sample {
            cell: metadata.grid.cell(kind, cell_index as usize),
            cell_index,
            sample_index,
            start: start(i),
            status: Status::from_name(status.value(i))
                .ok_or_else(|| at(format!("unknown status \"{}\"", status.value(i))))?,
            rs_start: rs_start(i),
            rs_word: word.value(i).to_owned(),
            rs_lengths: lengths.map(|column| column.value(i).into()),
            entry: entry.value(i).into(),
            manoeuvre: parse_manoeuvre(manoeuvre.value(i))
                .ok_or_else(|| at(format!("unreadable manoeuvre \"{}\"", manoeuvre.value(i))))?,
            path_length: path_length.value(i).into(),
            direction_changes: changes.value(i),
            expansions: expansions.value(i),
            seed: seeds.value(i),
        };
        check_finite(&sample).map_err(at)?;
        samples.push(sample);
    }
    Ok(())
}

/// A column whose type the schema check has settled.
fn primitive<'a, T: ArrowPrimitiveType>(
    batch: &'a RecordBatch,
    name: &str,
) -> &'a PrimitiveArray<T> {
    batch[name].as_primitive::<T>()
}

fn check_finite(sample: &Sample) -> Result<(), String> {
    let started = !matches!(sample.status, Status::NoStart | Status::GivenUp);
    if started && !sample.start.is_finite() {
        return Err(format!("start is {:?}; expected finite numbers", sample.start));
    }
    let solved = sample.status == Status::Solved;
    let lengths = [sample.entry, sample.path_length];
    let finite = sample.rs_start.is_finite()
        && sample.rs_lengths.iter().chain(&lengths).all(|v| v.is_finite());
    if solved && !finite {
        return Err("solved, but its Reeds-Shepp columns are not finite numbers".to_owned());
    }
    Ok(())
}
