//! Home against away: how each method does in scenes like those that models learnt in, and elsewhere.
//!
//! At home are the scenes of the set `home`, of every level; away those of all other sets.

use serde::Serialize;

use super::metrics::{by_method, percentile};
use super::suite::World;
use super::table::{Table, figures};
use crate::episode::Row;
use crate::episode::comparison::{best, measured};
use crate::n3p::Method;
use crate::world::ParkingType;

/// How to read the table.
pub(super) const NOTE: &str = "\
“Home” are the scenes generated as in the paper, of every level, “away” those of all other sets: nothing was trained \
or chosen on them, unless they are of the set wide. “× faster” is the ratio of mean times to that of ha-rs in the \
scenes that both methods apply to, “cost / best” the 95th percentile of the cost over that of the cheapest path of \
any method in the same scene.";

/// What times are held against.
pub const REFERENCE: Method = Method::HA_RS;

/// One method at home or away.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Side {
    /// Scenes it applies to.
    pub scenes: usize,
    /// Those without an accepted path.
    pub failed: usize,
    /// Mean time of [`REFERENCE`] over its own, in the scenes of both; `None` where there are none.
    pub faster: Option<f64>,
    /// 95th percentile of the cost over that of the cheapest path in the scene; `None` without paths.
    pub p95_cost: Option<f64>,
}

/// One method at home and away; a side is `None` where the method applies to no scene there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HomeAndAway {
    /// Name of the method.
    pub method: String,
    /// In the scenes at home.
    pub home: Option<Side>,
    /// In all others.
    pub away: Option<Side>,
}

/// Whether a row is of a scene at home.
fn is_at_home(row: &Row) -> bool {
    row.set == World::Home.name()
}

/// Every method at home and away, in the order of their first rows: of one parking type, or of all. Empty
/// where the run does not have both.
pub fn compare(rows: &[Row], kind: Option<Option<ParkingType>>) -> Vec<HomeAndAway> {
    let best = best(rows);
    let of_kind = rows.iter().filter(|r| r.applies() && kind.is_none_or(|kind| r.kind == kind));
    let (home, away): (Vec<&Row>, Vec<&Row>) = of_kind.partition(|r| is_at_home(r));
    if home.is_empty() || away.is_empty() {
        return Vec::new();
    }
    let sides = [home, away].map(|rows| by_method(&rows));
    let side = |side: usize, method: &str| {
        let rows_of = |name: &str| {
            sides[side].iter().find(|(method, _)| *method == name).map(|(_, rows)| &rows[..])
        };
        let rows = rows_of(method)?;
        let mut costs: Vec<f64> =
            rows.iter().filter_map(|r| measured(r, &best)).map(|(cost, _)| cost).collect();
        costs.sort_by(f64::total_cmp);
        Some(Side {
            scenes: rows.len(),
            failed: rows.iter().filter(|r| !r.ok).count(),
            faster: rows_of(REFERENCE.name()).and_then(|reference| faster(rows, reference)),
            p95_cost: (!costs.is_empty()).then(|| percentile(&costs, 0.95)),
        })
    };
    let is_used = |method: &&str| sides.iter().flatten().any(|(name, _)| name == method);
    let all: Vec<&Row> = rows.iter().collect();
    let methods = by_method(&all).into_iter().map(|(method, _)| method).filter(is_used);
    let line = |method: &str| HomeAndAway {
        method: method.to_owned(),
        home: side(0, method),
        away: side(1, method),
    };
    methods.map(line).collect()
}

/// The ratio of the mean times of two methods in the scenes that both applied to.
fn faster(rows: &[&Row], reference: &[&Row]) -> Option<f64> {
    let times: std::collections::HashMap<&str, f64> =
        reference.iter().map(|r| (r.scene.as_str(), r.plan_time_s)).collect();
    let pairs = rows.iter().filter_map(|r| Some((times.get(&r.scene[..])?, r.plan_time_s)));
    let (theirs, ours) = pairs.fold((0.0, 0.0), |(a, b), (theirs, ours)| (a + theirs, b + ours));
    (ours > 0.0).then(|| theirs / ours)
}

/// The whole comparison in one or two sentences, about our own method, or the last of the run without it.
pub(super) fn sentence(lines: &[HomeAndAway]) -> Option<String> {
    let ours = lines.iter().find(|l| l.method == Method::N3P.name());
    let line = ours.or(lines.last())?;
    let (home, away) = (line.home?, line.away?);
    let mut text = format!("Away from home, {} ", line.method);
    if let (Some(at_home), Some(elsewhere)) = (home.faster, away.faster) {
        text += &format!(
            "is {elsewhere:.1} times as fast as {} (at home {at_home:.1}), and ",
            REFERENCE.name()
        );
    }
    let solved = |side: Side| format!("{} of {}", side.scenes - side.failed, side.scenes);
    text += &format!("solves {} scenes (at home {}).", solved(away), solved(home));
    if let (Some(at_home), Some(elsewhere)) = (home.p95_cost, away.p95_cost) {
        text += &format!(
            " 95 of 100 of its paths cost at most {elsewhere:.2} times the cheapest of any method (at home {at_home:.2})."
        );
    }
    Some(text)
}

/// The comparison as a table.
pub fn table(lines: &[HomeAndAway]) -> Table {
    let cells = |text: &dyn Fn(Side) -> Option<String>, line: &HomeAndAway| {
        [line.home, line.away].map(|side| side.and_then(text).unwrap_or_else(|| "–".to_owned()))
    };
    let row = |line: &HomeAndAway| {
        let faster = cells(&|side| side.faster.map(figures), line);
        let cost = cells(&|side| side.p95_cost.map(|cost| format!("{cost:.3}")), line);
        let failed = cells(&|side| Some(format!("{} of {}", side.failed, side.scenes)), line);
        [line.method.clone()].into_iter().chain(faster).chain(cost).chain(failed).collect()
    };
    let headers = [
        "method",
        "× faster: home",
        "away",
        "cost / best, P95: home",
        "away",
        "failed: home",
        "away",
    ];
    Table {
        title: "Home against away".to_owned(),
        headers: headers.map(str::to_owned).to_vec(),
        rows: lines.iter().map(row).collect(),
        text_columns: 1,
    }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::tests::row;
    use super::*;

    fn in_set(set: &str, method: &str, time: f64, length: f64) -> Row {
        let scene = format!("{set}-scene");
        Row {
            set: set.to_owned(),
            length_m: Some(length),
            direction_changes: Some(0),
            ..row(&scene, method, time, true)
        }
    }

    #[test]
    fn a_hand_counted_run() {
        let mut rows = vec![
            in_set("home", "ha-rs", 0.02, 10.0),
            in_set("home", "n3p", 0.001, 11.0),
            in_set("lots", "ha-rs", 0.02, 20.0),
        ];
        assert_eq!(compare(&rows[..2], None), [], "only home");
        let found = compare(&rows, None);
        assert_eq!((found[1].home.unwrap().faster, found[1].away), (Some(20.0), None));
        assert_eq!(sentence(&found), None, "nothing away to tell of");
        rows.push(in_set("lots", "n3p", 0.01, 20.0));
        rows.push(Row { ok: false, scene: "other".into(), ..in_set("lots", "n3p", 0.05, 20.0) });
        let found = compare(&rows, None);
        let [reference, n3p] = &found[..] else { panic!("{found:?}") };
        assert_eq!((reference.home.unwrap().faster, &n3p.method[..]), (Some(1.0), "n3p"));
        let (home, away) = (n3p.home.unwrap(), n3p.away.unwrap());
        assert_eq!((home.scenes, home.failed, home.p95_cost), (1, 0, Some(1.1)));
        // The scene that ha-rs did not plan in counts for neither.
        assert_eq!((away.scenes, away.failed), (2, 1));
        assert_eq!((away.faster, away.p95_cost), (Some(2.0), Some(1.0)));
        let told = sentence(&found).unwrap();
        assert!(told.contains("2.0 times as fast as ha-rs (at home 20.0)"), "{told}");
        assert!(told.contains("solves 1 of 2 scenes (at home 1 of 1)"), "{told}");
        let expected = ["n3p", "20.00", "2.000", "1.100", "1.000", "0 of 1", "1 of 2"];
        assert_eq!(table(&found).rows[1], expected);
        // Of another type there is nothing.
        assert_eq!(compare(&rows, Some(None)), []);
        // Without the reference quality and failures are still told.
        rows.retain(|r| r.method == "n3p");
        let told = sentence(&compare(&rows, None)).unwrap();
        assert!(told.starts_with("Away from home, n3p solves 1 of 2"), "{told}");
    }
}
