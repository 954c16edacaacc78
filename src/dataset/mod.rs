//! Training data: Reeds-Shepp start poses of solved problems in abstracted environments.
//!
//! [`schema`] defines one row; collection, writing and reading follow it.

pub mod schema;

pub use schema::{Metadata, Sample, Status};
