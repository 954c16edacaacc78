//! What the records of a run say together.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use super::record::{Counts, Extremes, Outcome, Results, ShardRecord, Times};
use super::run::is_this_build;
use super::{VolumeConfig, VolumeError};
use crate::files::write_whole;

/// All records of a folder together.
#[derive(Clone, Debug, Default)]
pub struct Totals {
    /// Shards with a record of this configuration and build.
    pub shards: u64,
    /// All shards.
    pub of: u64,
    /// The same on every machine.
    pub results: Results,
    /// Of the machines at hand.
    pub times: Times,
}

impl Totals {
    /// Reads the records in `out`; where all are there, writes `volume.json` and `volume.md`.
    pub fn read(config: &VolumeConfig, out: &Path) -> Result<Self, VolumeError> {
        let mut totals = Self { of: config.shards(), ..Self::default() };
        for shard in 0..config.shards() {
            let record = ShardRecord::read(out, shard);
            let record = record.filter(|r| r.config_sha256 == config.sha256() && is_this_build(r));
            let Some(record) = record else { continue };
            totals.shards += 1;
            totals.results.add(&record.results);
            totals.times.add(&record.times);
        }
        if totals.shards == totals.of {
            let json = serde_json::json!({
                "config": config, "results": totals.results, "times": totals.times,
            });
            for (name, text) in
                [("volume.json", format!("{json:#}\n")), ("volume.md", totals.markdown())]
            {
                let path = out.join(name);
                write_whole(&path, text.as_bytes())
                    .map_err(|error| VolumeError::Io { path, error })?;
            }
        }
        Ok(totals)
    }

    /// Whether every path was accepted and nothing panicked.
    pub fn is_clean(&self) -> bool {
        let Counts { refused, panicked, .. } = self.results.total();
        refused + panicked == 0
    }

    /// Tables for people.
    pub fn markdown(&self) -> String {
        let mut text = String::from(
            "| world | scenes | accepted | refused | panicked | no path | no problem | metres | changes of gear |\n\
             |---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
        );
        let total = self.results.total();
        let rows = self.results.worlds.iter().map(|(name, counts)| (name.as_str(), counts));
        for (name, c) in rows.chain([("all", &total)]) {
            let Counts { scenes, accepted, refused, panicked, no_path, no_problem, .. } = c;
            let _ = writeln!(
                text,
                "| {name} | {scenes} | {accepted} | {refused} | {panicked} | {no_path} | {no_problem} | {:.0} | {} |",
                c.metres, c.changes
            );
        }
        let mut reasons: BTreeMap<(Outcome, String), (u64, Vec<u64>)> = BTreeMap::new();
        for failure in &self.results.failures {
            let entry = reasons.entry((failure.what, plain(&failure.reason))).or_default();
            entry.0 += 1;
            if entry.1.len() < 3 {
                entry.1.push(failure.number);
            }
        }
        if !reasons.is_empty() {
            text += "\n| reason | scenes | such as |\n|---|--:|---|\n";
        }
        for ((_, reason), (count, such)) in reasons {
            let such: Vec<String> = such.iter().map(u64::to_string).collect();
            let _ = writeln!(text, "| {reason} | {count} | {} |", such.join(", "));
        }
        let all = |extremes: &Extremes, digits: usize| {
            let one = |e: &super::Extreme| format!("{:.digits$} ({})", e.value, e.number);
            extremes.0.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let results = &self.results;
        let micros = &self.times.microseconds;
        let _ = write!(
            text,
            "\n| largest, and scene | |\n|---|---|\n\
             | node expansions | {} |\n| cost over the shortest curve's length | {} |\n| planning time, s | {} |\n\
             \nOf all plans half took less than {} µs, 99 % less than {} µs, 99.99 % less than {} µs; planning and \
             checking took {:.0} s of threads' time.\n",
            all(&results.most_expansions, 0),
            all(&results.worst_quality, 1),
            all(&self.times.slowest, 3),
            micros.below(0.5),
            micros.below(0.99),
            micros.below(0.9999),
            self.times.seconds,
        );
        text
    }
}

/// A reason without what differs from scene to scene.
fn plain(reason: &str) -> String {
    let mut text = String::new();
    for c in reason.chars() {
        let digit = c.is_ascii_digit();
        if !(digit && text.ends_with('#')) {
            text.push(if digit { '#' } else { c });
        }
    }
    text
}
