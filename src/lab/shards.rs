//! Work that processes and machines share: which of its shards a folder holds, and whether they may be merged.
//!
//! Who hands out shards asks for the [`Shards`] of a folder (`--status`), gives what is not finished to
//! processes (`--shard`), and has the whole put together at last (`--merge`), which
//! [needs](Shards::need_all) every shard to be whole and its own.

use std::path::{Path, PathBuf};

use serde::Serialize;

/// All shards of a piece of work, in order.
#[derive(Clone, Debug, Serialize)]
pub struct Shards {
    /// The number n of `--shard i/n` with which each part has one shard, or one of each kind.
    pub parts: usize,
    /// The shards.
    pub shards: Vec<Shard>,
}

/// One shard.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Shard {
    /// The number i of `--shard i/n` to which it belongs.
    pub part: usize,
    /// Its file, without folder.
    pub file: String,
    /// What the folder holds of it.
    #[serde(flatten)]
    pub state: State,
}

/// What a folder holds of a shard.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "state", content = "why", rename_all = "snake_case")]
pub enum State {
    /// All of it.
    Finished,
    /// Nothing that is finished.
    Missing,
    /// A file whose bytes are not those that were written.
    Damaged(String),
    /// A file that is whole and belongs to something else.
    Foreign(String),
}

/// Shards that are not there, damaged or another's.
#[derive(Debug, thiserror::Error)]
#[error("{path}: cannot be merged: {first}{}; {remedy}", and_more(*others))]
pub struct Unfinished {
    /// The folder.
    pub path: PathBuf,
    /// The first such shard, and what ails it.
    pub first: String,
    /// How many more there are.
    pub others: usize,
    /// What to do about the first.
    pub remedy: &'static str,
}

fn and_more(count: usize) -> String {
    match count {
        0 => String::new(),
        n => format!(" (and {n} more)"),
    }
}

impl Shards {
    /// An error unless every shard is finished; it names a foreign shard first, then a damaged one.
    pub fn need_all(&self, folder: &Path) -> Result<(), Unfinished> {
        const AGAIN: &str = "make it with the same command without --merge";
        let rank = |shard: &&Shard| match shard.state {
            State::Foreign(_) => 0,
            State::Damaged(_) => 1,
            State::Missing => 2,
            State::Finished => 3,
        };
        let unfinished = self.shards.iter().filter(|s| s.state != State::Finished);
        let others = unfinished.clone().count().saturating_sub(1);
        let Some(first) = unfinished.min_by_key(rank) else { return Ok(()) };
        let (what, remedy) = match &first.state {
            State::Foreign(why) => (format!("is foreign: {why}"), "delete it, then make it anew"),
            State::Damaged(why) => (format!("is damaged: {why}"), AGAIN),
            _ => ("is missing or unfinished".to_owned(), AGAIN),
        };
        let first = format!("{} {what}", first.file);
        Err(Unfinished { path: folder.to_owned(), first, others, remedy })
    }

    /// The same as one line of JSON, for programs.
    #[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("plain data")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shards(states: &[State]) -> Shards {
        let shard = |(i, state): (usize, &State)| Shard {
            part: i + 1,
            file: format!("s{i}"),
            state: state.clone(),
        };
        let shards: Vec<Shard> = states.iter().enumerate().map(shard).collect();
        Shards { parts: shards.len(), shards }
    }

    #[test]
    fn what_ails_shards_is_told_worst_first() {
        use State::{Damaged, Finished, Foreign, Missing};
        let folder = Path::new("out");
        shards(&[Finished, Finished]).need_all(folder).unwrap();
        let told = |states: &[State]| shards(states).need_all(folder).unwrap_err().to_string();
        let why = || "why".to_owned();
        assert!(
            told(&[Finished, Missing])
                .starts_with("out: cannot be merged: s1 is missing or unfinished; make")
        );
        let damaged = told(&[Missing, Damaged(why())]);
        assert!(damaged.contains("s1 is damaged: why (and 1 more)"), "{damaged}");
        let foreign = told(&[Missing, Damaged(why()), Foreign(why()), Finished]);
        assert!(foreign.contains("s2 is foreign: why (and 2 more); delete"), "{foreign}");
    }

    #[test]
    fn programs_read_the_states() {
        let json = shards(&[State::Missing, State::Damaged("cut off".to_owned())]).to_json();
        assert_eq!(
            json,
            r#"{"parts":2,"shards":[{"part":1,"file":"s0","state":"missing"},{"part":2,"file":"s1","state":"damaged","why":"cut off"}]}"#
        );
    }
}
