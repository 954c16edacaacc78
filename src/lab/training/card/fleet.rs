//! The card of a model for any vehicle.

use std::fmt::Write;
use std::path::Path;

use super::{VERSION, in_worlds, metrics, name};
use crate::lab::training::fleet::FleetLog;
use crate::selectors::UNIT_NAMES;
use crate::selectors::fleet::UNIT_LAYERS;

/// The card of the fleet model in `out`.
pub(in crate::lab::training) fn fleet(out: &Path, log: &FleetLog) -> String {
    let (mut vehicles, mut kinds) = (String::new(), String::new());
    for (v, sha256) in log.fleet.iter().zip(&log.data_sha256) {
        let _ = writeln!(
            vehicles,
            "| {:.2} | {:.2} | {:.2} | {:.2} | {:.3} | {:.2} | `{}…` |",
            v.length,
            v.width,
            v.wheelbase,
            v.rear_overhang,
            v.max_steer,
            v.turning_radius(),
            &sha256[..12],
        );
    }
    let mut rows = Vec::new();
    for k in &log.kinds {
        let (kind, best) = (k.kind, k.best_epoch);
        let counts = [k.samples, k.manoeuvres, k.train_rows].map(|n| n.to_string()).join(" | ");
        let curve = out.with_extension(format!("{kind}.training.svg"));
        let curve = curve.file_name().unwrap_or_default().to_string_lossy();
        let epochs = format!("{best} of {} ([losses](<{curve}>))", k.losses.len());
        let _ = writeln!(kinds, "| {kind} | {counts} | {epochs} |");
        rows.push((kind, k.validation_rows, k.validation, k.reach));
    }
    let learnt = in_worlds(&log.worlds);
    let settings = toml::to_string(&log.config).expect("settings are plain data");
    let layers = UNIT_LAYERS.map(|width| width.to_string()).join(" → ");
    let inputs = UNIT_NAMES.map(|name| format!("`{name}`")).join(", ");
    let metrics = metrics(&rows);
    format!(
        "\
# Model card: {file}

Manoeuvres into parking spots and networks that propose preparatory poses, for any vehicle: all
lengths are in turning radii of the vehicle at hand. Written by n3p {VERSION}.

## What it is for

The planner `n3p` scales the manoeuvres to the vehicle, and tries the most promising in the scene with its
own footprint, exactly; where none fits it asks the network, and then searches. `mlp-n3p` drives to the
network's pose. The model is no planner and no controller.

For each parking type a network, {layers} with ReLU between layers, from
{inputs}
(lengths in turning radii) to x, y, cos θ, sin θ of the pose.

## Limits

- **No guarantee that one fits**: a vehicle of other proportions than those below may need a search
  more often. Its path is checked all the same.
- Taken from this planner's own solutions in free space that is two rectangles, manoeuvres also from
  those in generated scenes, each for one of the vehicles in turn; not from drivers.

## Learnt from

Metres and radians; the last column begins the SHA-256 of the vehicle's data set.

| length | width | wheelbase | rear overhang | steering limit | turning radius | data |
|--:|--:|--:|--:|--:|--:|---|
{vehicles}
| type | solved samples | manoeuvres | rows the network learnt | epoch kept |
|---|--:|--:|--:|---|
{kinds}
{learnt} Settings of the networks, as a file for `n3p-train fleet --config FILE`:

```toml
{settings}```

## How good the networks are

For rows of the same vehicles kept apart from learning; how well they serve other vehicles is measured
in docs/vehicles.md. *Wanted* is the pose that the network was to learn.

{metrics}",
        file = name(out),
    )
}
