//! What the page's template lays out as tables.

use std::collections::{HashMap, HashSet};

use serde::Serialize;

use super::super::drives;
use super::super::metrics::{self, Group, Interval, Summary, Totals};
use super::super::quality::{self, MethodQuality, Quality};
use super::super::table::{self, PaperRow, figures, kind_name, numbers, part_name, part_title};
use super::filter::{Choices, Setting};
use super::{escape, family};
use crate::episode::Row;
use crate::lab::driving::DriveRow;
use crate::n3p::Method;

/// Heading (HTML), unit and meaning of a number's column.
pub type Column = (&'static str, &'static str, &'static str);

/// The paper's columns.
pub const COLUMNS: [Column; 10] = [
    ("min T", "ms", "shortest planning time"),
    ("mean T", "ms", "mean planning time"),
    ("median T", "ms", "median planning time"),
    ("P95 T", "ms", "95th percentile of the planning time"),
    ("Δδ", "rad", "mean change of the steering angle in 0.1 s"),
    ("length", "m", "mean length of the solved paths"),
    ("fail", "%", "share of scenes without an accepted path"),
    ("N<sub>dc</sub>", "", "mean number of direction changes"),
    ("max N<sub>dc</sub>", "", "largest number of direction changes"),
    ("N<sub>node</sub>", "", "mean number of node expansions"),
];

/// Numbers over all scenes of one choice of the filter.
#[derive(Serialize)]
pub struct Slice {
    /// World, type and level as a list in JSON, each empty for all: what `filter.js` asks for.
    pub key: String,
    pub scenes: usize,
    pub settings: usize,
    pub episodes: usize,
    pub failures: usize,
    pub rejected: usize,
    pub methods: Vec<MethodLine>,
    #[serde(skip)]
    pub quality: Vec<QualityLine>,
}

/// Every choice of the filter, all scenes first.
pub fn slices(choices: &Choices, rows: &[Row]) -> Vec<Slice> {
    let slice = |(setting, rows): (Setting, Vec<Row>)| {
        let count = |is: fn(&Row) -> bool| rows.iter().filter(|r| is(r)).count();
        let quality = quality::summarise(&rows);
        Slice {
            scenes: rows.iter().map(|r| &r.scene).collect::<HashSet<_>>().len(),
            settings: quality.groups.len(),
            episodes: count(Row::applies),
            failures: count(|r| !r.ok && r.applies()),
            rejected: count(Row::is_rejected),
            methods: methods(&metrics::totals(&rows)),
            quality: quality.all.iter().map(quality_line).collect(),
            key: setting.key(),
        }
    };
    choices.slices(rows).into_iter().map(slice).collect()
}

/// A method over all scenes.
#[derive(Serialize)]
pub struct MethodLine {
    pub family: &'static str,
    pub kind: &'static str,
    pub totals: Totals,
    pub median: String,
    pub length: String,
    pub changes: String,
    pub nodes: String,
    pub remarks: String,
}

/// One line per method.
fn methods(totals: &[Totals]) -> Vec<MethodLine> {
    let line = |t: &Totals| {
        let counts = [
            (t.rejected, "refused by the independent check"),
            (t.fallbacks, "by full search"),
            (t.not_applicable, "not applicable"),
        ];
        let remarks = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}"));
        let dash = || "–".to_owned();
        let family = family(&t.method);
        MethodLine {
            family,
            kind: match family {
                "search" => "graph search",
                "n3p" => "the paper’s N3P",
                "ours" => "N3P, ours",
                "rl" => "reinforcement learning",
                _ => "other",
            },
            median: t.median_t_s.map_or_else(dash, seconds),
            length: t.mean_length_m.map_or_else(dash, |v| format!("{v:.2} m")),
            changes: t.mean_direction_changes.map_or_else(dash, |v| format!("{v:.2}")),
            nodes: t.mean_nodes.map_or_else(dash, |v| format!("{v:.1}")),
            remarks: remarks.collect::<Vec<_>>().join(", "),
            totals: t.clone(),
        }
    };
    totals.iter().map(line).collect()
}

/// Seconds for people.
fn seconds(s: f64) -> String {
    let (value, unit) = match s {
        s if s < 1e-3 => (s * 1e6, "µs"),
        s if s < 1.0 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    let digits = if value >= 100.0 { 0 } else { 1 };
    format!("{value:.digits$} {unit}")
}

/// The table of one level.
#[derive(Serialize)]
pub struct LevelTable {
    pub title: String,
    pub groups: Vec<TypeGroup>,
}

/// The lines of one parking type.
#[derive(Serialize)]
pub struct TypeGroup {
    pub attributes: String,
    pub kind: String,
    pub scenes: usize,
    pub lines: Vec<Line>,
}

/// A method's line: our numbers, each with the paper's.
#[derive(Serialize)]
pub struct Line {
    pub method: String,
    pub family: &'static str,
    pub paper_name: &'static str,
    pub applies: bool,
    pub failed: bool,
    pub cells: Vec<(String, Option<String>)>,
    /// The interval of the mean time.
    pub interval: String,
}

/// One table per set and level; `methods` has all methods of the run, so that one that is absent
/// from a type leaves a line of dashes.
pub fn levels(groups: &[Group], methods: &[&str]) -> Vec<LevelTable> {
    let paper = table::paper_rows();
    let of_part = |part: table::Part| {
        let groups = groups.iter().filter(|g| table::is_of(g, part));
        let groups = groups.map(|g| TypeGroup {
            attributes: Setting::new(&g.set, g.kind, g.level).attributes(),
            kind: kind_name(g.kind),
            scenes: g.summaries.iter().map(|s| s.scenes).max().unwrap_or(0),
            lines: methods.iter().map(|m| line(g, m, &paper)).collect(),
        });
        LevelTable { title: part_title(part.0, part.1), groups: groups.collect() }
    };
    table::parts(groups).into_iter().map(of_part).collect()
}

fn line(group: &Group, method: &str, paper: &[PaperRow]) -> Line {
    let summary = group.summaries.iter().find(|s| s.method == method);
    let printed = table::printed(paper, group.level, group.kind, method);
    let ours = summary.map_or_else(|| std::array::from_fn(|_| "–".to_owned()), numbers);
    let theirs = printed.map(PaperRow::in_milliseconds);
    let theirs = (0..ours.len()).map(|i| theirs.as_ref().map(|t| t[i].clone()));
    Line {
        method: method.to_owned(),
        family: family(method),
        paper_name: method.parse().ok().and_then(Method::paper_name).unwrap_or(""),
        applies: summary.is_some(),
        failed: summary.is_some_and(|s| s.fail_percent > 0.0),
        cells: ours.into_iter().zip(theirs).collect(),
        interval: summary.map_or("–".to_owned(), |s| span(s.mean_t_interval_s, 1e3)),
    }
}

/// A line of the table of speed-ups.
#[derive(Serialize)]
pub struct SpeedLine {
    pub attributes: String,
    pub level: String,
    pub kind: String,
    /// Whether a new level or type begins here.
    pub first: bool,
    pub method: String,
    pub family: &'static str,
    pub scenes: usize,
    pub mean: (String, String),
    pub against: String,
    pub ratio: Option<(String, String)>,
    pub saved: String,
    pub paper: String,
    pub clearance: String,
}

/// Mean times with their intervals, and speed-ups with theirs and the paper's.
pub fn speed_ups(groups: &[Group]) -> Vec<SpeedLine> {
    let paper = table::paper_rows();
    let mut lines = Vec::new();
    for g in groups {
        for (i, s) in g.summaries.iter().enumerate() {
            let ratio = s.speed_up.as_ref();
            let saved = ratio.map(|u| 100.0 * (1.0 - 1.0 / u.ratio)).filter(|&s| s >= 0.0);
            lines.push(SpeedLine {
                attributes: Setting::new(&g.set, g.kind, g.level).attributes(),
                level: part_name(&g.set, g.level),
                kind: kind_name(g.kind),
                first: i == 0,
                method: s.method.clone(),
                family: family(&s.method),
                scenes: s.scenes,
                mean: (figures(s.mean_t_s * 1e3), span(s.mean_t_interval_s, 1e3)),
                against: ratio.map_or("reference".to_owned(), |u| u.reference.clone()),
                ratio: ratio.map(|u| (figures(u.ratio), span(u.interval, 1.0))),
                saved: saved.map_or("–".to_owned(), |s| format!("{s:.1}")),
                paper: paper_ratio(&paper, g, s).map_or("–".to_owned(), figures),
                clearance: s.min_clearance_m.map_or("–".to_owned(), |c| format!("{c:.3}")),
            });
        }
    }
    lines
}

fn span(i: Interval, scale: f64) -> String {
    table::span(Interval { low: i.low * scale, high: i.high * scale })
}

/// How much faster than its fastest graph search (by mean time) the paper reports the method
/// of `summary` to be; `None` where it is that search, or not in the paper.
pub fn paper_ratio(paper: &[PaperRow], group: &Group, summary: &Summary) -> Option<f64> {
    let mean = |p: &PaperRow| p.cells[1].parse::<f64>().expect("a number in the embedded table");
    let mine = table::printed(paper, group.level, group.kind, &summary.method)?;
    let searches = Method::all().filter(|m| m.is_graph_search());
    let searches =
        searches.filter_map(|m| table::printed(paper, group.level, group.kind, m.name()));
    let reference = searches.min_by(|a, b| mean(a).total_cmp(&mean(b)))?;
    (reference != mine).then(|| mean(reference) / mean(mine))
}

/// The methods of one group against the best of the run.
#[derive(Serialize)]
pub struct QualityGroup {
    pub attributes: String,
    pub heading: String,
    pub lines: Vec<QualityLine>,
}

/// A line of the table of quality.
#[derive(Clone, Serialize)]
pub struct QualityLine {
    pub method: String,
    pub family: &'static str,
    pub scenes: usize,
    pub failed: usize,
    /// Cost over the best: median, P95, worst; changes beyond the fewest: mean, share of more than
    /// one, most.
    pub numbers: [String; 6],
}

fn quality_line(m: &MethodQuality) -> QualityLine {
    QualityLine {
        method: m.method.clone(),
        family: family(&m.method),
        scenes: m.scenes,
        failed: m.failed,
        numbers: quality::numbers(m),
    }
}

/// Every method's paths against the best of the run, group by group; before them, where there are several, over
/// all scenes of each choice of the filter.
pub fn quality(found: &Quality, slices: &[Slice]) -> Vec<QualityGroup> {
    let all = |(i, slice): (usize, &Slice)| QualityGroup {
        attributes: format!(
            " data-slice=\"{}\"{}",
            escape(&slice.key),
            if i == 0 { "" } else { " hidden" }
        ),
        heading: "all of these".to_owned(),
        lines: slice.quality.clone(),
    };
    let all = slices.iter().enumerate().filter(|_| found.groups.len() > 1).map(all);
    let group = |g: &quality::QualityGroup| QualityGroup {
        attributes: Setting::new(&g.set, g.kind, g.level).attributes(),
        heading: format!("{}, {}", part_name(&g.set, g.level), kind_name(g.kind)),
        lines: g.methods.iter().map(quality_line).collect(),
    };
    all.chain(found.groups.iter().map(group)).collect()
}

/// A line of the table of drives.
#[derive(Serialize)]
pub struct DriveLine {
    pub attributes: String,
    /// Whether a new level or type begins here, with this heading.
    pub heading: Option<String>,
    pub method: String,
    pub family: &'static str,
    /// As [`drives::HEADERS`] has them.
    pub cells: Vec<String>,
}

/// What became of the paths that were driven.
pub fn drives(all: &[DriveRow]) -> Vec<DriveLine> {
    let mut last = None;
    let line = |group: drives::Group| {
        let first = group.first();
        let setting = Setting::new(&first.set, first.kind, first.level);
        let heading = format!("{}, {}", part_name(&first.set, first.level), kind_name(first.kind));
        let is_new = last.as_ref() != Some(&setting);
        last = Some(setting.clone());
        DriveLine {
            attributes: setting.attributes(),
            heading: is_new.then_some(heading),
            method: first.method.clone(),
            family: family(&first.method),
            cells: group.numbers().to_vec(),
        }
    };
    drives::groups(all).into_iter().map(line).collect()
}

/// A failure, and where in the gallery it can be seen.
#[derive(Serialize)]
pub struct Failure {
    pub attributes: String,
    pub scene: String,
    pub kind: String,
    pub level: String,
    pub method: String,
    pub why: String,
    /// Indices of scene and method in the gallery.
    pub shown: Option<(usize, usize)>,
}

/// Every failure. `scenes` and `methods`: their indices in the gallery.
pub fn failures(rows: &[Row], scenes: &HashMap<&str, usize>, methods: &[String]) -> Vec<Failure> {
    let failed = rows.iter().filter(|r| !r.ok && r.applies());
    let failure = |row: &Row| Failure {
        attributes: Setting::new(&row.set, row.kind, row.level).attributes(),
        scene: row.scene.clone(),
        kind: kind_name(row.kind),
        level: part_name(&row.set, row.level),
        method: row.method.clone(),
        why: row.why(),
        shown: scenes
            .get(row.scene.as_str())
            .copied()
            .zip(methods.iter().position(|m| *m == row.method)),
    };
    failed.map(failure).collect()
}
