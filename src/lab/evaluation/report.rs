//! `report.md`: the tables of a run, and where its numbers come from.

use std::fmt::Write;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

use super::away;
use super::clearance;
use super::drives;
use super::learning_curve::{self, CurvePoint};
use super::metrics;
use super::paired;
use super::quality;
use super::table;
use crate::episode::Row;
use crate::lab::dataset::schema::GIT_REVISION;
use crate::lab::driving::DriveRow;
use crate::planners::{Budget, Effort};

/// Where and how a run was made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// UTC, `YYYY-MM-DD hh:mm`.
    pub date: String,
    /// Model of the processor, where the system tells.
    pub processor: String,
    /// Logical cores of the machine.
    pub cores: usize,
    /// Worker threads used for the episodes.
    pub threads: usize,
    /// Version of this crate.
    pub crate_version: String,
    /// Git revision of the build, `unknown` outside a checkout.
    pub git_revision: String,
    /// What the scenes are and which seeds made them.
    pub scenes: String,
    /// Seed of the bootstrap intervals.
    pub seed: u64,
    /// Expansion budget per episode.
    pub max_expansions: usize,
    /// What became of first paths.
    pub effort: Effort,
}

impl Provenance {
    /// This machine, this build, now.
    pub fn here(scenes: String, seed: u64, budget: Budget, threads: usize) -> Self {
        let arguments: Vec<String> = std::env::args().collect();
        let program = arguments.first().map_or("", |p| p.rsplit(['/', '\\']).next().unwrap_or(p));
        let rest = arguments.iter().skip(1).map(String::as_str);
        Self {
            command: [program].into_iter().chain(rest).collect::<Vec<_>>().join(" "),
            date: date(SystemTime::now()),
            processor: processor(),
            cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
            threads,
            crate_version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: GIT_REVISION.to_owned(),
            scenes,
            seed,
            max_expansions: budget.max_expansions,
            effort: budget.effort,
        }
    }
}

impl Provenance {
    /// Everything but the command, named, for people.
    pub fn facts(&self) -> [(&'static str, String); 7] {
        [
            ("Date (UTC)", self.date.clone()),
            ("Machine", format!("{}, {} logical cores", self.processor, self.cores)),
            ("Threads", self.threads.to_string()),
            ("Version", format!("n3p {}, revision {}", self.crate_version, self.git_revision)),
            ("Scenes", self.scenes.clone()),
            ("Seed of the intervals", self.seed.to_string()),
            (
                "Budget",
                format!("{} expansions per episode, effort {}", self.max_expansions, self.effort),
            ),
        ]
    }
}

/// The tables of a run as plain text, for a terminal.
pub fn text(rows: &[Row], seed: u64) -> String {
    let groups = metrics::summarise(rows, seed);
    let mut out = String::new();
    for table in table::comparison(&groups) {
        let _ = writeln!(out, "{}", table.text());
    }
    let _ = writeln!(out, "{}", table::speed_ups(&groups).text());
    let _ = writeln!(out, "{}", quality::table(&quality::summarise(rows)).text());
    let paired = paired::compare(rows, seed);
    if !paired.is_empty() {
        let _ = writeln!(out, "{}", paired::table(&paired).text());
    }
    let clearance = clearance::table(rows);
    if !clearance.rows.is_empty() {
        let _ = writeln!(out, "{}", clearance.text());
    }
    let failures = table::failures(rows);
    if failures.rows.is_empty() {
        let applicable = rows.iter().filter(|r| r.applies()).count();
        let _ = writeln!(out, "No failures in {applicable} rows.");
    } else {
        let _ = writeln!(out, "{}", failures.text());
    }
    for t in metrics::totals(rows).iter().filter(|t| t.not_applicable > 0) {
        let (name, count) = (&t.method, t.not_applicable);
        let _ = writeln!(out, "{name} is not applicable to {count} scenes, which are left out.");
    }
    out
}

/// What a report is about.
#[derive(Clone, Copy, Debug)]
pub struct Results<'a> {
    /// Its heading.
    pub title: &'a str,
    /// All rows of the run.
    pub rows: &'a [Row],
    /// What became of the paths that were driven; may be empty.
    pub drives: &'a [DriveRow],
    /// What more data gives; may be empty.
    pub curve: &'a [CurvePoint],
    /// Where the numbers come from.
    pub provenance: &'a Provenance,
}

/// The whole `report.md`.
pub fn markdown(results: &Results) -> String {
    let &Results { title, rows, drives, curve, provenance } = results;
    let groups = metrics::summarise(rows, provenance.seed);
    let mut out = format!("# {title}\n\n- Command: `{}`\n", provenance.command);
    for (name, value) in provenance.facts() {
        let _ = writeln!(out, "- {name}: {value}");
    }
    out += "\n";
    out += &headline(rows);
    let compared = away::compare(rows, None);
    if !compared.is_empty() {
        let told = away::sentence(&compared).map_or(String::new(), |told| told + "\n\n");
        let _ = write!(out, "\n{}\n{told}{}\n", away::table(&compared).markdown(), away::NOTE);
    }
    for table in table::comparison(&groups) {
        let _ = write!(out, "\n{}", table.markdown());
    }
    let _ = write!(out, "\n{}", table::speed_ups(&groups).markdown());
    let _ = write!(out, "\n{NOTES}");
    let quality = quality::table(&quality::summarise(rows));
    let _ = write!(out, "\n{}\n{}\n", quality.markdown(), quality::NOTE);
    let paired = paired::compare(rows, provenance.seed);
    if !paired.is_empty() {
        let _ = write!(out, "\n{}\n{}\n", paired::table(&paired).markdown(), paired::NOTE);
    }
    let clearance = clearance::table(rows);
    if !clearance.rows.is_empty() {
        let _ = write!(out, "\n{}\n{}\n", clearance.markdown(), clearance::NOTE);
    }
    let failures = table::failures(rows);
    if failures.rows.is_empty() {
        out += "\n## Failures\n\nNone.\n";
    } else {
        let _ = write!(out, "\n{}", failures.markdown());
    }
    if !curve.is_empty() {
        let _ = write!(out, "\n{}\n{CURVE_NOTE}", learning_curve::table(curve).markdown());
    }
    if !drives.is_empty() {
        let _ = write!(out, "\n{}\n{}\n", drives::table(drives).markdown(), drives::NOTE);
    }
    out
}

/// How to read the learning curve.
pub(super) const CURVE_NOTE: &str = "\
Each line: models from a part of the data set, planning in generated scenes that \
are neither trained on nor reported above. “Per cell” counts samples collected in each cell of \
the grid, “samples” those solved.\n";

/// How to read the tables: paragraphs of plain text, an empty line between two.
pub(super) const NOTES: &str = "\
T runs from the obstacles in hand to the certified path: abstraction, heuristic and \
inference count, reading files does not. It is the median of up to five runs after a warm-up \
where a run is cheap, a single run beyond 50 ms. T and N_node are over all scenes, failures \
included; Δδ, length and N_dc over the solved ones.\n\n\
“× faster” is the ratio of mean times over the same scenes, against the graph search with \
the smallest mean time of this run; its interval resamples scenes, so times stay paired. \
Intervals are 95 % bootstrap percentile intervals (2000 resamples).\n\n\
The paper's lines were measured by its authors on their machine and their scenes: compare \
ratios, not times. Every path here was accepted by a check written apart from the planners, \
or counts as a failure.\n";

/// One sentence per method, over everything.
fn headline(rows: &[Row]) -> String {
    let mut out = String::new();
    for t in metrics::totals(rows) {
        let _ = write!(out, "- `{}`: {} of {} solved", t.method, t.solved, t.scenes);
        if t.rejected > 0 {
            let _ = write!(out, ", **{} rejected by the independent check**", t.rejected);
        }
        if t.not_applicable > 0 {
            let _ = write!(out, ", not applicable to {} others", t.not_applicable);
        }
        if t.fallbacks > 0 {
            let _ = write!(out, ", {} by full search", t.fallbacks);
        }
        out += ".\n";
    }
    out
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|l| l.starts_with("model name"));
    model
        .and_then(|l| l.split_once(':'))
        .map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

/// `YYYY-MM-DD hh:mm` in UTC.
fn date(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (days, minutes) = ((seconds / 86_400) as i64, seconds % 86_400 / 60);
    // Days to civil date: H. Hinnant, "chrono-Compatible Low-Level Date Algorithms".
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let day_of_era = z.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02} {:02}:{:02}", minutes / 60, minutes % 60)
}

#[cfg(test)]
mod tests {
    use super::super::metrics::tests::row;
    use super::*;
    use std::time::Duration;

    #[test]
    fn dates() {
        let at = |s| date(UNIX_EPOCH + Duration::from_secs(s));
        assert_eq!(at(0), "1970-01-01 00:00");
        assert_eq!(at(951_827_696), "2000-02-29 12:34");
        assert_eq!(at(1_767_225_599), "2025-12-31 23:59");
    }

    #[test]
    fn the_report_names_machine_seed_and_every_failure() {
        let rows = [row("a", "ha-rs", 0.5, true), row("b", "ha-rs", 0.4, false)];
        let provenance = Provenance::here("2 made by hand".into(), 7, Budget::new(100), 1);
        let report = markdown(&Results {
            title: "Test",
            rows: &rows,
            drives: &[],
            curve: &[],
            provenance: &provenance,
        });
        for part in ["Machine: ", "intervals: 7", "1 of 2 solved", "| b | ha-rs | budget spent |"] {
            assert!(report.contains(part), "{part} not in\n{report}");
        }
        assert!(text(&rows, 7).contains("budget spent"));
    }
}
