//! Collects a data set: cells → samples → shards, in any number of runs, threads and processes.
//!
//! Every file is written under a temporary name and renamed, so a run may be killed at any
//! moment; [`CollectOptions::resume`] then ends with the bytes of an uninterrupted run. A shard
//! counts as finished when its bytes have the checksum of its record, nothing less.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use parquet::errors::ParquetError;
use rayon::prelude::*;

use super::config::{CollectConfig, ConfigError};
use super::manifest::{
    Manifest, ShardRecord, complete, known_shards, manifest_path, metadata_path, record_path,
    shard_name, to_json,
};
use super::part::Part;
use super::read::{DatasetError, read_metadata};
use super::sampler::Sampler;
use super::schema::{Difference, Metadata, Sample};
use super::write::encode;
use crate::files::{TEMPORARY, reason, remove_if_present, write_whole};
use crate::lab::shards::Unfinished;
use crate::world::ParkingType;

/// How a collection runs; none of it changes the bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct CollectOptions {
    /// Go on with what an earlier run left; without it, existing shards are an error.
    pub resume: bool,
    /// Which shards this process collects.
    pub part: Part,
}

/// What the folder holds of one type after a collection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeReport {
    /// The type.
    pub kind: ParkingType,
    /// Rows of the finished shards.
    pub rows: u64,
    /// Solved ones among them.
    pub solved: u64,
    /// Size of these shards, bytes.
    pub bytes: u64,
    /// Rows that this run collected; the others were there.
    pub collected_rows: u64,
    /// Shards that still lack; 0 when the type is complete.
    pub missing_shards: usize,
}

impl TypeReport {
    /// Of shards that are listed in `manifest`.
    pub(super) fn new(manifest: &Manifest, collected_rows: u64, missing_shards: usize) -> Self {
        Self {
            kind: manifest.parking_type,
            rows: manifest.rows,
            solved: manifest.solved,
            bytes: manifest.shards.iter().map(|s| s.bytes).sum(),
            collected_rows,
            missing_shards,
        }
    }
}

/// Why a collection ended early.
#[derive(Debug, thiserror::Error)]
pub enum CollectError {
    /// The settings are not usable.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The folder's `metadata.json` cannot be used.
    #[error(transparent)]
    Metadata(#[from] DatasetError),
    /// The folder cannot be made or written to.
    #[error("{path}: this folder cannot be written: {}; choose another --out", reason(source))]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The folder holds something else.
    #[error("{path}: holds other files and no metadata.json; give --out a new folder")]
    NotADataset {
        /// The folder.
        path: PathBuf,
    },
    /// There are shards already.
    #[error(
        "{path}: already holds {kind} samples; finish them with --resume, use another --out or \
         delete them"
    )]
    Exists {
        /// The folder.
        path: PathBuf,
        /// The type of the samples found.
        kind: ParkingType,
    },
    /// The folder was begun with other settings.
    #[error(
        "{path}: was collected with another configuration: {difference}; use another --out or \
         delete it"
    )]
    OtherSettings {
        /// The folder.
        path: PathBuf,
        /// The first setting that differs.
        difference: Difference,
    },
    /// The folder was begun by another build and is not finished; mixing the two would not be
    /// reproducible.
    #[error(
        "{path}: was begun by another build: {difference}; finish it with that build, use \
         another --out or delete it"
    )]
    OtherBuild {
        /// The folder.
        path: PathBuf,
        /// Version or revision of both builds.
        difference: Difference,
    },
    /// Shards to merge are not there, damaged or another's.
    #[error(transparent)]
    Unfinished(#[from] Unfinished),
    /// A file could not be written or removed.
    #[error("{path}: cannot be written: {}", reason(source))]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Rows could not be encoded (our bug).
    #[error("{path}: cannot be encoded: {source}")]
    Encode {
        /// The file.
        path: PathBuf,
        /// Why.
        source: ParquetError,
    },
}

impl CollectError {
    /// Whether the caller's input is at fault, not the disk or this crate.
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Write { .. } | Self::Encode { .. })
    }
}

/// Collects `kinds` into `folder` on the current rayon pool. `progress` counts samples.
///
/// The folder may hold other types of the same settings. When `options.part` is not all, the
/// type is complete once every part is; whichever run finds all shards writes the manifest.
/// No two processes may collect the same part at once.
pub fn collect(
    config: &CollectConfig,
    folder: &Path,
    kinds: &[ParkingType],
    options: CollectOptions,
    progress: &ProgressBar,
) -> Result<Vec<TypeReport>, CollectError> {
    collect_with(config, folder, kinds, options, progress, || {
        let mut sampler = Sampler::new(config);
        move |kind, cell, sample| sampler.sample(kind, cell, sample)
    })
}

/// [`collect`] with another way to make samples: `make_solver` is called per worker, and its
/// solver with type, cell index and sample index, which alone decide the row.
pub fn collect_with<S>(
    config: &CollectConfig,
    folder: &Path,
    kinds: &[ParkingType],
    options: CollectOptions,
    progress: &ProgressBar,
    make_solver: impl Fn() -> S + Sync,
) -> Result<Vec<TypeReport>, CollectError>
where
    S: FnMut(ParkingType, u32, u32) -> Sample,
{
    config.validate()?;
    let metadata = open_folder(folder, &config.metadata())?;
    let run = Run { folder, metadata: &metadata, options, progress };
    let states =
        kinds.iter().map(|kind| run.state(*kind)).collect::<Result<Vec<TypeState>, _>>()?;
    let unfinished = states.iter().any(|state| !state.todo.is_empty());
    if unfinished && let Some(difference) = metadata.build_difference(&config.metadata()) {
        return Err(CollectError::OtherBuild { path: folder.to_owned(), difference });
    }
    let rows = |state: &TypeState, shards: &[usize]| -> u64 {
        shards.iter().map(|shard| run.rows(state.kind, *shard)).sum()
    };
    let todo: u64 = states.iter().map(|state| rows(state, &state.todo)).sum();
    progress.set_length(todo);
    states.into_iter().map(|state| run.finish(state, &make_solver)).collect()
}

/// Makes the folder a data set of these settings, or checks that it is one; its metadata.
fn open_folder(folder: &Path, current: &Metadata) -> Result<Metadata, CollectError> {
    let unwritable = |source| CollectError::Folder { path: folder.to_owned(), source };
    fs::create_dir_all(folder).map_err(unwritable)?;
    let path = metadata_path(folder);
    if path.exists() {
        let stored = read_metadata(folder)?;
        return match stored.settings_difference(current) {
            None => Ok(stored),
            Some(difference) => {
                Err(CollectError::OtherSettings { path: folder.to_owned(), difference })
            }
        };
    }
    let others = names(folder).map_err(unwritable)?;
    if !others.iter().all(|name| name.ends_with(TEMPORARY)) {
        return Err(CollectError::NotADataset { path: folder.to_owned() });
    }
    write_whole(&path, &to_json(current)).map_err(unwritable)?;
    Ok(current.clone())
}

fn names(folder: &Path) -> io::Result<Vec<String>> {
    fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into())).collect()
}

/// One call of [`collect_with`].
struct Run<'a> {
    folder: &'a Path,
    metadata: &'a Metadata,
    options: CollectOptions,
    progress: &'a ProgressBar,
}

/// A type before its collection.
struct TypeState {
    kind: ParkingType,
    /// Finished shards; those of other parts by their records alone.
    done: BTreeMap<usize, ShardRecord>,
    /// Shards of this part to collect.
    todo: Vec<usize>,
}

impl Run<'_> {
    /// What is there of a type, and what lacks.
    fn state(&self, kind: ParkingType) -> Result<TypeState, CollectError> {
        let mine = (0..self.metadata.shard_count(kind)).filter(|s| self.options.part.contains(*s));
        if !self.options.resume {
            let exists = manifest_path(self.folder, kind).exists()
                || mine.clone().any(|s| self.folder.join(shard_name(kind, s)).exists());
            if exists {
                return Err(CollectError::Exists { path: self.folder.to_owned(), kind });
            }
        }
        let done = self.done(kind, |shard| self.options.part.contains(shard));
        let todo = mine.filter(|shard| !done.contains_key(shard)).collect();
        Ok(TypeState { kind, done, todo })
    }

    /// The shards of a type that are on record and there; of those to `check`, whose bytes have the checksum.
    fn done(
        &self,
        kind: ParkingType,
        check: impl Fn(usize) -> bool + Sync,
    ) -> BTreeMap<usize, ShardRecord> {
        known_shards(self.folder, self.metadata, kind)
            .into_par_iter()
            .filter(|(shard, record)| {
                let path = self.folder.join(shard_name(kind, *shard));
                match check(*shard) {
                    true => fs::read(path).is_ok_and(|bytes| record.fits(&bytes)),
                    false => path.exists(),
                }
            })
            .collect()
    }

    fn rows(&self, kind: ParkingType, shard: usize) -> u64 {
        let cells = self.metadata.shard_cells(kind, shard).len() as u64;
        cells * u64::from(self.metadata.samples_per_cell)
    }

    /// Collects what lacks of a type; with all shards there, writes the manifest.
    fn finish<S>(
        &self,
        state: TypeState,
        make_solver: &(impl Fn() -> S + Sync),
    ) -> Result<TypeReport, CollectError>
    where
        S: FnMut(ParkingType, u32, u32) -> Sample,
    {
        let TypeState { kind, done: before, todo } = state;
        self.remove_leftovers(kind)?;
        let mut collected_rows = 0;
        for shard in &todo {
            self.progress.set_message(shard_name(kind, *shard));
            collected_rows += self.collect_shard(kind, *shard, make_solver)?.rows;
        }
        let count = self.metadata.shard_count(kind);
        let done = match todo.is_empty() && self.options.part == Part::ALL {
            true => before,
            // Other parts may have gone on meanwhile. Only who finds all there reads what they wrote.
            false => match self.done(kind, |_| false) {
                all if all.len() == count => self.done(kind, |_| true),
                some => some,
            },
        };
        let missing_shards = count - done.len();
        let manifest = Manifest::new(kind, done.into_values().collect());
        if missing_shards == 0 {
            complete(self.folder, &manifest)
                .map_err(|(path, source)| CollectError::Write { path, source })?;
        }
        Ok(TypeReport::new(&manifest, collected_rows, missing_shards))
    }

    fn collect_shard<S>(
        &self,
        kind: ParkingType,
        shard: usize,
        make_solver: &(impl Fn() -> S + Sync),
    ) -> Result<ShardRecord, CollectError>
    where
        S: FnMut(ParkingType, u32, u32) -> Sample,
    {
        let first = self.metadata.shard_cells(kind, shard).start;
        let per_cell = self.metadata.samples_per_cell;
        // Over samples, not cells: one hard cell would leave the other workers idle.
        let samples: Vec<Sample> = (0..self.rows(kind, shard) as u32)
            .into_par_iter()
            .map_init(make_solver, |solve, row| {
                let sample = solve(kind, first + row / per_cell, row % per_cell);
                self.progress.inc(1);
                sample
            })
            .collect();
        let name = shard_name(kind, shard);
        let path = self.folder.join(&name);
        let bytes = encode(self.metadata, &samples)
            .map_err(|source| CollectError::Encode { path: path.clone(), source })?;
        let record = ShardRecord::new(name, &samples, &bytes);
        self.write(&path, &bytes)?;
        self.write(&record_path(self.folder, kind, shard), &to_json(&record))?;
        Ok(record)
    }

    /// Removes the temporary files that killed runs of this part left of a type.
    fn remove_leftovers(&self, kind: ParkingType) -> Result<(), CollectError> {
        let prefix = format!("{kind}-");
        let mine = |name: &&String| {
            let shard = name.strip_prefix(&prefix).and_then(|rest| rest.split('.').next());
            let card = self.folder.join("card.md");
            let whole = [manifest_path(self.folder, kind), metadata_path(self.folder), card];
            name.ends_with(TEMPORARY)
                && match shard.and_then(|digits| digits.parse().ok()) {
                    Some(shard) => self.options.part.contains(shard),
                    None => whole.iter().any(|path| {
                        let whole = path.file_name().unwrap_or_default().to_string_lossy();
                        name.starts_with(&*whole)
                    }),
                }
        };
        let names = names(self.folder)
            .map_err(|source| CollectError::Write { path: self.folder.to_owned(), source })?;
        names.iter().filter(mine).try_for_each(|name| self.remove(self.folder.join(name)))
    }

    fn remove(&self, path: PathBuf) -> Result<(), CollectError> {
        remove_if_present(&path).map_err(|source| CollectError::Write { path, source })
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), CollectError> {
        write_whole(path, bytes)
            .map_err(|source| CollectError::Write { path: path.to_owned(), source })
    }
}
