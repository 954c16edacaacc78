//! Where a run's results go: rows as they come, tables and reports at the end.

use std::collections::HashSet;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::drives;
use super::html;
use super::learning_curve::CurvePoint;
use super::report::{self, Provenance, Results};
use super::rows::{self, RowWriter, RowsError};
use super::trace::{self, Trace};
use crate::episode::{self, Case, Episode, Row};
use crate::files::{
    Keeper, keep, reason, remove_if_present, remove_leftovers, sha256_hex, write_whole,
};
use crate::lab::dataset::schema::GIT_REVISION;
use crate::lab::driving::{Drive, DriveRow};
use crate::n3p::{Method, Models};
use crate::output::{PathFile, PathFileError};

/// The folders of a run; either may be absent.
pub struct Outputs {
    out: Option<PathBuf>,
    paths: Option<PathBuf>,
    writers: Option<Writers>,
    drives: Vec<DriveRow>,
}

/// What grows while a run goes on.
struct Writers {
    rows: RowWriter,
    traces: LineWriter,
    drives: LineWriter,
}

const ROWS: &str = "rows.csv";
const TRACES: &str = "traces.jsonl";
const DRIVES: &str = "drives.jsonl";

/// Appends values to a file of JSON lines, each flushed at once.
struct LineWriter {
    path: PathBuf,
    file: File,
}

impl LineWriter {
    /// Begins `path` anew.
    fn create(path: &Path) -> Result<Self, OutputError> {
        Self::opened(path, File::create(path))
    }

    /// Goes on after the lines of these values.
    fn go_on<T: Serialize>(path: &Path, values: &[T]) -> Result<Self, OutputError> {
        let text: String = values.iter().map(line).collect();
        let written = write_whole(path, text.as_bytes());
        Self::opened(path, written.and_then(|()| File::options().append(true).open(path)))
    }

    fn opened(path: &Path, file: io::Result<File>) -> Result<Self, OutputError> {
        let path = path.to_owned();
        match file {
            Ok(file) => Ok(Self { path, file }),
            Err(error) => Err(OutputError::File { path, error }),
        }
    }

    fn push(&mut self, value: &impl Serialize) -> Result<(), OutputError> {
        // One unbuffered write: nothing waits in this process.
        let written = self.file.write_all(line(value).as_bytes());
        written.map_err(|error| OutputError::File { path: self.path.clone(), error })
    }
}

fn line(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plain numbers and strings") + "\n"
}

fn make_folders(out: Option<&Path>, paths: Option<&Path>) -> Result<(), OutputError> {
    out.into_iter().chain(paths).try_for_each(|path| {
        std::fs::create_dir_all(path)
            .and_then(|()| remove_leftovers(path))
            .map_err(|error| OutputError::Folder { path: path.to_owned(), error })
    })
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
    /// Traces or a report cannot be written, or traces not read back.
    #[error("{path}: {}", reason(error))]
    File {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
}

/// Which run began a folder: `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Of the build.
    pub crate_version: String,
    /// Of the build.
    pub git_revision: String,
    /// Over everything that decides rows but times: scenes, methods, models, settings.
    pub settings_sha256: String,
}

const RECORD: &str = "run.json";

impl RunRecord {
    /// Of this build, with `settings` written out.
    pub fn new(settings: &[&[u8]]) -> Self {
        Self {
            crate_version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: GIT_REVISION.to_owned(),
            settings_sha256: sha256_hex(settings),
        }
    }

    /// Keeps `out` for this process and records that this run begins there, or checks that it is the one that
    /// began there: `None` where another one did, or rows are of none.
    #[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
    pub fn claim(&self, out: &Path, goes_on: bool) -> Result<Option<Keeper>, OutputError> {
        make_folders(Some(out), None)?;
        let folder = |error| OutputError::Folder { path: out.to_owned(), error };
        let keeper = keep(out).map_err(folder)?;
        let path = out.join(RECORD);
        if goes_on && out.join(ROWS).exists() {
            let found = std::fs::read(&path).ok();
            let found = found.and_then(|bytes| serde_json::from_slice::<Self>(&bytes).ok());
            return Ok((found.as_ref() == Some(self)).then_some(keeper));
        }
        let json = serde_json::to_string_pretty(self).expect("plain data") + "\n";
        // Rows of another run go before the record says that they are of this one.
        remove_if_present(&out.join(ROWS))
            .and_then(|()| write_whole(&path, json.as_bytes()))
            .map_err(|error| OutputError::File { path, error })?;
        Ok(Some(keeper))
    }
}

impl Outputs {
    /// Makes the folders, removes what killed runs left in them and begins `OUT/rows.csv`
    /// and `OUT/traces.jsonl`.
    pub fn create(out: Option<&Path>, paths: Option<&Path>) -> Result<Self, OutputError> {
        make_folders(out, paths)?;
        let begin = |dir: &Path| -> Result<_, OutputError> {
            // Rows first: none of before is left without its trace.
            let rows = RowWriter::create(&dir.join(ROWS))?;
            let [traces, drives] = [TRACES, DRIVES].map(|name| LineWriter::create(&dir.join(name)));
            Ok(Writers { rows, traces: traces?, drives: drives? })
        };
        let writers = out.map(begin).transpose()?;
        let [out, paths] = [out, paths].map(|path| path.map(Path::to_owned));
        Ok(Self { out, paths, writers, drives: Vec::new() })
    }

    /// As [`Outputs::create`], keeping the rows that an interrupted run of these `cases` and `methods` left,
    /// as far as they are in its order, with all that belongs to them.
    pub fn resume(
        out: &Path,
        paths: Option<&Path>,
        cases: &[Case],
        methods: &[Method],
    ) -> Result<(Self, Vec<Row>), OutputError> {
        make_folders(Some(out), paths)?;
        let file = out.join(ROWS);
        let mut done = if file.exists() { rows::read_csv(&file)? } else { Vec::new() };
        let names = methods.iter().map(|m| m.name());
        let expected = cases.iter().flat_map(|c| names.clone().map(|m| (c.scene.name.as_str(), m)));
        let ours = done.iter().zip(expected).take_while(|(row, key)| row.key() == *key).count();
        done.truncate(ours);
        let scenes: HashSet<&str> = done.iter().map(|r| r.scene.as_str()).collect();
        let keys: HashSet<_> = done.iter().map(Row::key).collect();
        let read_error = |path: PathBuf| |error| OutputError::File { path, error };
        let [traces, drives] = [TRACES, DRIVES].map(|name| out.join(name));
        let mut kept = trace::read(&traces, &scenes).map_err(read_error(traces.clone()))?;
        kept.retain(|t| keys.contains(&t.key()));
        let mut driven = drives::read(&drives).map_err(read_error(drives.clone()))?;
        driven.retain(|d| keys.contains(&(d.scene.as_str(), d.method.as_str())));
        // Each whole and in its place before anything is added: who is killed here loses nothing.
        let writers = Writers {
            traces: LineWriter::go_on(&traces, &kept)?,
            drives: LineWriter::go_on(&drives, &driven)?,
            rows: RowWriter::go_on(&file, &done)?,
        };
        let [out, paths] = [Some(out), paths].map(|path| path.map(Path::to_owned));
        Ok((Self { out, paths, writers: Some(writers), drives: driven }, done))
    }

    /// Saves one episode, whose method was built from `models`: its path where paths are wanted, what became
    /// of it if it was driven, its trace, and last its row, so that whoever finds the row finds the others.
    pub fn take(
        &mut self,
        case: &Case,
        episode: &Episode,
        models: &Models,
        drive: Option<Drive>,
    ) -> Result<(), OutputError> {
        if let (Some(dir), Some(path)) = (&self.paths, &episode.path) {
            path.write(&dir.join(PathFile::file_name(&case.scene, &episode.row.method)))?;
        }
        if let Some(writers) = &mut self.writers {
            let driven = drive.as_ref().map_or(&[][..], |drive| &drive.poses);
            drive.iter().try_for_each(|drive| writers.drives.push(&drive.row))?;
            writers.traces.push(&Trace::new(episode, models, driven))?;
            writers.rows.push(&episode.row)?;
        }
        self.drives.extend(drive.map(|drive| drive.row));
        Ok(())
    }

    /// What became of the plans that were driven, so far.
    pub fn drives(&self) -> &[DriveRow] {
        &self.drives
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
        drop(self.writers);
        if self.drives.is_empty() {
            let path = dir.join(DRIVES);
            remove_if_present(&path).map_err(|error| OutputError::File { path, error })?;
        }
        rows::write_csv(&dir.join("rows.csv"), rows)?;
        rows::write_parquet(&dir.join("rows.parquet"), rows)?;
        let write = |name: &str, text: String| {
            let path = dir.join(name);
            write_whole(&path, text.as_bytes()).map_err(|error| OutputError::File { path, error })
        };
        if !self.drives.is_empty() {
            write("drives.csv", drives::csv(&self.drives))?;
        }
        let results = Results { title, rows, drives: &self.drives, curve, provenance };
        write("report.md", report::markdown(&results))?;
        let shown = html::gallery::chosen(cases, rows);
        let scenes = shown.iter().map(|c| c.scene.name.as_str()).collect();
        let path = dir.join(TRACES);
        let traces =
            trace::read(&path, &scenes).map_err(|error| OutputError::File { path, error })?;
        write("report.html", html::page(&results, &shown, &traces))
    }
}
