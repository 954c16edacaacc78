//! How good paths are: each held against the best that any method of the run found in the same
//! scene.
//!
//! Costs are those of [`comparison`](crate::episode::comparison). Means of lengths hide the scenes in
//! which a method drives a long way round; ratios per scene show them.

use std::collections::HashMap;

use serde::Serialize;

use super::metrics::{self, percentile};
use super::table::{Table, kind_name, part_name};
use crate::episode::Row;
use crate::episode::comparison::{best, measured};
use crate::world::{Level, ParkingType};

/// How to read the table.
pub(super) const NOTE: &str = "\
The cost of a path is its length and 3 m for every change of direction (costs below 0.1 m count \
as 0.1 m). “Cost / best” divides it by that of the cheapest path of any method of this run in the \
same scene, “changes beyond fewest” counts the changes of direction beyond the fewest there. So \
both say how far a method is from the others, not from the best path there is. Scenes in which \
the method failed are counted and do not enter.";

/// The paths of one method against the best of all methods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodQuality {
    /// Name of the method.
    pub method: String,
    /// Scenes it applies to.
    pub scenes: usize,
    /// Those without an accepted path, which do not enter what follows.
    pub failed: usize,
    /// The others; `None` where there are none.
    pub paths: Option<Paths>,
}

/// Distances from the best.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Paths {
    /// Median of the cost over that of the cheapest path.
    pub median_cost: f64,
    /// Its 95th percentile.
    pub p95_cost: f64,
    /// The largest.
    pub worst_cost: f64,
    /// Mean of the direction changes beyond the fewest.
    pub mean_changes: f64,
    /// Share of scenes with more than one, per cent.
    pub more_than_one_percent: f64,
    /// The most.
    pub most_changes: u32,
}

/// All methods of a run against the best of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Over all scenes, one per method, in the order of the methods' first rows.
    pub all: Vec<MethodQuality>,
    /// By level and type.
    pub groups: Vec<QualityGroup>,
}

/// The methods in the scenes of one set, level and type.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QualityGroup {
    /// The set of scenes.
    pub set: String,
    /// Difficulty; `None` where the set has no levels.
    pub level: Option<Level>,
    /// Parking type, where known.
    #[serde(rename = "type")]
    pub kind: Option<ParkingType>,
    /// One per method, in the order of the methods' first rows.
    pub methods: Vec<MethodQuality>,
}

/// Compares the methods, over all scenes and by level and type. Rows need not be filled.
pub fn summarise(rows: &[Row]) -> Quality {
    let best = best(rows);
    let compared = |methods: &[(&str, Vec<&Row>)]| {
        methods.iter().map(|(name, rows)| quality(name, rows, &best)).collect()
    };
    let group = |g: metrics::Grouped| QualityGroup {
        set: g.set.to_owned(),
        level: g.level,
        kind: g.kind,
        methods: compared(&g.methods),
    };
    let applicable: Vec<&Row> = rows.iter().filter(|r| r.applies()).collect();
    Quality {
        all: compared(&metrics::by_method(&applicable)),
        groups: metrics::grouped(rows).into_iter().map(group).collect(),
    }
}

impl Quality {
    /// Level, type and methods of each part of a table: all scenes first, where there are several
    /// groups.
    pub(super) fn parts(&self) -> impl Iterator<Item = (String, String, &[MethodQuality])> {
        let all = ("all".to_owned(), "all".to_owned(), &self.all[..]);
        let groups = self
            .groups
            .iter()
            .map(|g| (part_name(&g.set, g.level), kind_name(g.kind), &g.methods[..]));
        (groups.len() > 1).then_some(all).into_iter().chain(groups)
    }
}

fn quality(method: &str, rows: &[&Row], best: &HashMap<&str, (f64, u32)>) -> MethodQuality {
    let (mut costs, changes): (Vec<f64>, Vec<u32>) =
        rows.iter().filter_map(|row| measured(row, best)).unzip();
    costs.sort_by(f64::total_cmp);
    let solved = costs.len() as f64;
    let paths = || Paths {
        median_cost: percentile(&costs, 0.5),
        p95_cost: percentile(&costs, 0.95),
        worst_cost: percentile(&costs, 1.0),
        mean_changes: changes.iter().map(|&c| f64::from(c)).sum::<f64>() / solved,
        more_than_one_percent: 100.0 * changes.iter().filter(|&&c| c > 1).count() as f64 / solved,
        most_changes: changes.iter().copied().max().unwrap_or(0),
    };
    MethodQuality {
        method: method.to_owned(),
        scenes: rows.len(),
        failed: rows.len() - costs.len(),
        paths: (!costs.is_empty()).then(paths),
    }
}

/// One line per method, over all and per level and type.
pub fn table(quality: &Quality) -> Table {
    let mut rows = Vec::new();
    for (level, kind, methods) in quality.parts() {
        for m in methods {
            let names = [level.clone(), kind.clone(), m.method.clone()];
            let counts = [m.scenes.to_string(), m.failed.to_string()];
            rows.push(names.into_iter().chain(counts).chain(numbers(m)).collect());
        }
    }
    let headers = [
        "level",
        "type",
        "method",
        "scenes",
        "failed",
        "cost / best: median",
        "P95",
        "worst",
        "changes beyond fewest: mean",
        "> 1 in %",
        "most",
    ];
    Table {
        title: "Quality: paths against the best of this run in the same scene".to_owned(),
        headers: headers.map(str::to_owned).to_vec(),
        rows,
        text_columns: 3,
    }
}

/// Costs over the best, and changes beyond the fewest; dashes where nothing was solved.
pub(super) fn numbers(m: &MethodQuality) -> [String; 6] {
    let Some(p) = m.paths else { return ["–"; 6].map(str::to_owned) };
    [
        format!("{:.3}", p.median_cost),
        format!("{:.3}", p.p95_cost),
        format!("{:.3}", p.worst_cost),
        format!("{:.2}", p.mean_changes),
        format!("{:.1}", p.more_than_one_percent),
        p.most_changes.to_string(),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::metrics::tests::row;
    use super::*;
    use crate::episode::fill;
    use crate::planners::NoPath;
    use crate::rng::{Stream, rng};
    use rand::RngExt;
    use rand::seq::SliceRandom;

    fn driven(scene: &str, method: &str, length: f64, changes: u32) -> Row {
        let (length_m, direction_changes) = (Some(length), Some(changes));
        Row { length_m, direction_changes, ..row(scene, method, 1e-3, true) }
    }

    #[test]
    fn a_hand_counted_run() {
        let rejected = Row { ok: false, ..driven("b", "n3p", 1.0, 0) };
        let does_not_apply =
            Row { reason: NoPath::NotApplicable.to_string(), ..row("a", "sha", 1e-3, false) };
        let mut rows = [
            driven("a", "ha-rs", 20.0, 0),
            driven("a", "n3p", 10.0, 2), // 16: the cheapest, with more changes.
            does_not_apply,
            driven("b", "ha-rs", 12.0, 3),
            rejected, // Neither enters nor is the best.
        ];
        fill(&mut rows);
        let columns: Vec<_> =
            rows.iter().map(|r| (r.cost_over_best, r.changes_over_fewest)).collect();
        let expected = [
            (Some(1.25), Some(0)),
            (Some(1.0), Some(2)),
            (None, None),
            (Some(1.0), Some(0)),
            (None, None),
        ];
        assert_eq!(columns, expected);
        let found = summarise(&rows);
        let [ha, n3p] = &found.all[..] else { panic!("{found:?}") };
        assert_eq!(found.groups[0].methods, found.all, "one group");
        assert_eq!((ha.scenes, ha.failed, n3p.scenes, n3p.failed), (2, 0, 2, 1));
        let (ha, n3p) = (ha.paths.unwrap(), n3p.paths.unwrap());
        assert_eq!((ha.median_cost, ha.worst_cost, ha.most_changes), (1.125, 1.25, 0));
        assert_eq!((n3p.worst_cost, n3p.mean_changes, n3p.most_changes), (1.0, 2.0, 2));
        assert_eq!((ha.more_than_one_percent, n3p.more_than_one_percent), (0.0, 100.0));
        assert_eq!(table(&found).rows[1][..6], ["extreme", "parallel", "n3p", "2", "1", "1.000"]);
        rows[0].level = None;
        assert_eq!(table(&summarise(&rows)).rows[0][..4], ["all", "all", "ha-rs", "2"]);
    }

    #[test]
    fn a_way_of_no_length_gives_no_nan() {
        let mut rows = [driven("a", "ha-rs", 0.0, 0), driven("a", "n3p", 1.0, 0)];
        fill(&mut rows);
        assert_eq!([rows[0].cost_over_best, rows[1].cost_over_best], [Some(1.0), Some(10.0)]);
    }

    #[test]
    fn where_all_fail_there_are_no_numbers() {
        let mut rows = [row("a", "ha-rs", 1.0, false), row("b", "ha-rs", 1.0, false)];
        fill(&mut rows);
        assert!(rows.iter().all(|r| r.cost_over_best.is_none()));
        let found = summarise(&rows);
        assert_eq!((found.all[0].failed, found.all[0].paths), (2, None));
        assert_eq!(table(&found).rows[0][5..], ["–"; 6]);
        assert!(table(&summarise(&[])).rows.is_empty());
    }

    /// In every scene somebody is the best, nobody is better, and rows may come in any order.
    #[test]
    fn laws_of_random_runs() {
        for seed in 0..20 {
            let mut rng = rng(seed, Stream::Scene, 0);
            let mut rows = Vec::new();
            for scene in 0..30 {
                for method in ["ha", "ha-rs", "n3p"] {
                    let scene = format!("s{scene}");
                    let (length, changes) = (rng.random_range(0.0..30.0), rng.random_range(0..6));
                    rows.push(Row {
                        ok: rng.random_bool(0.8),
                        ..driven(&scene, method, length, changes)
                    });
                }
            }
            fill(&mut rows);
            for of_scene in rows.chunks(3).filter(|c| c.iter().any(|r| r.ok)) {
                let costs = || of_scene.iter().filter_map(|r| r.cost_over_best);
                assert_eq!(costs().fold(f64::INFINITY, f64::min), 1.0, "seed {seed}");
                assert_eq!(of_scene.iter().filter_map(|r| r.changes_over_fewest).min(), Some(0));
                assert_eq!(costs().count(), of_scene.iter().filter(|r| r.ok).count());
            }
            let by_name = |rows: &[Row]| {
                let mut methods = summarise(rows).all;
                methods.sort_by(|a, b| a.method.cmp(&b.method));
                methods
            };
            let (filled, groups) = (rows.clone(), by_name(&rows));
            rows.shuffle(&mut rng);
            assert_eq!(by_name(&rows), groups, "seed {seed}");
            fill(&mut rows);
            assert!(rows.iter().all(|r| filled.contains(r)), "seed {seed}");
        }
    }
}
