//! Volume runs shared among processes: what a folder holds of one, and the merge at its end.

use std::io::ErrorKind;
use std::path::Path;

use super::run::{failed, is_this_build};
use super::{ShardRecord, Totals, VolumeConfig, VolumeError};
use crate::lab::shards::{Shard, Shards, State};

/// What the folder `out` holds of a run; nothing is written.
///
/// # Errors
///
/// Where the folder cannot be read or is another configuration's.
pub fn shards(config: &VolumeConfig, out: &Path) -> Result<Shards, VolumeError> {
    check_settings(config, out)?;
    let shard = |shard| Shard {
        part: shard as usize + 1,
        file: ShardRecord::file_name(shard),
        state: state(config, out, shard),
    };
    let shards = (0..config.shards()).map(shard).collect();
    Ok(Shards { parts: config.shards() as usize, shards })
}

fn state(config: &VolumeConfig, out: &Path, shard: u64) -> State {
    match ShardRecord::read_or_why(out, shard) {
        Err(state) => state,
        Ok(record) if record.config_sha256 != config.sha256() => {
            State::Foreign("it is the record of another configuration".to_owned())
        }
        Ok(record) if !is_this_build(&record) => {
            let ShardRecord { crate_version, git_revision, .. } = record;
            State::Foreign(format!("it is of another build, {crate_version} ({git_revision})"))
        }
        Ok(_) => State::Finished,
    }
}

/// Puts the records together that other processes left in `out`.
///
/// # Errors
///
/// As [`shards`], and where one is missing, damaged or another's: nothing is written then.
pub fn merge(config: &VolumeConfig, out: &Path) -> Result<Totals, VolumeError> {
    shards(config, out)?.need_all(out)?;
    Totals::read(config, out)
}

/// Whether the folder has these settings; `false` where it has none yet.
pub(super) fn check_settings(config: &VolumeConfig, out: &Path) -> Result<bool, VolumeError> {
    let settings = out.join("config.toml");
    match std::fs::read_to_string(&settings) {
        Ok(text) if text == config.to_toml() => Ok(true),
        Ok(_) => {
            let what = "holds the records of another configuration";
            Err(VolumeError::Other { path: out.to_owned(), what })
        }
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
        Err(e) => Err(failed(&settings)(e)),
    }
}
