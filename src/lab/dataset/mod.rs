//! Training data: Reeds-Shepp start poses of solved problems in abstracted environments.
//!
//! A data set is a folder, `datasets/NAME/`:
//!
//! | file | holds |
//! |---|---|
//! | `metadata.json` | the settings every file shares; written first |
//! | `TYPE-0003.parquet` | one shard: some consecutive cells of one parking type |
//! | `TYPE-0003.json` | its checksum and counts, until the manifest takes them over |
//! | `TYPE.manifest.json` | checksums and counts of all shards; written last |
//! | `card.md` | what it is and what is in it, for people; written by `n3p-collect` |
//!
//! A type without manifest is incomplete. Poses are rear-axle poses in the spot frame.
//!
//! [`schema`] defines one row; [`config`] what is collected; [`sampler`] draws and solves one
//! sample; [`mod@collect`] runs the collection and [`mod@write`] its files; [`manifest`] is the folder's
//! bookkeeping, [`mod@merge`] puts together what several processes collected; [`read`] gives the rows back, [`summary`] tells of them; [`content_sha256`] names them; [`split`] picks the cells that validate, [`Subset`] a part of
//! the whole.

pub mod card;
pub mod collect;
pub mod config;
mod identity;
pub mod manifest;
pub mod merge;
mod part;
pub mod read;
pub mod sampler;
pub mod schema;
pub mod split;
mod subset;
pub mod summary;
pub mod write;

pub use collect::{CollectError, CollectOptions, TypeReport, collect};
pub use config::{CollectConfig, ConfigError};
pub use identity::content_sha256;
pub use merge::{merge, shards};
pub use part::Part;
pub use read::{Dataset, DatasetError};
pub use schema::{Metadata, Sample, Status};
pub use split::validation_cells;
pub use subset::Subset;
pub use summary::Summary;
