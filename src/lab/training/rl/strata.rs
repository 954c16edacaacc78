//! Which kind of problem comes next.
//!
//! As HOPE does: at first all in turn; then half of the picks balance the counts, and half go
//! where success is farthest below what is wanted.

use std::collections::VecDeque;

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::environment::courses::Stratum;
use crate::rng::{Stream, rng};
use crate::world::Level;

/// Picks that take all strata in turn.
const IN_TURN: u64 = 200;
/// Picks that are balanced over.
const RECENT: usize = 200;
/// Outcomes per stratum that success is taken from.
const OUTCOMES: usize = 250;

/// Picks and outcomes so far, as far as they matter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Strata {
    picks: u64,
    recent: VecDeque<usize>,
    outcomes: [VecDeque<bool>; Stratum::COUNT],
}

impl Strata {
    /// The stratum of the next episode.
    pub fn pick(&mut self, seed: u64) -> usize {
        let mut rng = rng(seed, Stream::Strata, self.picks);
        let stratum = if self.picks < IN_TURN {
            (self.picks % Stratum::COUNT as u64) as usize
        } else if rng.random_bool(0.5) {
            let count = |s: &usize| self.recent.iter().filter(|r| *r == s).count();
            (0..Stratum::COUNT).min_by_key(count).expect("there are strata")
        } else {
            let weights: [f64; Stratum::COUNT] = std::array::from_fn(|s| self.weight(s));
            let mut draw = rng.random_range(0.0..weights.iter().sum());
            let before = |w: &f64| {
                draw -= w;
                draw < 0.0
            };
            weights.iter().position(before).unwrap_or(Stratum::COUNT - 1)
        };
        self.picks += 1;
        push(&mut self.recent, stratum, RECENT);
        stratum
    }

    /// Keeps how an episode ended.
    pub fn record(&mut self, stratum: usize, parked: bool) {
        push(&mut self.outcomes[stratum], parked, OUTCOMES);
    }

    /// Whether it can be: as read from a file.
    pub fn is_sound(&self) -> bool {
        self.recent.iter().all(|s| *s < Stratum::COUNT)
    }

    /// How much success falls short of what is wanted.
    fn weight(&self, stratum: usize) -> f64 {
        let outcomes = &self.outcomes[stratum];
        let parked = outcomes.iter().filter(|o| **o).count();
        let success = parked as f64 / outcomes.len().max(1) as f64;
        let wanted = match Stratum::nth(stratum).level {
            Level::Easy | Level::Complex => 0.95,
            Level::Extreme => 0.90,
        };
        (wanted - success).clamp(0.01, 1.0)
    }
}

fn push<T>(window: &mut VecDeque<T>, value: T, most: usize) {
    if window.len() == most {
        window.pop_front();
    }
    window.push_back(value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_is_picked_more_often_and_nothing_is_forgotten() {
        let mut strata = Strata::default();
        let mut counts = [0; Stratum::COUNT];
        for i in 0..2000 {
            let picked = strata.pick(1);
            strata.record(picked, picked != 4);
            if i >= 1000 {
                counts[picked] += 1;
            }
        }
        assert!(counts[4] > 300 && counts.iter().all(|c| *c > 30), "{counts:?}");
    }
}
