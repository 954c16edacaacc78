//! What more data gives: N3P's outcome with models from parts of a data set.

use serde::{Deserialize, Serialize};

use super::table::{Table, figures};
use crate::episode::Row;
use crate::world::ParkingType;
use crate::world::cell::Grid;

/// One method on the scenes of one type, with models from one part of the data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// The parking type.
    #[serde(rename = "type")]
    pub kind: ParkingType,
    /// Name of the method.
    pub method: String,
    /// Distance between lane widths of the part's grid, metres.
    pub lane_step_m: f64,
    /// Distance between its spot widths, metres.
    pub spot_step_m: f64,
    /// Distance between its dead ends, metres.
    pub dead_end_step_m: f64,
    /// Samples of each cell.
    pub samples_per_cell: u32,
    /// Solved samples of the type in the part.
    pub samples: usize,
    /// Scenes planned in.
    pub scenes: usize,
    /// Those without an accepted path.
    pub failures: usize,
    /// Those planned without any search.
    pub without_search: usize,
    /// Those that took a full search after all.
    pub full_search: usize,
    /// Mean node expansions.
    pub mean_nodes: f64,
    /// Mean length of the solved, metres; `None` where none is.
    pub mean_length_m: Option<f64>,
    /// Their mean direction changes.
    pub mean_direction_changes: Option<f64>,
    /// Mean planning time, seconds.
    pub mean_plan_time_s: f64,
}

/// The part of a data set that models were trained from.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// Its grid.
    pub grid: &'a Grid,
    /// Samples of each cell.
    pub samples_per_cell: u32,
    /// Solved samples of the type.
    pub samples: usize,
}

impl CurvePoint {
    /// The point of `rows`, which are `method`'s on scenes of type `kind`, at least one.
    pub fn new(part: Part, kind: ParkingType, method: &str, rows: &[&Row]) -> Self {
        let count = |is: &dyn Fn(&Row) -> bool| rows.iter().filter(|r| is(r)).count();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let of_paths = |value: fn(&Row) -> Option<f64>| {
            let values: Vec<f64> = rows.iter().filter(|r| r.ok).filter_map(|r| value(r)).collect();
            (!values.is_empty()).then(|| mean(values))
        };
        Self {
            kind,
            method: method.to_owned(),
            lane_step_m: part.grid.lane_width.step,
            spot_step_m: part.grid.spot_width(kind).step,
            dead_end_step_m: part.grid.dead_end.step,
            samples_per_cell: part.samples_per_cell,
            samples: part.samples,
            scenes: rows.len(),
            failures: count(&|r| !r.ok),
            without_search: count(&|r| r.route == "library" || r.route == "direct"),
            full_search: count(&|r| r.fallback),
            mean_nodes: mean(rows.iter().map(|r| f64::from(r.nodes)).collect()),
            mean_length_m: of_paths(|r| r.length_m),
            mean_direction_changes: of_paths(|r| r.direction_changes.map(f64::from)),
            mean_plan_time_s: mean(rows.iter().map(|r| r.plan_time_s).collect()),
        }
    }

    /// Share of scenes planned without any search, per cent.
    pub fn without_search_percent(&self) -> f64 {
        100.0 * self.without_search as f64 / self.scenes as f64
    }

    /// The grid's steps for people, metres.
    pub fn steps(&self) -> String {
        let shown = [self.lane_step_m, self.spot_step_m, self.dead_end_step_m];
        // Steps are products of decimals: 0.30000000000000004 is 0.3.
        shown.map(|s| format!("{}", (s * 1e6).round() / 1e6)).join(" / ")
    }
}

/// All points, type by type and method by method, in the order of the parts.
pub fn table(points: &[CurvePoint]) -> Table {
    let maybe = |v: Option<f64>| v.map_or("–".to_owned(), |v| format!("{v:.2}"));
    let mut sorted: Vec<&CurvePoint> = points.iter().collect();
    sorted.sort_by_key(|p| (p.kind.name(), &p.method));
    let line = |p: &CurvePoint| {
        vec![
            p.kind.to_string(),
            p.method.clone(),
            p.steps(),
            p.samples_per_cell.to_string(),
            p.samples.to_string(),
            p.failures.to_string(),
            format!("{:.1}", p.without_search_percent()),
            format!("{:.1}", 100.0 * p.full_search as f64 / p.scenes as f64),
            format!("{:.1}", p.mean_nodes),
            figures(p.mean_plan_time_s * 1e3),
            maybe(p.mean_length_m),
            maybe(p.mean_direction_changes),
        ]
    };
    let headers = [
        "type",
        "method",
        "grid steps (lane / spot / dead end)",
        "per cell",
        "samples",
        "failures",
        "no search %",
        "full search %",
        "N_node",
        "mean T",
        "length",
        "N_dc",
    ];
    Table {
        title: "Learning curve: steps and length in m, T in ms".to_owned(),
        headers: headers.map(str::to_owned).to_vec(),
        rows: sorted.into_iter().map(line).collect(),
        text_columns: 3,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::metrics::tests::row;
    use super::*;

    /// A point with `samples`, every second of whose ten scenes took a search.
    pub fn point(method: &str, samples: usize) -> CurvePoint {
        let rows: Vec<Row> = (0..10)
            .map(|i| {
                let route = if i % 2 == 0 { "direct" } else { "searched" };
                Row { route: route.to_owned(), ..row(&format!("s{i}"), method, 1e-4, i > 0) }
            })
            .collect();
        let part = Part { grid: &Grid::default(), samples_per_cell: 5, samples };
        CurvePoint::new(part, ParkingType::Reverse, method, &rows.iter().collect::<Vec<_>>())
    }

    #[test]
    fn counts_routes_and_failures_and_goes_round() {
        let points = [point("knn-n3p", 100), point("n3p", 1000)];
        assert_eq!((points[0].without_search, points[0].failures), (5, 1));
        assert_eq!(points[0].steps(), "0.5 / 0.25 / 1");
        let json = serde_json::to_string(&points).unwrap();
        assert_eq!(serde_json::from_str::<Vec<CurvePoint>>(&json).unwrap(), points);
        let text = table(&points).text();
        assert!(text.contains("0.5 / 0.25 / 1") && text.contains("50.0"), "{text}");
    }
}
