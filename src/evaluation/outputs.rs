//! Where a run's results go: rows as they come, tables and reports at the end.

use std::io;
use std::path::{Path, PathBuf};

use super::episode::{Case, Episode};
use super::export::{PathFile, PathFileError};
use super::report::{self, Provenance};
use super::rows::{self, Row, RowWriter, RowsError};
use crate::files::{reason, remove_leftovers, write_whole};

/// The folders of a run; either may be absent.
pub struct Outputs {
    out: Option<PathBuf>,
    paths: Option<PathBuf>,
    writer: Option<RowWriter>,
}

/// Results that cannot be saved.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// An output folder cannot be made.
    #[error("{path}: cannot be an output folder: {}; choose one you can write to", reason(error))]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
    /// Rows cannot be written, or read back.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// A path file cannot be written.
    #[error(transparent)]
    Path(#[from] PathFileError),
    /// The report cannot be written.
    #[error("{path}: {}", reason(error))]
    Report {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
}

impl Outputs {
    /// Makes the folders, removes what killed runs left in them and begins `OUT/rows.csv`.
    pub fn create(out: Option<&Path>, paths: Option<&Path>) -> Result<Self, OutputError> {
        for path in out.into_iter().chain(paths) {
            std::fs::create_dir_all(path)
                .and_then(|()| remove_leftovers(path))
                .map_err(|error| OutputError::Folder { path: path.to_owned(), error })?;
        }
        let writer = out.map(|dir| RowWriter::create(&dir.join("rows.csv"))).transpose()?;
        Ok(Self { out: out.map(Path::to_owned), paths: paths.map(Path::to_owned), writer })
    }

    /// As [`Outputs::create`] for `out`, keeping the rows that an interrupted run left.
    pub fn resume(out: &Path) -> Result<(Self, Vec<Row>), OutputError> {
        let file = out.join("rows.csv");
        let done = if file.exists() { rows::read_csv(&file)? } else { Vec::new() };
        let mut outputs = Self::create(Some(out), None)?;
        for row in &done {
            outputs.push(row)?;
        }
        Ok((outputs, done))
    }

    /// Saves one episode: its row, and its path where paths are wanted.
    pub fn take(&mut self, case: &Case, episode: &Episode) -> Result<(), OutputError> {
        self.push(&episode.row)?;
        if let (Some(dir), Some(path)) = (&self.paths, &episode.path) {
            path.write(&dir.join(PathFile::file_name(&case.scene, &episode.row.method)))?;
        }
        Ok(())
    }

    fn push(&mut self, row: &Row) -> Result<(), OutputError> {
        if let Some(writer) = &mut self.writer {
            writer.push(row)?;
        }
        Ok(())
    }

    /// Writes `rows.parquet` and `report.md`, where an output folder is wanted.
    pub fn finish(
        self,
        title: &str,
        rows: &[Row],
        provenance: &Provenance,
    ) -> Result<(), OutputError> {
        let Some(dir) = self.out else { return Ok(()) };
        rows::write_parquet(&dir.join("rows.parquet"), rows)?;
        let path = dir.join("report.md");
        write_whole(&path, report::markdown(title, rows, provenance).as_bytes())
            .map_err(|error| OutputError::Report { path, error })
    }
}
