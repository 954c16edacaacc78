//! Where a run's results go: rows as they come, tables and reports at the end.

use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

use super::drives;
use super::html;
use super::learning_curve::CurvePoint;
use super::report::{self, Provenance};
use super::rows::{self, RowWriter, RowsError};
use super::trace::{self, Trace, TraceWriter};
use crate::episode::{self, Case, Episode, Row};
use crate::files::{reason, remove_leftovers, write_whole};
use crate::lab::driving::{Drive, DriveRow};
use crate::n3p::Models;
use crate::output::{PathFile, PathFileError};

/// The folders of a run; either may be absent.
pub struct Outputs {
    out: Option<PathBuf>,
    paths: Option<PathBuf>,
    writers: Option<(TraceWriter, RowWriter)>,
    drives: Vec<DriveRow>,
}

const TRACES: &str = "traces.jsonl";

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
    /// Traces or a report cannot be written, or traces not read back.
    #[error("{path}: {}", reason(error))]
    File {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
}

impl Outputs {
    /// Makes the folders, removes what killed runs left in them and begins `OUT/rows.csv`
    /// and `OUT/traces.jsonl`.
    pub fn create(out: Option<&Path>, paths: Option<&Path>) -> Result<Self, OutputError> {
        for path in out.into_iter().chain(paths) {
            std::fs::create_dir_all(path)
                .and_then(|()| remove_leftovers(path))
                .map_err(|error| OutputError::Folder { path: path.to_owned(), error })?;
        }
        let begin = |dir: &Path| -> Result<_, OutputError> {
            let path = dir.join(TRACES);
            let traces = TraceWriter::create(&path);
            let traces = traces.map_err(|error| OutputError::File { path, error })?;
            Ok((traces, RowWriter::create(&dir.join("rows.csv"))?))
        };
        let writers = out.map(begin).transpose()?;
        let [out, paths] = [out, paths].map(|path| path.map(Path::to_owned));
        Ok(Self { out, paths, writers, drives: Vec::new() })
    }

    /// As [`Outputs::create`] for `out`, keeping the rows that an interrupted run left, and
    /// their traces.
    pub fn resume(out: &Path) -> Result<(Self, Vec<Row>), OutputError> {
        let (file, traces) = (out.join("rows.csv"), out.join(TRACES));
        let done = if file.exists() { rows::read_csv(&file)? } else { Vec::new() };
        let scenes: HashSet<&str> = done.iter().map(|r| r.scene.as_str()).collect();
        let keys: HashSet<_> = done.iter().map(Row::key).collect();
        let mut traces = trace::read(&traces, &scenes)
            .map_err(|error| OutputError::File { path: traces, error })?;
        traces.retain(|t| keys.contains(&t.key()));
        let mut outputs = Self::create(Some(out), None)?;
        traces.iter().try_for_each(|t| outputs.push_trace(t))?;
        done.iter().try_for_each(|row| outputs.push(row))?;
        Ok((outputs, done))
    }

    /// Saves one episode, whose method was built from `models`: its trace, its row, what became of it if it
    /// was driven, and its path where paths are wanted.
    pub fn take(
        &mut self,
        case: &Case,
        episode: &Episode,
        models: &Models,
        drive: Option<Drive>,
    ) -> Result<(), OutputError> {
        if self.writers.is_some() {
            let driven = drive.as_ref().map_or(&[][..], |drive| &drive.poses);
            self.push_trace(&Trace::new(episode, models, driven))?;
        }
        self.drives.extend(drive.map(|drive| drive.row));
        self.push(&episode.row)?;
        if let (Some(dir), Some(path)) = (&self.paths, &episode.path) {
            path.write(&dir.join(PathFile::file_name(&case.scene, &episode.row.method)))?;
        }
        Ok(())
    }

    /// What became of the plans that were driven, so far.
    pub fn drives(&self) -> &[DriveRow] {
        &self.drives
    }

    fn push(&mut self, row: &Row) -> Result<(), OutputError> {
        if let Some((_, rows)) = &mut self.writers {
            rows.push(row)?;
        }
        Ok(())
    }

    fn push_trace(&mut self, trace: &Trace) -> Result<(), OutputError> {
        if let (Some((traces, _)), Some(dir)) = (&mut self.writers, &self.out) {
            traces
                .push(trace)
                .map_err(|error| OutputError::File { path: dir.join(TRACES), error })?;
        }
        Ok(())
    }

    /// Compares the rows of a run that is complete ([`episode::fill`]), then writes `rows.csv`
    /// anew, `rows.parquet`, `report.md` and `report.html`, where an output folder is wanted.
    /// `cases` are the scenes of `rows`; `curve` may be empty.
    pub fn finish(
        self,
        title: &str,
        cases: &[Case],
        rows: &mut [Row],
        curve: &[CurvePoint],
        provenance: &Provenance,
    ) -> Result<(), OutputError> {
        episode::fill(rows);
        let Some(dir) = self.out else { return Ok(()) };
        rows::write_csv(&dir.join("rows.csv"), rows)?;
        rows::write_parquet(&dir.join("rows.parquet"), rows)?;
        let write = |name: &str, text: String| {
            let path = dir.join(name);
            write_whole(&path, text.as_bytes()).map_err(|error| OutputError::File { path, error })
        };
        let mut markdown = report::markdown(title, rows, curve, provenance);
        if !self.drives.is_empty() {
            let table = drives::table(&self.drives).markdown();
            markdown += &format!("\n{table}\n{}\n", drives::NOTE);
            write("drives.csv", drives::csv(&self.drives))?;
        }
        write("report.md", markdown)?;
        let shown = html::gallery::chosen(cases, rows);
        let scenes = shown.iter().map(|c| c.scene.name.as_str()).collect();
        let path = dir.join(TRACES);
        let traces =
            trace::read(&path, &scenes).map_err(|error| OutputError::File { path, error })?;
        write("report.html", html::page(title, rows, curve, provenance, &shown, &traces))
    }
}
