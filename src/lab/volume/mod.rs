//! Volume: very many scenes, each planned once by `n3p` and checked by the independent
//! [`oracle`](crate::lab::evaluation::oracle).
//!
//! A [`VolumeConfig`] says which scenes; a number stands for each ([`draw`]). They are planned in shards, of
//! which every one leaves a [`record`] that is whole or absent, so that a run may be killed anywhere and goes
//! on ([`run()`]), and be shared among processes and machines. [`report`] puts the records together; a
//! [`mod@merge`] refuses to where one lacks or is another's.
//! What the records say but for times depends on configuration and build alone.

pub mod config;
pub mod draw;
pub mod merge;
pub mod record;
pub mod report;
pub mod run;

pub use config::{VolumeConfig, VolumeWorld};
pub use merge::{merge, shards};
pub use record::{Counts, Extreme, ShardRecord};
pub use report::Totals;
pub use run::{VolumeError, VolumeOptions, run};
