//! Rows of one scene held against each other.
//!
//! The cost of a path is its length and [`CHANGE_M`] for every change of direction.

use std::collections::HashMap;

use super::Row;

/// What a change of direction costs, in metres of driving; for vehicles of any size.
pub const CHANGE_M: f64 = 3.0;

/// Costs below this count as this, metres: where the best path is no path at all (start = goal),
/// ratios stay finite.
pub const FLOOR_M: f64 = 0.1;

/// Length and direction changes of an accepted path.
fn path(row: &Row) -> Option<(f64, u32)> {
    Some((row.length_m?, row.direction_changes?)).filter(|_| row.ok)
}

fn cost(length_m: f64, changes: u32) -> f64 {
    (length_m + CHANGE_M * f64::from(changes)).max(FLOOR_M)
}

/// Least cost and fewest changes of each scene that any method solved. They may be of two paths.
pub(crate) fn best(rows: &[Row]) -> HashMap<&str, (f64, u32)> {
    let mut best = HashMap::new();
    for row in rows {
        let Some((length, changes)) = path(row) else { continue };
        let (least, fewest) = best.entry(row.scene.as_str()).or_insert((f64::INFINITY, u32::MAX));
        *least = cost(length, changes).min(*least);
        *fewest = changes.min(*fewest);
    }
    best
}

/// Cost over the least of the scene, and direction changes beyond the fewest; `None` without an
/// accepted path.
pub(crate) fn measured(row: &Row, best: &HashMap<&str, (f64, u32)>) -> Option<(f64, u32)> {
    let (length, changes) = path(row)?;
    let (least, fewest) = best[row.scene.as_str()];
    Some((cost(length, changes) / least, changes - fewest))
}

/// Fills the columns of all rows that compare them: the rows of a run, complete.
pub fn fill(rows: &mut [Row]) {
    let best = best(rows);
    let values: Vec<_> = rows.iter().map(|row| measured(row, &best)).collect();
    for (row, value) in rows.iter_mut().zip(values) {
        (row.cost_over_best, row.changes_over_fewest) = value.unzip();
    }
}
