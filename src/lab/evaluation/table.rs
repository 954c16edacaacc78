//! Tables as in the paper, our numbers beside the paper's.
//!
//! The paper's numbers are in `paper_tables.csv` next to this file: section V of the
//! paper, 100 scenes per level and type, times on the authors' machine.

use serde::{Deserialize, Serialize};

use super::metrics::{Group, Interval, Summary};
use super::suite::World;
use crate::episode::Row;
use crate::n3p::Method;
use crate::world::{Level, ParkingType};

/// A table of text, ready to lay out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// Its heading.
    pub title: String,
    /// Names of the columns.
    pub headers: Vec<String>,
    /// The cells.
    pub rows: Vec<Vec<String>>,
    /// How many columns on the left hold text; the others hold numbers.
    pub text_columns: usize,
}

/// One line of the paper's tables.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PaperRow {
    /// Level of the scenes.
    pub level: Level,
    /// Type of the scenes.
    pub kind: ParkingType,
    /// The paper's name of the method.
    pub method: String,
    /// Min, mean, median and P95 of time (s), Δδ (rad), length (m), failures (%), mean and
    /// max direction changes, nodes; as printed.
    pub cells: [String; 10],
}

impl PaperRow {
    /// The cells with times in milliseconds, as in our tables.
    #[allow(clippy::missing_panics_doc, reason = "the embedded table is tested")]
    pub fn in_milliseconds(&self) -> [String; 10] {
        let mut cells = self.cells.clone();
        for time in &mut cells[..4] {
            let seconds: f64 = time.parse().expect("a number in the embedded table");
            *time = figures(seconds * 1e3);
        }
        cells
    }
}

/// The paper's three tables.
#[allow(clippy::missing_panics_doc, reason = "the embedded table is tested")]
pub fn paper_rows() -> Vec<PaperRow> {
    let lines = include_str!("paper_tables.csv").lines().filter(|l| !l.starts_with('#')).skip(1);
    lines
        .map(|line| {
            let f: Vec<&str> = line.split(',').collect();
            let cells: Vec<String> = f[3..].iter().map(|&c| c.to_owned()).collect();
            PaperRow {
                level: f[0].parse().expect("a level in the embedded table"),
                kind: f[1].parse().expect("a type in the embedded table"),
                method: f[2].to_owned(),
                cells: cells.try_into().expect("ten numbers in the embedded table"),
            }
        })
        .collect()
}

/// The paper's line for our `method`, if it has one.
pub(super) fn printed<'p>(
    paper: &'p [PaperRow],
    level: Option<Level>,
    kind: Option<ParkingType>,
    method: &str,
) -> Option<&'p PaperRow> {
    let name = method.parse().ok().and_then(Method::paper_name)?;
    paper.iter().find(|p| Some(p.level) == level && Some(p.kind) == kind && p.method == name)
}

/// One table per set and level: each method's line, and under it the paper's where it has one.
pub fn comparison(groups: &[Group]) -> Vec<Table> {
    let paper = paper_rows();
    let mut tables = Vec::new();
    for part @ (set, level) in parts(groups) {
        let mut rows = Vec::new();
        for group in groups.iter().filter(|g| is_of(g, part)) {
            for s in &group.summaries {
                let cells = numbers(s);
                rows.push(line(group.kind, &s.method, "this run", cells));
                if let Some(p) = printed(&paper, level, group.kind, &s.method) {
                    rows.push(line(group.kind, &p.method, "paper", p.in_milliseconds()));
                }
            }
        }
        let headers = [
            "type", "method", "source", "min T", "mean T", "median T", "P95 T", "Δδ", "length",
            "fail %", "N_dc", "max N_dc", "N_node",
        ];
        tables.push(Table {
            title: format!("{}: T in ms, Δδ in rad, length in m", part_title(set, level)),
            headers: headers.map(str::to_owned).to_vec(),
            rows,
            text_columns: 3,
        });
    }
    tables
}

/// Mean times with their intervals, and the speed-up against the fastest graph search.
pub fn speed_ups(groups: &[Group]) -> Table {
    let mut rows = Vec::new();
    for group in groups {
        for s in &group.summaries {
            let (reference, ratio, interval, saved) = match &s.speed_up {
                None => ["–"; 4].map(str::to_owned).into(),
                Some(u) => (
                    u.reference.clone(),
                    figures(u.ratio),
                    span(u.interval),
                    format!("{:.1}", 100.0 * (1.0 - 1.0 / u.ratio)),
                ),
            };
            rows.push(vec![
                part_name(&group.set, group.level),
                kind_name(group.kind),
                s.method.clone(),
                reference,
                s.scenes.to_string(),
                figures(s.mean_t_s * 1e3),
                span(Interval {
                    low: s.mean_t_interval_s.low * 1e3,
                    high: s.mean_t_interval_s.high * 1e3,
                }),
                ratio,
                interval,
                saved,
                s.min_clearance_m.map_or("–".to_owned(), |c| format!("{c:.3}")),
            ]);
        }
    }
    let headers = [
        "level",
        "type",
        "method",
        "against",
        "scenes",
        "mean T",
        "95 % CI",
        "× faster",
        "95 % CI",
        "saved %",
        "min clearance",
    ];
    Table {
        title: "Mean times and speed-ups: T in ms, clearance in m".to_owned(),
        headers: headers.map(str::to_owned).to_vec(),
        rows,
        text_columns: 4,
    }
}

/// Every row that failed, with its reason. A method that does not apply has not failed.
pub fn failures(rows: &[Row]) -> Table {
    let failed = rows.iter().filter(|r| !r.ok && r.applies());
    let failed = failed.map(|r| vec![r.scene.clone(), r.method.clone(), r.why()]);
    Table {
        title: "Failures".to_owned(),
        headers: ["scene", "method", "reason"].map(str::to_owned).to_vec(),
        rows: failed.collect(),
        text_columns: 3,
    }
}

/// What one table is about: a set and a level.
pub(super) type Part<'a> = (&'a str, Option<Level>);

pub(super) fn parts(groups: &[Group]) -> Vec<Part<'_>> {
    let mut parts: Vec<_> = groups.iter().map(|g| (&g.set[..], g.level)).collect();
    parts.dedup();
    parts
}

pub(super) fn is_of(group: &Group, part: Part) -> bool {
    (&group.set[..], group.level) == part
}

/// A set and level in one word: only the scenes at home have levels.
pub(super) fn part_name(set: &str, level: Option<Level>) -> String {
    match level {
        Some(level) => level.to_string(),
        None if set.is_empty() => "files".to_owned(),
        None => set.to_owned(),
    }
}

pub(super) fn part_title(set: &str, level: Option<Level>) -> String {
    match level {
        Some(level) => format!("Level {level}"),
        None if set.is_empty() => "Scenes from files".to_owned(),
        None if set == World::Lots.name() => format!("Car parks ({set})"),
        None => format!("Scenes of {set}"),
    }
}

pub(super) fn kind_name(kind: Option<ParkingType>) -> String {
    kind.map_or("–".to_owned(), |k| k.to_string())
}

fn line(kind: Option<ParkingType>, method: &str, source: &str, cells: [String; 10]) -> Vec<String> {
    [kind_name(kind), method.to_owned(), source.to_owned()].into_iter().chain(cells).collect()
}

pub(super) fn numbers(s: &Summary) -> [String; 10] {
    let maybe = |v: Option<f64>, digits| v.map_or("–".to_owned(), |v| format!("{v:.digits$}"));
    [
        figures(s.min_t_s * 1e3),
        figures(s.mean_t_s * 1e3),
        figures(s.median_t_s * 1e3),
        figures(s.p95_t_s * 1e3),
        maybe(s.mean_abs_steer_change_rad, 3),
        maybe(s.mean_length_m, 2),
        format!("{:.1}", s.fail_percent),
        maybe(s.mean_direction_changes, 2),
        s.max_direction_changes.map_or("–".to_owned(), |v| v.to_string()),
        format!("{:.1}", s.mean_nodes),
    ]
}

/// Four significant figures.
pub(super) fn figures(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return v.to_string();
    }
    let digits = (3 - v.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{v:.digits$}")
}

pub(super) fn span(i: Interval) -> String {
    format!("{} … {}", figures(i.low), figures(i.high))
}

impl Table {
    /// GitHub-flavoured Markdown, the title as a heading.
    pub fn markdown(&self) -> String {
        let row = |cells: &[String]| {
            let escaped: Vec<String> = cells.iter().map(|c| c.replace('|', "\\|")).collect();
            format!("| {} |\n", escaped.join(" | "))
        };
        let rule: Vec<String> = (0..self.headers.len())
            .map(|i| if i < self.text_columns { "---" } else { "--:" }.to_owned())
            .collect();
        let mut out = format!("## {}\n\n{}{}", self.title, row(&self.headers), row(&rule));
        self.rows.iter().for_each(|r| out += &row(r));
        out
    }

    /// Aligned plain text.
    pub fn text(&self) -> String {
        let width = |i: usize| {
            let cells = self.rows.iter().map(|r| &r[i]).chain([&self.headers[i]]);
            cells.map(|c| c.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.headers.len()).map(width).collect();
        let row = |cells: &[String]| {
            let padded: Vec<String> =
                cells
                    .iter()
                    .zip(&widths)
                    .enumerate()
                    .map(|(i, (c, &w))| {
                        if i < self.text_columns { format!("{c:<w$}") } else { format!("{c:>w$}") }
                    })
                    .collect();
            format!("{}\n", padded.join("  ").trim_end())
        };
        let mut out = format!("{}\n{}", self.title, row(&self.headers));
        self.rows.iter().for_each(|r| out += &row(r));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::{summarise, tests::row};
    use super::*;

    #[test]
    fn the_papers_tables_are_complete() {
        let rows = paper_rows();
        assert_eq!(rows.len(), 75);
        let known = |p: &PaperRow| Method::all().any(|m| m.paper_name() == Some(&p.method));
        assert!(rows.iter().all(known));
        assert!(rows.iter().all(|p| p.cells.iter().all(|c| c.parse::<f64>().is_ok())));
    }

    #[test]
    fn our_line_stands_above_the_papers() {
        let rows = [row("a", "ha-rs", 0.5, true), row("a", "n3p", 0.001234, false)];
        let tables = comparison(&summarise(&rows, 1));
        let sources: Vec<_> = tables[0].rows.iter().map(|r| (&r[1][..], &r[2][..])).collect();
        let expected = [("ha-rs", "this run"), ("HA* with RS", "paper"), ("n3p", "this run")];
        assert_eq!(sources, expected);
        assert_eq!(tables[0].rows[1][4], "16060");
        assert_eq!(tables[0].rows[2][3], "1.234");
        let lengths: Vec<_> = tables[0].text().lines().skip(1).map(|l| l.chars().count()).collect();
        assert!(lengths.windows(2).all(|w| w[0] == w[1]), "{}", tables[0].text());
        assert_eq!(failures(&rows).rows.len(), 1);
    }
}
