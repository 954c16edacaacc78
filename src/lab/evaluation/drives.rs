//! What became of plans that were driven: a line per scene and method as CSV, and a table.

use std::fmt::Write;
use std::io::{self, ErrorKind};
use std::path::Path;

use super::metrics::percentile;
use super::table::{Table, kind_name, part_name};
use crate::lab::driving::DriveRow;

const TITLE: &str = "Driven: what became of the paths in a car with lags and errors";

/// How to read the table.
pub(super) const NOTE: &str = "\
Each path was driven in closed loop by an ordinary tracking controller, with errors of localisation and of \
where obstacles stand, and with lags of steering and speed. “Parked” are the scenes in which the car ended within \
5 cm and 1° of where it was to park and touched nothing, “touched” those in which it touched something, “off” is how \
far from there it ended and “turned” by how much, “beside” is the largest distance of the rear axle from \
its path on the way, “time” the mean time it drove, “standing” what of it the trajectory stands and turns the wheels.";

/// What the numbers of a group are.
pub const HEADERS: [&str; 10] = [
    "driven",
    "parked",
    "touched",
    "off cm: median",
    "worst",
    "turned °: worst",
    "beside cm: median",
    "worst",
    "time s",
    "standing s",
];

/// The drives of one method in one set, level and type; at least one.
pub struct Group<'a>(Vec<&'a DriveRow>);

/// The drives by set, level, type and method, in the order of their first.
pub fn groups(drives: &[DriveRow]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group> = Vec::new();
    let is_same = |a: &DriveRow, b: &DriveRow| {
        (&a.set, a.level, a.kind, &a.method) == (&b.set, b.level, b.kind, &b.method)
    };
    for drive in drives {
        match groups.iter_mut().find(|group| is_same(group.first(), drive)) {
            Some(group) => group.0.push(drive),
            None => groups.push(Group(vec![drive])),
        }
    }
    groups
}

impl<'a> Group<'a> {
    /// The first of its drives, which has what all have in common.
    pub fn first(&self) -> &'a DriveRow {
        self.0[0]
    }

    /// Its numbers, as [`HEADERS`] has them.
    pub fn numbers(&self) -> [String; HEADERS.len()] {
        let all = &self.0;
        let sorted = |value: fn(&DriveRow) -> f64| {
            let mut values: Vec<f64> = all.iter().map(|d| value(d)).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let mean = |value: fn(&DriveRow) -> f64| {
            all.iter().map(|d| value(d)).sum::<f64>() / all.len() as f64
        };
        let (beside, off) = (sorted(|d| d.deviation_m * 100.0), sorted(|d| d.off_m * 100.0));
        let turned = sorted(|d| d.off_rad.to_degrees());
        let count = |holds: fn(&DriveRow) -> bool| all.iter().filter(|d| holds(d)).count();
        [
            all.len().to_string(),
            count(DriveRow::is_parked).to_string(),
            count(|d| d.contact).to_string(),
            format!("{:.1}", percentile(&off, 0.5)),
            format!("{:.1}", percentile(&off, 1.0)),
            format!("{:.2}", percentile(&turned, 1.0)),
            format!("{:.1}", percentile(&beside, 0.5)),
            format!("{:.1}", percentile(&beside, 1.0)),
            format!("{:.1}", mean(|d| d.time_s)),
            format!("{:.1}", mean(|d| d.standing_s)),
        ]
    }
}

/// The table; empty without drives.
pub fn table(drives: &[DriveRow]) -> Table {
    let line = |group: Group| {
        let first = group.first();
        let names =
            [part_name(&first.set, first.level), kind_name(first.kind), first.method.clone()];
        names.into_iter().chain(group.numbers()).collect()
    };
    let headers = ["level", "type", "method"].into_iter().chain(HEADERS);
    Table {
        title: TITLE.to_owned(),
        headers: headers.map(str::to_owned).collect(),
        rows: groups(drives).into_iter().map(line).collect(),
        text_columns: 3,
    }
}

/// What a run that was interrupted left of its drives, in `drives.jsonl`; what is no whole line is left out, and
/// so is everything where there is no file.
pub(super) fn read(path: &Path) -> io::Result<Vec<DriveRow>> {
    match std::fs::read(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        bytes => {
            let bytes = bytes?;
            let lines = bytes.split(|b| *b == b'\n');
            Ok(lines.filter_map(|line| serde_json::from_slice(line).ok()).collect())
        }
    }
}

/// The drives as CSV, in the order in which they were made.
pub fn csv(drives: &[DriveRow]) -> String {
    let mut text =
        "scene,set,type,level,method,parked,off_m,off_rad,deviation_m,clearance_m,contact,time_s,\
                    planned_time_s,standing_s\n"
            .to_owned();
    let quoted = |name: &str| match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    };
    for d in drives {
        let kind = d.kind.map_or("", |kind| kind.name());
        let level = d.level.map_or("", |level| level.name());
        let clearance = d.clearance_m.map_or(String::new(), |c| c.to_string());
        let _ = writeln!(
            text,
            "{},{},{kind},{level},{},{},{},{},{},{clearance},{},{},{},{}",
            quoted(&d.scene),
            quoted(&d.set),
            quoted(&d.method),
            d.is_parked(),
            d.off_m,
            d.off_rad,
            d.deviation_m,
            d.contact,
            d.time_s,
            d.planned_time_s,
            d.standing_s
        );
    }
    text
}
