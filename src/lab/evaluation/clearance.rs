//! How much room plans leave on their way, by level, type and method.
//!
//! The least distance from obstacles along a whole path is mostly that of its start or of its goal,
//! which are given. What a method decides is the way between.

use super::metrics::{self, percentile};
use super::table::{Table, kind_name, part_name};
use crate::episode::Row;

/// How to read the table.
pub(super) const NOTE: &str = "\
The smallest distance from obstacles from 1 m after the start to 1 m before the goal (for the default \
vehicle, for others in proportion to their length), and along the whole path: medians over the solved \
scenes.";

/// One line per method and per level and type; empty where no row has a clearance on the way.
pub fn table(rows: &[Row]) -> Table {
    let mut lines = Vec::new();
    for group in metrics::grouped(rows) {
        let level = part_name(group.set, group.level);
        for (method, rows) in group.methods {
            let median = |clearance: fn(&Row) -> Option<f64>| {
                let solved = rows.iter().filter(|r| r.ok);
                let mut values: Vec<f64> = solved.filter_map(|r| clearance(r)).collect();
                values.sort_by(f64::total_cmp);
                (!values.is_empty()).then(|| percentile(&values, 0.5))
            };
            let medians = [median(|r| r.way_clearance_m), median(|r| r.min_clearance_m)];
            if medians[0].is_some() {
                let names = [level.clone(), kind_name(group.kind), method.to_owned()];
                let numbers = medians.map(|m| m.map_or("–".to_owned(), |m| format!("{m:.3}")));
                lines.push(names.into_iter().chain(numbers).collect());
            }
        }
    }
    let headers = ["level", "type", "method", "on the way", "whole path"];
    Table {
        title: "Clearance: median of the smallest distance from obstacles in m".to_owned(),
        headers: headers.map(str::to_owned).to_vec(),
        rows: lines,
        text_columns: 3,
    }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::tests::row;
    use super::*;

    #[test]
    fn medians_are_those_of_solved_scenes_that_have_a_way() {
        let way =
            |scene: &str, way_clearance_m| Row { way_clearance_m, ..row(scene, "n3p", 1.0, true) };
        let mut rows = vec![
            way("a", Some(0.1)),
            way("b", Some(0.3)),
            way("c", Some(0.7)),
            way("d", None),
            Row { ok: false, ..way("e", Some(9.0)) },
        ];
        assert_eq!(table(&rows).rows, [["extreme", "parallel", "n3p", "0.300", "0.100"]]);
        rows.iter_mut().for_each(|r| r.way_clearance_m = None);
        assert!(table(&rows).rows.is_empty());
    }
}
