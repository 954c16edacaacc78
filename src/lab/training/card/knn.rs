//! The card of a `knn.bin`.

use std::fmt::Write;
use std::path::Path;

use super::{INPUTS, VERSION, data, in_worlds, metrics, name, spots, vehicle};
use crate::lab::dataset::Metadata;
use crate::lab::training::knn::{KnnKindLog, KnnLog};

/// The card of the `knn.bin` in `out`.
pub(in crate::lab::training) fn knn(out: &Path, metadata: &Metadata, log: &KnnLog) -> String {
    let (file, vehicle) = (name(out), vehicle(metadata));
    let (bytes, mebibytes) = (log.bytes, log.bytes as f64 / f64::from(1 << 20));
    let kinds: Vec<&str> = log.kinds.iter().map(|k| spots(k.kind)).collect();
    let spots = kinds.join(", ");
    let solved = |k: &KnnKindLog| k.solved.unwrap_or(k.samples);
    let rows: Vec<_> = log.kinds.iter().map(|k| (k.kind, k.rows, solved(k))).collect();
    let data = data(metadata, &log.data_sha256, &rows);
    let radius = log.heading_radius;
    let mut stored = String::new();
    for k in &log.kinds {
        let (kind, samples, manoeuvres) = (k.kind, k.samples, k.manoeuvres);
        let (occupied, cells) = (k.occupied_cells, k.cells);
        let _ = writeln!(stored, "| {kind} | {samples} | {occupied} of {cells} | {manoeuvres} |");
    }
    let rows = match log.kinds.iter().any(|k| k.solved.is_some()) {
        true => "The first solved rows of each cell",
        false => "Every solved row",
    };
    let learnt = in_worlds(&log.worlds);
    let judged =
        |k: &KnnKindLog| k.leave_one_out.map(|l| (k.kind, l.reach.rows, l.errors, l.reach));
    let metrics = metrics(&log.kinds.iter().filter_map(judged).collect::<Vec<_>>());
    format!(
        "\
# Model card: {file}

Solved parking problems, to be looked up by the nearest start: each answers with its *preparatory
pose*, where the car is to stand before the last Reeds-Shepp curve takes it into the spot. Beside
them a library of manoeuvres. For {spots}. Written by
n3p {VERSION}.

## What it is for

The planner `knn-n3p` asks for one preparatory pose and drives there first. The planner `n3p` tries the
manoeuvres, and asks for several poses where none fits. Both check every path in the scene and search where
nothing stored helps. The model is no planner and no controller: it sees neither obstacles nor
anything else outside of the cell.

{INPUTS}
| out | unit | |
|---|---|---|
| x, y, θ | m, m, rad | the preparatory poses of the nearest samples, nearest first |
| curvature, length | 1/m, m | the motions of each manoeuvre, in driving order, ending at the parked pose; negative lengths are driven backward |

Neighbours are samples of the same cell, or, where it has none, of the nearest smaller cell. Starts
are compared as points (x, y, r·cos θ, r·sin θ) with r = {radius:.4} m: half the turning radius.

## Limits

- **Into the spot: free by construction.** Each pose has a Reeds-Shepp curve (and a straight) into the spot
  that is free in its cell, hence in every scene whose free space contains the cell.
- **To the pose: no guarantee.** The way from the start to the pose may take a search.
- **Manoeuvres are not bound to cells**: they end at the parked pose, but are free only where the
  planner finds them so.
- **One vehicle**: {vehicle}. It serves
  vehicles that this one covers, too (docs/vehicles.md); for any other the model is refused.
- **Cells of the grid below.** Smaller spots, lanes and dead ends have no cell, hence no answer.
- Taken from this planner's own solutions in free space that is two rectangles, manoeuvres also from
  those in generated scenes; not from drivers.

{data}
## What is stored

{rows}, and manoeuvres: {bytes} bytes ({mebibytes:.2} MiB). {learnt}

| type | samples | cells with samples | manoeuvres |
|---|--:|--:|--:|
{stored}
## How good it is

Leave one out: stored starts, evenly spread, are asked for as if they were not stored; the nearest
*other* sample of the cell answers. *Wanted* is the sample's own pose. Where several poses are equally
good, neighbours may disagree by metres and both be right, so the second table counts for more.

{metrics}"
    )
}
