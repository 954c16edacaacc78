//! The card of a data set: what it is, where it comes from, what is in it and what is not, in Markdown.
//!
//! It says nothing of the day, the machine, the build or the folder, so that the same settings give the same bytes.

use std::fmt::Write;

use super::summary::Counts;
use super::{Metadata, Status, Summary};
use crate::world::ParkingType;
use crate::world::cell::Axis;

pub(in crate::lab) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The card of a data set.
pub fn card(set: &Summary) -> String {
    let kinds: Vec<ParkingType> =
        ParkingType::ALL.into_iter().filter(|kind| set.kinds.contains_key(kind)).collect();
    let rows: Vec<_> = kinds
        .iter()
        .map(|kind| (*kind, set.kinds[kind].rows() as usize, set.kinds[kind].solved() as usize))
        .collect();
    let (mut ends, mut paths) = (String::new(), String::new());
    for kind in &kinds {
        let tally = &set.kinds[kind];
        let counts = tally.statuses.map(|count| count.to_string()).join(" | ");
        let _ = writeln!(ends, "| {kind} | {counts} |");
        let quantiles = |counts: &Counts| {
            let at = |share| counts.quantile(share).map_or("–".to_owned(), |v| format!("{v:.1}"));
            [0.05, 0.5, 0.95].map(at).join(" / ")
        };
        let columns =
            [&tally.start_x, &tally.path_length, &tally.direction_changes, &tally.expansions];
        let _ = writeln!(paths, "| {kind} | {} |", columns.map(quantiles).join(" | "));
    }
    let statuses = Status::ALL.map(|status| format!("`{}`", status.name())).join(" | ");
    let kinds: Vec<&str> = kinds.iter().map(|kind| spots(*kind)).collect();
    format!(
        "\
# Data card

Reeds-Shepp start poses of solved parking problems in abstracted environments: for {kinds}.
Written by n3p {VERSION}; the columns are in docs/formats.md.

## What it is for

Preparatory poses and manoeuvres are learnt from it (`n3p-train`). Every row is a start in a cell, two rectangles of free
space, and how the path from there ends. Failed rows stay, so that coverage can be seen.

## Limits

- For one vehicle: {vehicle}.
- Taken from this planner's own solutions, not from drivers. Environments are two empty rectangles: nothing
  stands slanted, nothing protrudes.
- The rows of a cell share their environment; keep whole cells apart to ask how well something learnt carries over.

{data}
## How the rows ended

| type | {statuses} |
|---|--:|--:|--:|--:|--:|--:|
{ends}
Of the solved ones, 5 % / median / 95 %:

| type | start x, m | path, m | changes of direction | expansions |
|---|---|---|---|---|
{paths}",
        kinds = kinds.join(", "),
        vehicle = vehicle(&set.metadata),
        data = data(&set.metadata, &set.sha256, &rows),
    )
}

/// Provenance of the data and the grid. `rows`: all and solved ones of each type.
pub(in crate::lab) fn data(
    metadata: &Metadata,
    sha256: &str,
    rows: &[(ParkingType, usize, usize)],
) -> String {
    let m = metadata;
    let mut counts = String::new();
    for &(kind, all, solved) in rows {
        let share = percent(solved as f64 / all as f64);
        let cells = m.grid.cell_count(kind);
        let _ = writeln!(counts, "| {kind} | {cells} | {all} | {solved} ({share}) |");
    }
    let mut axes = String::new();
    let mut axis = |name: &str, axis: &Axis| {
        let last = axis.value(axis.len() - 1);
        let [min, max, step] = [axis.min, last, axis.step].map(number);
        let _ = writeln!(axes, "| {name} | {min} | {max} | {step} |");
    };
    let mut depths = Vec::new();
    axis("lane width", &m.grid.lane_width);
    for (is_bay, spots) in [(true, "bays"), (false, "parallel spots")] {
        let Some((kind, ..)) = rows.iter().find(|r| r.0.is_bay() == is_bay) else { continue };
        axis(&format!("spot width, {spots}"), m.grid.spot_width(*kind));
        depths.push(format!("{spots} are {} m deep", number(m.grid.depth(*kind))));
    }
    axis("dead end", &m.grid.dead_end);
    let slants = match rows.iter().any(|r| r.0 == ParkingType::Angled) {
        true => {
            let Axis { min, max, step } = m.grid.slant_deg;
            format!(
                "Angled bays: at {min}° to {max}° from the direction of travel to the way out by \
                 {step}°, 90° left out, tail in\nand nose in; their dead end is the way from the \
                 middle of the spot's mouth.\n"
            )
        }
        false => String::new(),
    };
    let (back, depths) = (number(m.grid.back), depths.join(", "));
    let [behind, turn] = [m.start_behind, m.start_heading_max.to_degrees()].map(number);
    format!(
        "\
## Data

| | |
|---|---|
| SHA-256 of settings and rows (`data_sha256`) | `{sha256}` |
| Seed | {seed} |
| Starts | {per_cell} in each cell's lane and up to {behind} m behind it, headings within ±{turn}° |
| Solved by | Hybrid A* with at most {budget} expansions, the cheapest of up to {solutions} solutions |

| type | cells | rows | solved |
|---|--:|--:|--:|
{counts}
The grid of cells:

| metres | from | to | step |
|---|--:|--:|--:|
{axes}
A cell's lane reaches {back} m back from the spot's centre; {depths}. The largest dead end also
stands for none at all.
{slants}",
        seed = m.seed,
        per_cell = m.samples_per_cell,
        budget = m.max_expansions,
        solutions = m.solutions,
    )
}

/// Its vehicle in words.
pub(in crate::lab) fn vehicle(metadata: &Metadata) -> String {
    let v = &metadata.vehicle;
    let sizes = [v.length, v.width, v.wheelbase, v.rear_overhang];
    let [length, width, wheelbase, overhang] = sizes.map(number);
    let (steer, degrees) = (v.max_steer, v.max_steer.to_degrees());
    format!(
        "{length} m long, {width} m wide, wheelbase {wheelbase} m, rear overhang {overhang} m,\n  \
         steering up to {steer:.4} rad ({degrees:.1}°)"
    )
}

/// A parking type in words.
pub(in crate::lab) fn spots(kind: ParkingType) -> &'static str {
    match kind {
        ParkingType::Forward => "forward bays (nose in)",
        ParkingType::Reverse => "reverse bays (tail in)",
        ParkingType::Parallel => "parallel spots",
        ParkingType::Angled => "angled bays (30° to 150°, nose in or tail in)",
    }
}

/// A share in percent.
pub(in crate::lab) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// A number without the noise of its last digits.
pub(in crate::lab) fn number(v: f64) -> String {
    ((v * 1e6).round() / 1e6).to_string()
}
