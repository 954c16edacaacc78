//! Collections shared among processes: what a folder holds of one, and the merge at its end.

use std::io::ErrorKind;
use std::path::Path;

use rayon::prelude::*;

use super::collect::{CollectError, TypeReport};
use super::config::CollectConfig;
use super::manifest::{Manifest, complete, known_shards, metadata_path, shard_name};
use super::read::{DatasetError, decode, open_checked, read_metadata};
use super::schema::Metadata;
use crate::files::reason;
use crate::lab::shards::{Shard, Shards, State};
use crate::world::ParkingType;

/// What `folder` holds of a collection; nothing is written. Every file's bytes and rows are checked.
///
/// # Errors
///
/// Where settings or folder cannot be used, or the folder is another collection's or, unfinished, another build's.
pub fn shards(
    config: &CollectConfig,
    folder: &Path,
    kinds: &[ParkingType],
) -> Result<Shards, CollectError> {
    config.validate()?;
    let current = config.metadata();
    // No folder yet: nothing is finished.
    let metadata = match metadata_path(folder).exists() {
        true => read_metadata(folder)?,
        false => current.clone(),
    };
    let path = || folder.to_owned();
    if let Some(difference) = metadata.settings_difference(&current) {
        return Err(CollectError::OtherSettings { path: path(), difference });
    }
    let of = |&kind: &ParkingType| states(folder, &metadata, kind);
    let shards: Vec<Shard> = kinds.iter().flat_map(of).collect();
    let unfinished = shards.iter().any(|s| s.state != State::Finished);
    if unfinished && let Some(difference) = metadata.build_difference(&current) {
        return Err(CollectError::OtherBuild { path: path(), difference });
    }
    let parts = kinds.iter().map(|&kind| metadata.shard_count(kind)).max().unwrap_or(1);
    Ok(Shards { parts, shards })
}

/// The shards of a type.
fn states(folder: &Path, metadata: &Metadata, kind: ParkingType) -> Vec<Shard> {
    let known = known_shards(folder, metadata, kind);
    let state = |index: usize| {
        let file = shard_name(kind, index);
        let Some(record) = known.get(&index) else {
            // Killed between shard and record, or in a record's place lies something else.
            return State::Missing;
        };
        let samples = match open_checked(&folder.join(&file), record) {
            Err(DatasetError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                return State::Missing;
            }
            Err(DatasetError::Io { source, .. }) => return State::Damaged(reason(&source)),
            Err(_) => {
                return State::Damaged("its bytes have not the checksum on record".to_owned());
            }
            Ok(opened) => decode(opened, metadata, kind, index),
        };
        match samples {
            Err(why) => State::Foreign(why),
            Ok(samples) if record.counts_fit(&samples) => State::Finished,
            Ok(_) => State::Damaged("its rows are not those on record".to_owned()),
        }
    };
    (0..metadata.shard_count(kind))
        .into_par_iter()
        .map(|index| Shard { part: index + 1, file: shard_name(kind, index), state: state(index) })
        .collect()
}

/// Completes these types from shards that other processes collected into `folder`: the same bytes as of one
/// process.
///
/// # Errors
///
/// As [`shards`], and where one is missing, damaged or another's: nothing is written then.
pub fn merge(
    config: &CollectConfig,
    folder: &Path,
    kinds: &[ParkingType],
) -> Result<Vec<TypeReport>, CollectError> {
    shards(config, folder, kinds)?.need_all(folder)?;
    let metadata = read_metadata(folder)?;
    let merged = |&kind: &ParkingType| {
        let known = known_shards(folder, &metadata, kind);
        let manifest = Manifest::new(kind, known.into_values().collect());
        complete(folder, &manifest)
            .map_err(|(path, source)| CollectError::Write { path, source })?;
        Ok(TypeReport::new(&manifest, 0, 0))
    };
    kinds.iter().map(merged).collect()
}
