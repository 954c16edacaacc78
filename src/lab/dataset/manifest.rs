//! The bookkeeping of a data set's folder: file names, checksums, counts.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::schema::{Metadata, Sample, Status};
use crate::files::{remove_if_present, sha256_hex, write_whole};
use crate::world::ParkingType;

/// The settings that all files of a data set share.
pub fn metadata_path(folder: &Path) -> PathBuf {
    folder.join("metadata.json")
}

/// The manifest of a type: says that its shards are complete.
pub fn manifest_path(folder: &Path, kind: ParkingType) -> PathBuf {
    folder.join(format!("{kind}.manifest.json"))
}

/// A shard's file name, without folder.
pub fn shard_name(kind: ParkingType, shard: usize) -> String {
    format!("{kind}-{shard:04}.parquet")
}

/// What is known about a finished shard while the type has no manifest.
pub fn record_path(folder: &Path, kind: ParkingType, shard: usize) -> PathBuf {
    folder.join(shard_name(kind, shard)).with_extension("json")
}

/// One shard, as the manifest lists it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardRecord {
    /// Its file name, without folder.
    pub file: String,
    /// Number of rows.
    pub rows: u64,
    /// How many of them are solved.
    pub solved: u64,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// SHA-256 of the file, lower-case hexadecimal.
    pub sha256: String,
}

impl ShardRecord {
    /// The record of a file with these rows and bytes.
    pub fn new(file: String, samples: &[Sample], bytes: &[u8]) -> Self {
        let [rows, solved] = counts(samples);
        Self { file, rows, solved, bytes: bytes.len() as u64, sha256: sha256_hex(&[bytes]) }
    }

    /// Whether `bytes` are the file's.
    pub fn fits(&self, bytes: &[u8]) -> bool {
        self.bytes == bytes.len() as u64 && self.sha256 == sha256_hex(&[bytes])
    }

    /// Whether it counts `samples` right.
    pub fn counts_fit(&self, samples: &[Sample]) -> bool {
        [self.rows, self.solved] == counts(samples)
    }
}

/// All rows, and the solved ones.
fn counts(samples: &[Sample]) -> [u64; 2] {
    let solved = samples.iter().filter(|s| s.status == Status::Solved).count();
    [samples.len() as u64, solved as u64]
}

/// All shards of one parking type, in order. Its presence means that they are complete.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The parking type.
    pub parking_type: ParkingType,
    /// Rows of all shards.
    pub rows: u64,
    /// Solved rows of all shards.
    pub solved: u64,
    /// The shards.
    pub shards: Vec<ShardRecord>,
}

impl Manifest {
    /// The manifest of these shards.
    pub fn new(parking_type: ParkingType, shards: Vec<ShardRecord>) -> Self {
        let sum = |of: fn(&ShardRecord) -> u64| shards.iter().map(of).sum();
        Self { parking_type, rows: sum(|s| s.rows), solved: sum(|s| s.solved), shards }
    }

    /// Whether it lists exactly the shards that `metadata` asks for.
    pub fn fits(&self, metadata: &Metadata, kind: ParkingType) -> bool {
        let listed = self.shards.iter().map(|s| (s.file.clone(), s.rows));
        let expected = (0..metadata.shard_count(kind)).map(|shard| {
            let cells = metadata.shard_cells(kind, shard);
            (shard_name(kind, shard), cells.len() as u64 * u64::from(metadata.samples_per_cell))
        });
        self.parking_type == kind && listed.eq(expected)
    }
}

impl Metadata {
    /// Number of shards of a type.
    pub fn shard_count(&self, kind: ParkingType) -> usize {
        self.grid.cell_count(kind).div_ceil(self.cells_per_shard as usize)
    }

    /// Indices of a shard's cells.
    pub fn shard_cells(&self, kind: ParkingType, shard: usize) -> std::ops::Range<u32> {
        let cells = |shard: usize| {
            (shard * self.cells_per_shard as usize).min(self.grid.cell_count(kind)) as u32
        };
        cells(shard)..cells(shard + 1)
    }
}

/// What the folder says about a type's shards, by index: records first, then the manifest,
/// since a run that finishes beside this one replaces them in that order. Unreadable ones
/// count as absent: the shard is collected again then.
pub(super) fn known_shards(
    folder: &Path,
    metadata: &Metadata,
    kind: ParkingType,
) -> BTreeMap<usize, ShardRecord> {
    let mut known: BTreeMap<usize, ShardRecord> = (0..metadata.shard_count(kind))
        .filter_map(|shard| Some((shard, read_json(&record_path(folder, kind, shard))?)))
        .collect();
    if let Some(manifest) = read_json::<Manifest>(&manifest_path(folder, kind))
        && manifest.fits(metadata, kind)
    {
        known.extend(manifest.shards.into_iter().enumerate());
    }
    known
}

/// Writes the manifest and removes the records that it replaces; an error with its file.
pub(super) fn complete(folder: &Path, manifest: &Manifest) -> Result<(), (PathBuf, io::Error)> {
    let kind = manifest.parking_type;
    let path = manifest_path(folder, kind);
    let bytes = to_json(manifest);
    if fs::read(&path).ok().as_deref() != Some(&bytes) {
        write_whole(&path, &bytes).map_err(|e| (path, e))?;
    }
    (0..manifest.shards.len()).try_for_each(|shard| {
        let path = record_path(folder, kind, shard);
        remove_if_present(&path).map_err(|e| (path, e))
    })
}

fn read_json<T: for<'de> Deserialize<'de>>(path: &Path) -> Option<T> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// The bytes of a JSON file: indented, newline at the end.
pub(super) fn to_json(value: &impl Serialize) -> Vec<u8> {
    let mut bytes = serde_json::to_vec_pretty(value).expect("plain data");
    bytes.push(b'\n');
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::dataset::CollectConfig;

    #[test]
    fn shards_cover_every_cell_once() {
        let metadata = CollectConfig { cells_per_shard: 10, ..Default::default() }.metadata();
        for kind in ParkingType::ALL {
            let cells: Vec<u32> = (0..metadata.shard_count(kind))
                .flat_map(|shard| metadata.shard_cells(kind, shard))
                .collect();
            assert!(cells.iter().copied().eq(0..metadata.grid.cell_count(kind) as u32));
        }
    }
}
