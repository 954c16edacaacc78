//! Rows → numbers: summaries per set, level, type and method, with bootstrap intervals.
//!
//! Times are taken over all scenes of a group, failures included (a failed search costs
//! its time too); everything that describes a path over the solved scenes alone.

use std::collections::HashMap;

use rand::RngExt;
use serde::Serialize;

use crate::episode::Row;
use crate::n3p::Method;
use crate::rng::{Stream, rng};
use crate::world::{Level, ParkingType};

/// Resamples per interval.
pub const RESAMPLES: usize = 2000;

/// A 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// 2.5th percentile.
    pub low: f64,
    /// 97.5th percentile.
    pub high: f64,
}

/// One method on the scenes of one group: one line of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the method.
    pub method: String,
    /// Number of scenes.
    pub scenes: usize,
    /// Failures, per cent.
    pub fail_percent: f64,
    /// Shortest time, seconds.
    pub min_t_s: f64,
    /// Mean time, seconds.
    pub mean_t_s: f64,
    /// Bootstrap interval of the mean time, seconds.
    pub mean_t_interval_s: Interval,
    /// Median time, seconds.
    pub median_t_s: f64,
    /// 95th percentile of time, seconds.
    pub p95_t_s: f64,
    /// Mean Δδ, radians; `None` where nothing was solved, as for the next four.
    pub mean_abs_steer_change_rad: Option<f64>,
    /// Mean length, metres.
    pub mean_length_m: Option<f64>,
    /// Mean number of direction changes.
    pub mean_direction_changes: Option<f64>,
    /// Largest number of direction changes.
    pub max_direction_changes: Option<u32>,
    /// Smallest clearance of all paths, metres.
    pub min_clearance_m: Option<f64>,
    /// Mean expansions.
    pub mean_nodes: f64,
    /// Against the fastest graph search of the group; `None` for that row itself, and
    /// where the run holds none.
    pub speed_up: Option<SpeedUp>,
}

/// How much faster than the reference: the ratio of mean times over the same scenes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpeedUp {
    /// The reference method: the graph search with the smallest mean time.
    pub reference: String,
    /// Scenes that both methods ran on.
    pub scenes: usize,
    /// Mean time of the reference by mean time of the method.
    pub ratio: f64,
    /// Its interval, by resampling scenes (pairs of times).
    pub interval: Interval,
}

/// The summaries of one set, level and type, in the order of the methods' first rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// The set of scenes.
    pub set: String,
    /// Difficulty; `None` where the set has no levels.
    pub level: Option<Level>,
    /// Parking type, where known.
    #[serde(rename = "type")]
    pub kind: Option<ParkingType>,
    /// One per method.
    pub summaries: Vec<Summary>,
}

/// One method over all scenes of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Totals {
    /// Name of the method.
    pub method: String,
    /// Scenes it applies to.
    pub scenes: usize,
    /// Those with an accepted path.
    pub solved: usize,
    /// Those whose path the independent check refused.
    pub rejected: usize,
    /// Those that a guided planner had to search the whole way.
    pub fallbacks: usize,
    /// Scenes it does not apply to.
    pub not_applicable: usize,
    /// Median time, seconds; `None` where it applies nowhere.
    pub median_t_s: Option<f64>,
    /// Mean length of the solved paths, metres.
    pub mean_length_m: Option<f64>,
    /// Their mean number of direction changes.
    pub mean_direction_changes: Option<f64>,
    /// Mean expansions.
    pub mean_nodes: Option<f64>,
}

/// The totals of every method, in the order of their first rows.
pub fn totals(rows: &[Row]) -> Vec<Totals> {
    let rows: Vec<&Row> = rows.iter().collect();
    by_method(&rows).into_iter().map(|(method, rows)| total(method, &rows)).collect()
}

fn total(method: &str, all: &[&Row]) -> Totals {
    let rows: Vec<&Row> = all.iter().copied().filter(|r| r.applies()).collect();
    let count = |is: fn(&Row) -> bool| rows.iter().filter(|r| is(r)).count();
    let solved = || rows.iter().filter(|r| r.ok);
    let mut times: Vec<f64> = rows.iter().map(|r| r.plan_time_s).collect();
    times.sort_by(f64::total_cmp);
    Totals {
        method: method.to_owned(),
        scenes: rows.len(),
        solved: count(|r| r.ok),
        rejected: count(Row::is_rejected),
        fallbacks: count(|r| r.fallback),
        not_applicable: all.len() - rows.len(),
        median_t_s: (!times.is_empty()).then(|| percentile(&times, 0.5)),
        mean_length_m: mean(solved().filter_map(|r| r.length_m)),
        mean_direction_changes: mean(solved().filter_map(|r| r.direction_changes).map(f64::from)),
        mean_nodes: mean(rows.iter().map(|r| f64::from(r.nodes))),
    }
}

/// The rows of one set, level and type, by method in the order of their first rows.
pub(super) struct Grouped<'a> {
    pub set: &'a str,
    pub level: Option<Level>,
    pub kind: Option<ParkingType>,
    pub methods: Vec<(&'a str, Vec<&'a Row>)>,
}

/// The `rows` by method, in the order of their first rows.
pub(super) fn by_method<'a>(rows: &[&'a Row]) -> Vec<(&'a str, Vec<&'a Row>)> {
    let mut methods: Vec<(&str, Vec<&Row>)> = Vec::new();
    let mut places: HashMap<&str, usize> = HashMap::new();
    for &row in rows {
        let place = *places.entry(&row.method).or_insert(methods.len());
        if place == methods.len() {
            methods.push((&row.method, Vec::new()));
        }
        methods[place].1.push(row);
    }
    methods
}

/// The `rows` whose method applies to their scene, by set (in the order of their first rows), level
/// (hardest last) and type.
pub(super) fn grouped(rows: &[Row]) -> Vec<Grouped<'_>> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.applies()).collect();
    let mut sets: Vec<&str> = Vec::new();
    let mut keys = Vec::new();
    for row in &rows {
        let set = sets.iter().position(|s| *s == row.set).unwrap_or_else(|| {
            sets.push(&row.set);
            sets.len() - 1
        });
        keys.push((set, row.level, row.kind));
    }
    // Types as in every table, scenes of no known type last.
    let place = |kind| ParkingType::ALL.iter().position(|k| Some(*k) == kind);
    keys.sort_by_key(|(set, level, kind)| (*set, *level, place(*kind).unwrap_or(usize::MAX)));
    keys.dedup();
    let group = |(set, level, kind): (usize, Option<Level>, Option<ParkingType>)| {
        let set = sets[set];
        let of_group = |r: &&Row| (&r.set[..], r.level, r.kind) == (set, level, kind);
        let own: Vec<&Row> = rows.iter().copied().filter(of_group).collect();
        Grouped { set, level, kind, methods: by_method(&own) }
    };
    keys.into_iter().map(group).collect()
}

/// Summarises the `rows` whose method applies to their scene by set, level (hardest last) and
/// type. `seed` drives the resampling.
pub fn summarise(rows: &[Row], seed: u64) -> Vec<Group> {
    let mut groups = Vec::new();
    for (g, Grouped { set, level, kind, methods }) in grouped(rows).into_iter().enumerate() {
        let reference = methods
            .iter()
            .filter(|(name, _)| name.parse().is_ok_and(Method::is_graph_search))
            .min_by(|a, b| mean_time(&a.1).total_cmp(&mean_time(&b.1)));
        let summaries = methods
            .iter()
            .enumerate()
            .map(|(m, (name, list))| {
                let stream = (g as u64) << 32 | (m as u64) << 1;
                let speed_up = reference.filter(|(reference, _)| reference != name).and_then(
                    |(reference, base)| speed_up(reference, base, list, seed, stream + 1),
                );
                summary(name, list, seed, stream, speed_up)
            })
            .collect();
        groups.push(Group { set: set.to_owned(), level, kind, summaries });
    }
    groups
}

fn summary(
    method: &str,
    rows: &[&Row],
    seed: u64,
    stream: u64,
    speed_up: Option<SpeedUp>,
) -> Summary {
    let mut times: Vec<f64> = rows.iter().map(|r| r.plan_time_s).collect();
    let mean_t_interval_s = bootstrap(times.len(), seed, stream, |picks| {
        picks.iter().map(|&i| times[i]).sum::<f64>() / picks.len() as f64
    });
    times.sort_by(f64::total_cmp);
    let solved: Vec<&&Row> = rows.iter().filter(|r| r.ok).collect();
    let changes = || solved.iter().filter_map(|r| r.direction_changes);
    Summary {
        method: method.to_owned(),
        scenes: rows.len(),
        fail_percent: 100.0 * (rows.len() - solved.len()) as f64 / rows.len() as f64,
        min_t_s: times[0],
        mean_t_s: mean_time(rows),
        mean_t_interval_s,
        median_t_s: percentile(&times, 0.5),
        p95_t_s: percentile(&times, 0.95),
        mean_abs_steer_change_rad: mean(solved.iter().filter_map(|r| r.mean_abs_steer_change_rad)),
        mean_length_m: mean(solved.iter().filter_map(|r| r.length_m)),
        mean_direction_changes: mean(changes().map(f64::from)),
        max_direction_changes: changes().max(),
        min_clearance_m: solved.iter().filter_map(|r| r.min_clearance_m).reduce(f64::min),
        mean_nodes: mean(rows.iter().map(|r| f64::from(r.nodes))).expect("a group has rows"),
        speed_up,
    }
}

fn speed_up(
    reference: &str,
    base: &[&Row],
    rows: &[&Row],
    seed: u64,
    stream: u64,
) -> Option<SpeedUp> {
    let times: HashMap<&str, f64> =
        base.iter().map(|r| (r.scene.as_str(), r.plan_time_s)).collect();
    let pairs: Vec<(f64, f64)> =
        rows.iter().filter_map(|r| Some((*times.get(r.scene.as_str())?, r.plan_time_s))).collect();
    if pairs.is_empty() {
        return None;
    }
    let ratio = |picks: &[usize]| {
        let (a, b) = picks.iter().fold((0.0, 0.0), |(a, b), &i| (a + pairs[i].0, b + pairs[i].1));
        a / b
    };
    let all: Vec<usize> = (0..pairs.len()).collect();
    Some(SpeedUp {
        reference: reference.to_owned(),
        scenes: pairs.len(),
        ratio: ratio(&all),
        interval: bootstrap(pairs.len(), seed, stream, ratio),
    })
}

/// The 95 % percentile interval of `statistic` over resampled indices `0..n`.
pub(super) fn bootstrap(
    n: usize,
    seed: u64,
    stream: u64,
    statistic: impl Fn(&[usize]) -> f64,
) -> Interval {
    let mut rng = rng(seed, Stream::Bootstrap, stream);
    let mut picks = vec![0; n];
    let mut values: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            picks.fill_with(|| rng.random_range(0..n));
            statistic(&picks)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    Interval { low: percentile(&values, 0.025), high: percentile(&values, 0.975) }
}

fn mean_time(rows: &[&Row]) -> f64 {
    mean(rows.iter().map(|r| r.plan_time_s)).unwrap_or(f64::INFINITY)
}

pub(super) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (n, sum) = values.fold((0usize, 0.0), |(n, sum), v| (n + 1, sum + v));
    (n > 0).then(|| sum / n as f64)
}

/// The `q` quantile of sorted values, linear between ranks.
pub(super) fn percentile(sorted: &[f64], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    low + (high - low) * at.fract()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::planners::NoPath;

    /// A solved (or failed) row.
    pub fn row(scene: &str, method: &str, plan_time_s: f64, ok: bool) -> Row {
        Row {
            scene: scene.into(),
            kind: Some(ParkingType::Parallel),
            level: Some(Level::Extreme),
            method: method.into(),
            ok,
            reason: if ok { String::new() } else { "budget spent".into() },
            plan_time_s,
            length_m: ok.then_some(20.0),
            direction_changes: ok.then_some(2),
            max_abs_steer_rad: ok.then_some(0.6),
            mean_abs_steer_change_rad: ok.then_some(0.03),
            nodes: 10,
            min_clearance_m: ok.then_some(0.1),
            fallback: false,
            checked: if ok { "ok".into() } else { String::new() },
            route: String::new(),
            cost_over_best: None,
            changes_over_fewest: None,
            way_clearance_m: ok.then_some(0.2),
            set: "home".into(),
        }
    }

    #[test]
    fn quantiles_and_means() {
        let v = [1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!((percentile(&v, 0.5), percentile(&v, 0.95)), (3.0, 4.8));
        let rows: Vec<Row> = (0..10).map(|i| row("s", "n3p", f64::from(i), i != 3)).collect();
        let groups = summarise(&rows, 1);
        let s = &groups[0].summaries[0];
        assert_eq!((s.scenes, s.fail_percent, s.min_t_s, s.mean_t_s), (10, 10.0, 0.0, 4.5));
        assert!(s.mean_t_interval_s.low < 4.5 && 4.5 < s.mean_t_interval_s.high);
        assert!(s.speed_up.is_none());
    }

    #[test]
    fn what_does_not_apply_is_no_failure_and_no_reference() {
        let mut rows: Vec<Row> =
            (0..4).map(|i| row(&format!("s{i}"), "ha-rs", 1.0, true)).collect();
        rows.extend((0..4).map(|i| Row {
            reason: NoPath::NotApplicable.to_string(),
            ..row(&format!("s{i}"), "sha", 1e-6, false)
        }));
        let groups = summarise(&rows, 1);
        let methods: Vec<_> = groups[0].summaries.iter().map(|s| s.method.as_str()).collect();
        assert_eq!(methods, ["ha-rs"]);
        assert!(groups[0].summaries[0].speed_up.is_none());
        assert!(summarise(&rows[4..], 1).is_empty());
    }

    #[test]
    fn the_speed_up_is_paired_against_the_fastest_search() {
        let mut rows = Vec::new();
        for i in 0..20 {
            let (scene, t) = (format!("s{i}"), 1.0 + f64::from(i));
            rows.push(row(&scene, "ha", 10.0 * t, true));
            rows.push(row(&scene, "ha-rs", t, true));
            rows.push(row(&scene, "n3p", t / 100.0, true));
        }
        let groups = summarise(&rows, 1);
        let s = &groups[0].summaries;
        let best = s[2].speed_up.as_ref().unwrap();
        assert_eq!((best.reference.as_str(), best.scenes), ("ha-rs", 20));
        // Every pair has the same ratio, so resampling cannot move it.
        assert!((best.interval.low - 100.0).abs() < 1e-9 && (best.ratio - 100.0).abs() < 1e-9);
        assert!(
            s[1].speed_up.is_none() && (s[0].speed_up.as_ref().unwrap().ratio - 0.1).abs() < 1e-9
        );
        assert_eq!(groups, summarise(&rows, 1), "same seed, same intervals");
    }
}
