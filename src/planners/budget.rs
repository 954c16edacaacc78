//! How much work a planner may do, and how long it goes on once it has a path.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::world::UnknownName;

/// How much work a planner may spend. Counts work, never time, so that results are
/// the same on every machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Node expansions over all searches of the call.
    pub max_expansions: usize,
    /// What becomes of the first path.
    pub effort: Effort,
}

impl Budget {
    /// `max_expansions` with the usual effort.
    pub const fn new(max_expansions: usize) -> Self {
        Self { max_expansions, effort: Effort::Usual }
    }
}

impl Default for Budget {
    /// 200,000 expansions, some tenths of a second at most.
    fn default() -> Self {
        Self::new(200_000)
    }
}

/// How long a planner goes on once it has a path. Who drives step by step, a policy, never does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// The first path is the answer, as it was found.
    First,
    /// Corners of a searched path are cut, and where it still costs more than 1.1 times what any path
    /// must, 400 expansions look for something cheaper, or twice as many as it took where that is more.
    /// Of a path known without a search corners are cut where it costs more than usual or passes
    /// something near; it is searched for only where it is far from what was foreseen.
    #[default]
    Usual,
    /// Every path that costs more than it must, obstacles aside, is looked at again, with half of
    /// what is left of the budget.
    Most,
}

impl Effort {
    /// All of them, the least first.
    pub const ALL: [Effort; 3] = [Effort::First, Effort::Usual, Effort::Most];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Effort::First => "first",
            Effort::Usual => "usual",
            Effort::Most => "most",
        }
    }

    /// A path that costs at most so many times what any path must cost is good enough.
    pub(crate) fn enough(self) -> f64 {
        match self {
            Effort::First => f64::INFINITY,
            Effort::Usual => 1.1,
            Effort::Most => 1.001,
        }
    }

    /// Expansions, of `left`, for something better than a path that took `spent`, or than one that was
    /// known: nothing was spent on that yet, and a search for something cheaper ends early where there is none.
    pub(crate) fn patience(self, spent: Option<usize>, left: usize) -> usize {
        const KNOWN: usize = 10_000;
        const LEAST: usize = 400;
        match self {
            Effort::First => 0,
            Effort::Usual => {
                spent.map_or(KNOWN, |spent| LEAST.max(spent.saturating_mul(2))).min(left)
            }
            Effort::Most => left / 2,
        }
    }
}

impl fmt::Display for Effort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Effort {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|e| e.name() == text).ok_or_else(|| UnknownName {
            what: "effort",
            name: text.to_owned(),
            expected: Self::ALL.map(Self::name).join(", "),
        })
    }
}
