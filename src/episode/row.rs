//! The record of one method on one scene, what every table is made of.

use serde::{Deserialize, Serialize};

use crate::planners::NoPath;
use crate::world::{Level, ParkingType};

/// The result of one method on one scene. Columns that describe a path are empty where
/// there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the scene.
    pub scene: String,
    /// Its parking type, where known.
    #[serde(rename = "type")]
    pub kind: Option<ParkingType>,
    /// Its difficulty, for generated scenes.
    pub level: Option<Level>,
    /// Name of the method.
    pub method: String,
    /// Whether there is a path and the independent check accepts it.
    pub ok: bool,
    /// Why not; empty when `ok`.
    pub reason: String,
    /// From the obstacle points in hand to the certified path, seconds.
    pub plan_time_s: f64,
    /// Driven length, metres.
    pub length_m: Option<f64>,
    /// Gear changes along the way.
    pub direction_changes: Option<u32>,
    /// Largest |δ|, radians.
    pub max_abs_steer_rad: Option<f64>,
    /// Mean |δ(t + 0.1 s) − δ(t)|, radians.
    pub mean_abs_steer_change_rad: Option<f64>,
    /// Node expansions.
    pub nodes: u32,
    /// Smallest distance to an obstacle, metres; empty without obstacles too.
    pub min_clearance_m: Option<f64>,
    /// Whether a guided planner had to search the whole way after all.
    pub fallback: bool,
    /// Verdict of the independent check: `ok`, the violation, or empty without a path; `certified`
    /// where nobody but the planner has looked.
    pub checked: String,
    /// How a guided planner came to its path: `library`, `direct`, `searched`, `fallback`, `no-lane`,
    /// `no-spot`.
    pub route: String,
    /// Cost of the path over that of the cheapest in the scene: [`fill`](super::fill) writes this and
    /// the next once a run is complete.
    pub cost_over_best: Option<f64>,
    /// Gear changes beyond the fewest of any method in the scene.
    pub changes_over_fewest: Option<u32>,
    /// Smallest distance to an obstacle on the way, from 1 m after the start to 1 m before the goal
    /// (for the default vehicle), metres; empty without obstacles, and where the path is shorter.
    pub way_clearance_m: Option<f64>,
    /// The set of scenes it belongs to, as in [`Case`](super::Case).
    pub set: String,
}

impl Row {
    /// Names of the columns, in order.
    pub const COLUMNS: [&'static str; 20] = [
        "scene",
        "type",
        "level",
        "method",
        "ok",
        "reason",
        "plan_time_s",
        "length_m",
        "direction_changes",
        "max_abs_steer_rad",
        "mean_abs_steer_change_rad",
        "nodes",
        "min_clearance_m",
        "fallback",
        "checked",
        "route",
        "cost_over_best",
        "changes_over_fewest",
        "way_clearance_m",
        "set",
    ];

    /// How many columns at the end were added to the format later, as many at once: files of before
    /// are without them.
    pub(crate) const ADDED: [usize; 3] = [2, 1, 1];

    /// The columns that files of before may be without.
    pub fn added() -> &'static [&'static str] {
        &Self::COLUMNS[Self::COLUMNS.len() - Self::ADDED.iter().sum::<usize>()..]
    }

    /// Whether the method is made for such scenes. Rows of one that is not are kept, but they
    /// are no failures and enter no table.
    pub fn applies(&self) -> bool {
        self.reason != NoPath::NotApplicable.to_string()
    }

    /// Whether the independent check refused the path.
    pub fn is_rejected(&self) -> bool {
        !self.ok && !self.checked.is_empty()
    }

    /// Why it failed, with the check's own words; empty when `ok`.
    pub fn why(&self) -> String {
        if self.is_rejected() {
            format!("{}: {}", self.reason, self.checked)
        } else {
            self.reason.clone()
        }
    }

    /// Scene and method, which no two rows of a run share.
    pub fn key(&self) -> (&str, &str) {
        (&self.scene, &self.method)
    }

    /// This row without its time: what must be the same in every run.
    pub fn untimed(&self) -> Row {
        Row { plan_time_s: 0.0, ..self.clone() }
    }

    /// The values as text, in the order of [`Row::COLUMNS`].
    pub fn fields(&self) -> [String; 20] {
        fn text<T: ToString>(v: &Option<T>) -> String {
            v.as_ref().map(T::to_string).unwrap_or_default()
        }
        [
            self.scene.clone(),
            text(&self.kind),
            text(&self.level),
            self.method.clone(),
            self.ok.to_string(),
            self.reason.clone(),
            self.plan_time_s.to_string(),
            text(&self.length_m),
            text(&self.direction_changes),
            text(&self.max_abs_steer_rad),
            text(&self.mean_abs_steer_change_rad),
            self.nodes.to_string(),
            text(&self.min_clearance_m),
            self.fallback.to_string(),
            self.checked.clone(),
            self.route.clone(),
            text(&self.cost_over_best),
            text(&self.changes_over_fewest),
            text(&self.way_clearance_m),
            self.set.clone(),
        ]
    }

    /// The row as one line of CSV, line break included.
    pub fn to_csv(&self) -> String {
        self.fields().map(|f| quoted(&f)).join(",") + "\n"
    }
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\"").replace('\n', " "))
    } else {
        field.to_owned()
    }
}
