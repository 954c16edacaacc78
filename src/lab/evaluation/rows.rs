//! Rows: one per (scene, method), the record every table is made of.
//!
//! [`RowWriter`] appends to `rows.csv` as rows come and flushes each, so that an
//! interrupted run keeps what it did. At the end [`write_csv`] writes them anew, with the columns
//! that compare them, and [`write_parquet`] adds `rows.parquet`.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow_array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array};
use parquet::arrow::ArrowWriter;

use crate::episode::Row;
use crate::files::{reason, write_whole};

/// Rows that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    /// Reading or writing failed.
    #[error("{path}: {}", reason(error))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
    /// A line is not a row.
    #[error("{path}: line {line}: {message}")]
    Format {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// The Parquet writer failed.
    #[error("{path}: {error}")]
    Parquet {
        /// The file.
        path: PathBuf,
        /// The library's reason.
        error: parquet::errors::ParquetError,
    },
}

/// Appends rows to a CSV file, each flushed at once.
pub struct RowWriter {
    path: PathBuf,
    file: File,
}

impl RowWriter {
    /// Begins `path` anew with the header line.
    pub fn create(path: &Path) -> Result<Self, RowsError> {
        let io = |error| RowsError::Io { path: path.to_owned(), error };
        let mut file = File::create(path).map_err(io)?;
        file.write_all((Row::COLUMNS.join(",") + "\n").as_bytes()).map_err(io)?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Goes on after these rows, of which a reader finds all at any time.
    pub fn go_on(path: &Path, rows: &[Row]) -> Result<Self, RowsError> {
        write_csv(path, rows)?;
        let file = File::options().append(true).open(path);
        let file = file.map_err(|error| RowsError::Io { path: path.to_owned(), error })?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Appends one row.
    pub fn push(&mut self, row: &Row) -> Result<(), RowsError> {
        // One unbuffered write: nothing waits in this process.
        self.file
            .write_all(row.to_csv().as_bytes())
            .map_err(|error| RowsError::Io { path: self.path.clone(), error })
    }
}

/// Writes a `rows.csv` whole, to a temporary name first.
pub fn write_csv(path: &Path, rows: &[Row]) -> Result<(), RowsError> {
    let header = Row::COLUMNS.join(",") + "\n";
    let text: String = [header].into_iter().chain(rows.iter().map(Row::to_csv)).collect();
    write_whole(path, text.as_bytes())
        .map_err(|error| RowsError::Io { path: path.to_owned(), error })
}

/// Reads a `rows.csv`, also one of before, without the last columns. A last line without line
/// break (an interrupted run) is left out.
pub fn read_csv(path: &Path) -> Result<Vec<Row>, RowsError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| RowsError::Io { path: path.to_owned(), error })?;
    let complete = text.rfind('\n').map_or("", |end| &text[..=end]);
    let mut rows = Vec::new();
    let mut missing = 0;
    for (i, line) in complete.lines().enumerate() {
        let format = |message| RowsError::Format { path: path.to_owned(), line: i + 1, message };
        if i == 0 {
            let is_header =
                |less: &usize| line == Row::COLUMNS[..Row::COLUMNS.len() - less].join(",");
            let last = [0].into_iter().chain(Row::ADDED.into_iter().rev());
            missing = last
                .scan(0, |less, added| {
                    *less += added;
                    Some(*less)
                })
                .find(is_header)
                .ok_or_else(|| format("expected the header of a rows.csv".to_owned()))?;
            continue;
        }
        let mut fields = split(line);
        fields.resize(fields.len() + missing, String::new());
        rows.push(from_fields(&fields).map_err(format)?);
    }
    Ok(rows)
}

/// Writes the rows as Parquet, to a temporary name first.
#[allow(clippy::missing_panics_doc, reason = "all columns are made of the same rows")]
pub fn write_parquet(path: &Path, rows: &[Row]) -> Result<(), RowsError> {
    let parquet = |error| RowsError::Parquet { path: path.to_owned(), error };
    let text = |f: fn(&Row) -> Option<String>| -> ArrayRef {
        Arc::new(rows.iter().map(f).collect::<StringArray>())
    };
    let number = |f: fn(&Row) -> Option<f64>| -> ArrayRef {
        Arc::new(rows.iter().map(f).collect::<Float64Array>())
    };
    let count = |f: fn(&Row) -> Option<u32>| -> ArrayRef {
        Arc::new(rows.iter().map(f).collect::<UInt32Array>())
    };
    let flag = |f: fn(&Row) -> Option<bool>| -> ArrayRef {
        Arc::new(rows.iter().map(f).collect::<BooleanArray>())
    };
    let columns = [
        text(|r| Some(r.scene.clone())),
        text(|r| r.kind.map(|k| k.to_string())),
        text(|r| r.level.map(|l| l.to_string())),
        text(|r| Some(r.method.clone())),
        flag(|r| Some(r.ok)),
        text(|r| Some(r.reason.clone())),
        number(|r| Some(r.plan_time_s)),
        number(|r| r.length_m),
        count(|r| r.direction_changes),
        number(|r| r.max_abs_steer_rad),
        number(|r| r.mean_abs_steer_change_rad),
        count(|r| Some(r.nodes)),
        number(|r| r.min_clearance_m),
        flag(|r| Some(r.fallback)),
        text(|r| Some(r.checked.clone())),
        text(|r| Some(r.route.clone())),
        number(|r| r.cost_over_best),
        count(|r| r.changes_over_fewest),
        number(|r| r.way_clearance_m),
        text(|r| Some(r.set.clone())),
    ];
    let named = Row::COLUMNS.into_iter().zip(columns).map(|(name, column)| (name, column, true));
    let batch = RecordBatch::try_from_iter_with_nullable(named)
        .expect("columns of one length and one type each");
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, batch.schema(), None).map_err(parquet)?;
    writer.write(&batch).map_err(parquet)?;
    writer.close().map_err(parquet)?;
    write_whole(path, &bytes).map_err(|error| RowsError::Io { path: path.to_owned(), error })
}

/// The row of one line's fields.
fn from_fields(f: &[String]) -> Result<Row, String> {
    if f.len() != Row::COLUMNS.len() {
        return Err(format!("has {} columns; expected {}", f.len(), Row::COLUMNS.len()));
    }
    fn parse<T: std::str::FromStr>(f: &[String], i: usize) -> Result<T, String> {
        f[i].parse().map_err(|_| format!("{} is \"{}\"", Row::COLUMNS[i], f[i]))
    }
    fn maybe<T: std::str::FromStr>(f: &[String], i: usize) -> Result<Option<T>, String> {
        if f[i].is_empty() { Ok(None) } else { parse(f, i).map(Some) }
    }
    Ok(Row {
        scene: f[0].clone(),
        kind: maybe(f, 1)?,
        level: maybe(f, 2)?,
        method: f[3].clone(),
        ok: parse(f, 4)?,
        reason: f[5].clone(),
        plan_time_s: parse(f, 6)?,
        length_m: maybe(f, 7)?,
        direction_changes: maybe(f, 8)?,
        max_abs_steer_rad: maybe(f, 9)?,
        mean_abs_steer_change_rad: maybe(f, 10)?,
        nodes: parse(f, 11)?,
        min_clearance_m: maybe(f, 12)?,
        fallback: parse(f, 13)?,
        checked: f[14].clone(),
        route: f[15].clone(),
        cost_over_best: maybe(f, 16)?,
        changes_over_fewest: maybe(f, 17)?,
        way_clearance_m: maybe(f, 18)?,
        set: f[19].clone(),
    })
}

/// The fields of one CSV line.
fn split(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut quoted = false;
    let mut chars = line.chars().peekable();
    while let Some(c) = chars.next() {
        let field = fields.last_mut().expect("never empty");
        match c {
            '"' if quoted && chars.peek() == Some(&'"') => {
                chars.next();
                field.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            c => field.push(c),
        }
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::ParkingType;

    fn row() -> Row {
        Row {
            scene: "a, \"b\"".into(),
            kind: Some(ParkingType::Parallel),
            level: None,
            method: "ha-rs".into(),
            ok: false,
            reason: "rejected by the independent check".into(),
            plan_time_s: 0.1 + 0.2,
            length_m: Some(1.0 / 3.0),
            direction_changes: Some(2),
            max_abs_steer_rad: None,
            mean_abs_steer_change_rad: Some(1e-17),
            nodes: 7,
            min_clearance_m: None,
            fallback: true,
            checked: "pose 3: moves against gear 1".into(),
            route: "fallback".into(),
            cost_over_best: Some(1.0 + 1.0 / 3.0),
            changes_over_fewest: Some(1),
            way_clearance_m: Some(0.1 + 0.2),
            set: "lots".into(),
        }
    }

    #[test]
    fn files_of_before_are_read_without_the_last_columns() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rows.csv");
        write_csv(&path, &[row(), row()]).unwrap();
        assert_eq!(read_csv(&path).unwrap(), [row(), row()]);
        let text = std::fs::read_to_string(&path).unwrap();
        let without = |last: usize| {
            let kept =
                |line: &str| line.rsplitn(last + 1, ',').nth(last).unwrap().to_owned() + "\n";
            std::fs::write(&path, text.lines().map(kept).collect::<String>()).unwrap();
            read_csv(&path)
        };
        let before = Row { set: String::new(), ..row() };
        assert_eq!(without(1).unwrap(), [before.clone(), before.clone()]);
        let before = Row { way_clearance_m: None, ..before };
        assert_eq!(without(2).unwrap(), [before.clone(), before.clone()]);
        let before = Row { cost_over_best: None, changes_over_fewest: None, ..before };
        assert_eq!(without(4).unwrap(), [before.clone(), before]);
        assert!(without(3).unwrap_err().to_string().contains("header"));
        std::fs::write(&path, text.replace(",changes_over_fewest", "")).unwrap();
        assert!(read_csv(&path).unwrap_err().to_string().contains("header"));
    }

    #[test]
    fn csv_round_trip_is_exact_and_drops_half_a_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rows.csv");
        let mut writer = RowWriter::create(&path).unwrap();
        writer.push(&row()).unwrap();
        writer.push(&row()).unwrap();
        assert_eq!(read_csv(&path).unwrap(), vec![row(), row()]);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 5]).unwrap();
        assert_eq!(read_csv(&path).unwrap(), vec![row()]);
    }

    /// Other readers take a carriage return outside quotes for the end of a row.
    #[test]
    fn carriage_returns_are_quoted_and_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rows.csv");
        let row = Row { scene: "a\rb".into(), route: "c\r".into(), ..row() };
        let mut writer = RowWriter::create(&path).unwrap();
        writer.push(&row).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("\n\"a\rb\",") && text.contains(",\"c\r\","), "{text:?}");
        assert_eq!(read_csv(&path).unwrap(), [row]);
    }

    #[test]
    fn parquet_holds_every_row() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rows.parquet");
        write_parquet(&path, &[row(), row(), row()]).unwrap();
        let reader = parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder::try_new(
            File::open(&path).unwrap(),
        )
        .unwrap();
        assert_eq!(reader.metadata().file_metadata().num_rows(), 3);
        let names: Vec<_> = reader.schema().fields().iter().map(|f| f.name().clone()).collect();
        assert_eq!(names, Row::COLUMNS);
    }
}
