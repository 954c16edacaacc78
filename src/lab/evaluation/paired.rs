//! Methods held against `n3p`, scene by scene.
//!
//! Scenes differ more than methods do, so that means of a method over all scenes say little about two
//! methods that are near. Here each scene is its own comparison: how many times `n3p`'s the cost of a
//! method's path is there, and its time.

use std::collections::HashMap;

use rand::RngExt;
use serde::Serialize;

use super::metrics::{Interval, bootstrap, by_method};
use super::table::{Table, span};
use crate::episode::Row;
use crate::episode::comparison::{best, measured};
use crate::n3p::Method;
use crate::rng::{Stream, rng};

/// How to read the table.
pub(super) const NOTE: &str = "\
Each scene that both methods solve is one comparison with `n3p`. “× cost” is the geometric mean over the \
scenes of a method's cost (length and 3 m for every change of direction) by that of `n3p`: above 1 where `n3p`'s \
paths are cheaper. “Dearer” and “cheaper” say in how many scenes it differs by more than 1 %. p: how often the mean \
would be as far from 1 if in every scene it were a coin's toss which of the two is which (10,000 tosses of all). “× time” is \
the same mean of planning times. Intervals are 95 % bootstrap percentile intervals over scenes.";

/// Tosses of all coins.
const TOSSES: usize = 10_000;
/// Costs that differ by less are equal.
const EQUAL: f64 = 0.01;

/// A method against `n3p` in the scenes of one set that both solve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    /// The set of scenes.
    pub set: String,
    /// Name of the method.
    pub method: String,
    /// Scenes that both solve.
    pub scenes: usize,
    /// Geometric mean of the method's cost by that of `n3p`.
    pub cost: f64,
    /// Its interval.
    pub cost_interval: Interval,
    /// Share of the scenes in which its path is dearer, per cent.
    pub dearer_percent: f64,
    /// And cheaper.
    pub cheaper_percent: f64,
    /// How likely the mean of costs would be as far from 1 by chance.
    pub p: f64,
    /// Geometric mean of the method's time by that of `n3p`.
    pub time: f64,
    /// Its interval.
    pub time_interval: Interval,
}

/// Every other method against `n3p`, by set; empty without `n3p`.
pub fn compare(rows: &[Row], seed: u64) -> Vec<Pair> {
    let best = best(rows);
    let mut sets: Vec<&str> = Vec::new();
    for row in rows {
        if !sets.contains(&row.set.as_str()) {
            sets.push(&row.set);
        }
    }
    let mut pairs = Vec::new();
    for set in sets {
        let own: Vec<&Row> = rows.iter().filter(|r| r.set == set && r.applies()).collect();
        let methods = by_method(&own);
        let Some((_, ours)) = methods.iter().find(|(name, _)| *name == Method::N3P.name()) else {
            continue;
        };
        let seen = |row: &Row| Some((measured(row, &best)?.0, row.plan_time_s));
        let ours: HashMap<&str, (f64, f64)> =
            ours.iter().filter_map(|row| Some((row.scene.as_str(), seen(row)?))).collect();
        for (method, rows) in methods.iter().filter(|(name, _)| *name != Method::N3P.name()) {
            let ratios: Vec<[f64; 2]> = rows
                .iter()
                .filter_map(|row| {
                    let (cost, time) = seen(row)?;
                    let (our_cost, our_time) = ours.get(row.scene.as_str())?;
                    Some([(cost / our_cost).ln(), (time / our_time).ln()])
                })
                .collect();
            if !ratios.is_empty() {
                pairs.push(pair(set, method, &ratios, seed, pairs.len() as u64));
            }
        }
    }
    pairs
}

/// Of the logarithms of the ratios of cost and time in each scene.
fn pair(set: &str, method: &str, ratios: &[[f64; 2]], seed: u64, number: u64) -> Pair {
    let scenes = ratios.len();
    let mean_of = |which: usize, picks: &[usize]| {
        (picks.iter().map(|&i| ratios[i][which]).sum::<f64>() / picks.len() as f64).exp()
    };
    let interval = |which: usize| {
        let stream = 1 << 48 | number << 1 | which as u64;
        bootstrap(scenes, seed, stream, |picks| mean_of(which, picks))
    };
    let all: Vec<usize> = (0..scenes).collect();
    let share = |is: &dyn Fn(f64) -> bool| {
        100.0 * ratios.iter().filter(|[cost, _]| is(cost.exp())).count() as f64 / scenes as f64
    };
    Pair {
        set: set.to_owned(),
        method: method.to_owned(),
        scenes,
        cost: mean_of(0, &all),
        cost_interval: interval(0),
        dearer_percent: share(&|ratio| ratio > 1.0 + EQUAL),
        cheaper_percent: share(&|ratio| ratio < 1.0 - EQUAL),
        p: by_chance(ratios.iter().map(|[cost, _]| *cost).collect(), seed, number),
        time: mean_of(1, &all),
        time_interval: interval(1),
    }
}

/// The share of all ways to choose the signs of `differences` whose mean is as far from 0 as that of the
/// signs they have, from a sample of them that holds these.
fn by_chance(differences: Vec<f64>, seed: u64, number: u64) -> f64 {
    let mut rng = rng(seed, Stream::Bootstrap, 1 << 49 | number);
    let seen = differences.iter().sum::<f64>().abs();
    let mut as_far = 1;
    for _ in 0..TOSSES {
        let mut sum = 0.0;
        for of_64 in differences.chunks(64) {
            let mut signs: u64 = rng.random();
            for difference in of_64 {
                sum += if signs & 1 == 0 { *difference } else { -*difference };
                signs >>= 1;
            }
        }
        as_far += usize::from(sum.abs() >= seen * (1.0 - 1e-12));
    }
    as_far as f64 / (TOSSES + 1) as f64
}

/// One line per set and method.
pub fn table(pairs: &[Pair]) -> Table {
    let headers = [
        "scenes of",
        "method",
        "scenes",
        "× cost",
        "95 % CI",
        "dearer in %",
        "cheaper in %",
        "p",
        "× time",
        "95 % CI",
    ];
    let line = |pair: &Pair| {
        let p = if pair.p < 0.001 { "< 0.001".to_owned() } else { format!("{:.3}", pair.p) };
        vec![
            pair.set.clone(),
            pair.method.clone(),
            pair.scenes.to_string(),
            format!("{:.3}", pair.cost),
            span(pair.cost_interval),
            format!("{:.1}", pair.dearer_percent),
            format!("{:.1}", pair.cheaper_percent),
            p,
            format!("{:.3}", pair.time),
            span(pair.time_interval),
        ]
    };
    Table {
        title: "Every method against n3p, scene by scene".to_owned(),
        headers: headers.map(str::to_owned).to_vec(),
        rows: pairs.iter().map(line).collect(),
        text_columns: 2,
    }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::tests::row;
    use super::*;
    use crate::planners::NoPath;

    fn driven(scene: usize, method: &str, length: f64, time: f64) -> Row {
        Row {
            length_m: Some(length),
            direction_changes: Some(0),
            ..row(&format!("s{scene}"), method, time, true)
        }
    }

    #[test]
    fn a_method_that_is_always_a_tenth_dearer_and_half_as_fast() {
        let mut rows = Vec::new();
        for i in 0..40 {
            let length = 5.0 + i as f64;
            rows.push(driven(i, "n3p", length, 1e-3));
            rows.push(driven(i, "ha-rs", 1.1 * length, 2e-3));
        }
        // Neither enters: one did not solve the scene, the other does not apply.
        rows.push(driven(40, "n3p", 1.0, 1e-3));
        rows.push(Row { ok: false, ..driven(40, "ha-rs", 9.0, 1e-3) });
        rows.push(Row {
            reason: NoPath::NotApplicable.to_string(),
            ok: false,
            ..driven(0, "sha", 1.0, 1e-3)
        });
        let pairs = compare(&rows, 3);
        let [pair] = &pairs[..] else { panic!("{pairs:?}") };
        assert_eq!((pair.method.as_str(), pair.scenes), ("ha-rs", 40));
        assert!((pair.cost - 1.1).abs() < 1e-12 && (pair.time - 2.0).abs() < 1e-12);
        // Every pair has the same ratio, so resampling cannot move it.
        assert!(
            (pair.cost_interval.low - 1.1).abs() < 1e-9
                && (pair.cost_interval.high - 1.1).abs() < 1e-9
        );
        assert_eq!((pair.dearer_percent, pair.cheaper_percent), (100.0, 0.0));
        assert!(pair.p < 0.001);
        assert_eq!(table(&pairs).rows[0][3], "1.100");
        assert_eq!(pairs, compare(&rows, 3), "same seed, same numbers");
        rows.retain(|r| r.method != "n3p");
        assert!(compare(&rows, 3).is_empty());
    }

    /// Of two methods that are the same but for luck, p is below 0.05 about one time in twenty.
    #[test]
    fn chance_is_told_from_a_difference() {
        let mut below = 0;
        for seed in 0..400 {
            let mut rng = rng(seed, Stream::Scene, 1);
            let differences: Vec<f64> = (0..30).map(|_| rng.random_range(-1.0..1.0)).collect();
            below += usize::from(by_chance(differences.clone(), seed, 0) < 0.05);
            let shifted = differences.iter().map(|difference| difference + 1.0).collect();
            assert!(by_chance(shifted, seed, 0) < 0.001);
        }
        assert!((8..=36).contains(&below), "{below} of 400");
        assert_eq!(by_chance(vec![0.0; 9], 1, 0), 1.0);
    }
}
