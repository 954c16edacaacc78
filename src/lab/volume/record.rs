//! What a shard leaves: counts, failures by scene, extremes; and, apart from them, times.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};

use crate::episode::{CHANGE_M, FLOOR_M, REJECTED, Row};
use crate::files::{reason, sha256_hex, write_whole};
use crate::lab::shards::State;

/// The record of a finished shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardRecord {
    /// Of the configuration.
    pub config_sha256: String,
    /// Of the build.
    pub crate_version: String,
    /// Of the build.
    pub git_revision: String,
    /// Which shard, from 0.
    pub shard: u64,
    /// The same on every machine.
    pub results: Results,
    /// Another one each time.
    pub times: Times,
}

/// What came of some scenes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// By world.
    pub worlds: BTreeMap<String, Counts>,
    /// Every scene without an accepted path.
    pub failures: Vec<Failure>,
    /// The most node expansions.
    pub most_expansions: Extremes,
    /// The largest costs over that of the shortest curve from start to goal through empty space. The cost is
    /// the length and 3 m for each change of gear.
    pub worst_quality: Extremes,
    /// How many plans took 0, 1, 2 … 3, 4 … 7, … expansions.
    pub expansions: Histogram,
}

/// Numbers of scenes and plans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// All.
    pub scenes: u64,
    /// With a path that the independent check accepts.
    pub accepted: u64,
    /// With a path that it refuses: must be 0.
    pub refused: u64,
    /// In which planning panicked: must be 0.
    pub panicked: u64,
    /// Without a path.
    pub no_path: u64,
    /// Which are none: start or goal is not free.
    pub no_problem: u64,
    /// Metres driven by accepted paths.
    pub metres: f64,
    /// Changes of gear of accepted paths.
    pub changes: u64,
}

/// A scene without an accepted path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Failure {
    /// The scene: `n3p-experiment volume FILE --write-scene NUMBER` writes it.
    pub number: u64,
    /// Which of [`Counts`] it is.
    pub what: Outcome,
    /// Why.
    pub reason: String,
}

/// What became of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// A path that the independent check accepts.
    Accepted,
    /// A path that it refuses.
    Refused,
    /// Planning panicked.
    Panicked,
    /// No path.
    NoPath,
    /// No problem: start or goal is not free.
    NoProblem,
}

/// Times on the machine at hand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Times {
    /// Of planning and checking the shard, by one thread.
    pub seconds: f64,
    /// The slowest plans, seconds.
    pub slowest: Extremes,
    /// How many plans took 0, 1, 2 … 3, 4 … 7, … µs.
    pub microseconds: Histogram,
}

/// The largest values, with their scenes; the largest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Extremes(pub Vec<Extreme>);

/// A value of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extreme {
    /// The scene.
    pub number: u64,
    /// The value.
    pub value: f64,
}

impl Extremes {
    /// So many are kept.
    const KEPT: usize = 5;

    /// Takes one more, where it is among the largest; of equals the first scene.
    pub fn push(&mut self, number: u64, value: f64) {
        let larger = |e: &Extreme| (e.value, number) > (value, e.number);
        let at = self.0.partition_point(larger);
        if at < Self::KEPT {
            self.0.insert(at, Extreme { number, value });
            self.0.truncate(Self::KEPT);
        }
    }
}

/// Counts of 0, 1, 2 … 3, 4 … 7 and so on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Histogram(pub Vec<u64>);

impl Histogram {
    /// Counts one value.
    pub fn push(&mut self, value: u64) {
        let bin = (u64::BITS - value.leading_zeros()) as usize;
        self.0.resize(self.0.len().max(bin + 1), 0);
        self.0[bin] += 1;
    }

    /// Adds another one.
    pub fn add(&mut self, other: &Self) {
        self.0.resize(self.0.len().max(other.0.len()), 0);
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += b);
    }

    /// The least value that a `share` of all are below: a power of two.
    pub fn below(&self, share: f64) -> u64 {
        let total: u64 = self.0.iter().sum();
        let mut so_far = 0;
        for (bin, count) in self.0.iter().enumerate() {
            so_far += count;
            if so_far as f64 >= share * total as f64 {
                return 1 << bin;
            }
        }
        0
    }
}

impl Counts {
    /// Adds others.
    pub fn add(&mut self, other: &Self) {
        self.scenes += other.scenes;
        self.accepted += other.accepted;
        self.refused += other.refused;
        self.panicked += other.panicked;
        self.no_path += other.no_path;
        self.no_problem += other.no_problem;
        self.metres += other.metres;
        self.changes += other.changes;
    }

    fn count(&mut self, what: Outcome) {
        self.scenes += 1;
        *match what {
            Outcome::Accepted => &mut self.accepted,
            Outcome::Refused => &mut self.refused,
            Outcome::Panicked => &mut self.panicked,
            Outcome::NoPath => &mut self.no_path,
            Outcome::NoProblem => &mut self.no_problem,
        } += 1;
    }
}

impl Results {
    /// Counts a scene that left no row.
    pub fn fail(&mut self, world: &str, failure: Failure) {
        self.worlds.entry(world.to_owned()).or_default().count(failure.what);
        self.failures.push(failure);
    }

    /// Counts a scene's row. `shortest`: length of the shortest curve from start to goal, metres.
    pub fn push(&mut self, number: u64, row: &Row, shortest: f64) {
        let nodes = u64::from(row.nodes);
        self.expansions.push(nodes);
        self.most_expansions.push(number, nodes as f64);
        let (true, Some(length), Some(changes)) = (row.ok, row.length_m, row.direction_changes)
        else {
            let refused = row.reason == REJECTED;
            let reason = if refused { row.checked.clone() } else { row.reason.clone() };
            let what = if refused { Outcome::Refused } else { Outcome::NoPath };
            return self.fail(&row.set, Failure { number, what, reason });
        };
        let counts = self.worlds.entry(row.set.clone()).or_default();
        counts.count(Outcome::Accepted);
        counts.metres += length;
        counts.changes += u64::from(changes);
        let cost = (length + CHANGE_M * f64::from(changes)).max(FLOOR_M);
        self.worst_quality.push(number, cost / shortest.max(FLOOR_M));
    }

    /// Adds those of another shard.
    pub fn add(&mut self, other: &Self) {
        for (world, counts) in &other.worlds {
            self.worlds.entry(world.clone()).or_default().add(counts);
        }
        self.failures.extend(other.failures.iter().cloned());
        let all = [
            (&mut self.most_expansions, &other.most_expansions),
            (&mut self.worst_quality, &other.worst_quality),
        ];
        all.into_iter()
            .for_each(|(mine, others)| others.0.iter().for_each(|e| mine.push(e.number, e.value)));
        self.expansions.add(&other.expansions);
    }

    /// Over all worlds.
    pub fn total(&self) -> Counts {
        let mut total = Counts::default();
        self.worlds.values().for_each(|counts| total.add(counts));
        total
    }
}

impl Times {
    /// Counts a plan.
    pub fn push(&mut self, number: u64, seconds: f64) {
        self.slowest.push(number, seconds);
        self.microseconds.push((seconds * 1e6) as u64);
    }

    /// Adds those of another shard.
    pub fn add(&mut self, other: &Self) {
        self.seconds += other.seconds;
        other.slowest.0.iter().for_each(|e| self.slowest.push(e.number, e.value));
        self.microseconds.add(&other.microseconds);
    }
}

/// A record with its checksum, as it is on disk.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Sealed {
    sha256: String,
    record: ShardRecord,
}

impl ShardRecord {
    /// The file of a shard.
    pub fn path(folder: &Path, shard: u64) -> PathBuf {
        folder.join(Self::file_name(shard))
    }

    /// The same without folder.
    pub fn file_name(shard: u64) -> String {
        format!("shard-{shard:06}.json")
    }

    /// Writes the record; it appears whole or not at all.
    #[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let sealed = Sealed { sha256: self.sum(), record: self.clone() };
        let json = serde_json::to_string_pretty(&sealed).expect("plain data") + "\n";
        write_whole(&Self::path(folder, self.shard), json.as_bytes())
    }

    /// The record of a shard, where there is one that is whole and its own.
    pub fn read(folder: &Path, shard: u64) -> Option<Self> {
        Self::read_or_why(folder, shard).ok()
    }

    /// The record of a shard, or what is there instead.
    pub(super) fn read_or_why(folder: &Path, shard: u64) -> Result<Self, State> {
        let damaged = |why: &str| State::Damaged(why.to_owned());
        let bytes = fs::read(Self::path(folder, shard)).map_err(|e| match e.kind() {
            io::ErrorKind::NotFound => State::Missing,
            _ => State::Damaged(reason(&e)),
        })?;
        let Sealed { sha256, record } =
            serde_json::from_slice(&bytes).map_err(|_| damaged("no record of a shard"))?;
        if record.sum() != sha256 {
            return Err(damaged("it has not the checksum that it names"));
        }
        if record.shard != shard {
            return Err(State::Foreign(format!("it is the record of shard {}", record.shard)));
        }
        Ok(record)
    }

    fn sum(&self) -> String {
        sha256_hex(&[serde_json::to_string(self).expect("plain data").as_bytes()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_are_the_largest_in_any_order() {
        let values = [3.0, 9.0, 1.0, 9.0, 4.0, 7.0, 2.0];
        let mut extremes = [Extremes::default(), Extremes::default()];
        for i in 0..values.len() {
            let j = values.len() - 1 - i;
            extremes[0].push(i as u64, values[i]);
            extremes[1].push(j as u64, values[j]);
        }
        assert_eq!(extremes[0], extremes[1]);
        let numbers: Vec<u64> = extremes[0].0.iter().map(|e| e.number).collect();
        assert_eq!(numbers, [1, 3, 5, 4, 0]);
    }

    #[test]
    fn a_histogram_says_what_a_share_is_below() {
        let mut histogram = Histogram::default();
        [0, 0, 1, 5, 900].iter().for_each(|&v| histogram.push(v));
        assert_eq!(histogram.0, [2, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1]);
        assert_eq!([0.4, 0.6, 0.8, 1.0].map(|s| histogram.below(s)), [1, 2, 8, 1024]);
    }

    #[test]
    fn a_record_is_read_back_only_whole() {
        let dir = tempfile::tempdir().unwrap();
        let record = ShardRecord {
            config_sha256: "c".into(),
            crate_version: "0".into(),
            git_revision: "r".into(),
            shard: 7,
            results: Results::default(),
            times: Times { seconds: 1.0 / 3.0, ..Times::default() },
        };
        record.write(dir.path()).unwrap();
        assert_eq!(ShardRecord::read(dir.path(), 7).unwrap(), record);
        let path = ShardRecord::path(dir.path(), 7);
        // Under another name, with another number, cut off.
        fs::copy(&path, ShardRecord::path(dir.path(), 8)).unwrap();
        assert!(ShardRecord::read(dir.path(), 8).is_none());
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("\"seconds\": 0.3", "\"seconds\": 0.4")).unwrap();
        assert!(ShardRecord::read(dir.path(), 7).is_none());
        fs::write(&path, &text[..text.len() / 2]).unwrap();
        assert!(ShardRecord::read(dir.path(), 7).is_none());
    }
}
