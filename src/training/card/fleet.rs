//! The card of a model for any vehicle.

use std::fmt::Write;
use std::path::Path;

use super::{VERSION, name};
use crate::training::fleet::FleetLog;

/// The card of the fleet model in `out`.
pub(in crate::training) fn fleet(out: &Path, log: &FleetLog) -> String {
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
    for (kind, samples, manoeuvres) in &log.kinds {
        let _ = writeln!(kinds, "| {kind} | {samples} | {manoeuvres} |");
    }
    format!(
        "\
# Model card: {file}

Manoeuvres into parking spots in units of the turning radius, for any vehicle. Written by n3p {VERSION}.

## What it is for

The planner `n3p` scales them to the vehicle at hand, and tries the most promising in the scene with the
vehicle's own footprint, exactly; where none fits it searches. The model is no planner and no
controller, and it knows no preparatory poses, so `knn-n3p` and `mlp-n3p` have no use for it.

## Limits

- **No guarantee that one fits**: a vehicle of other proportions than those below may need a search
  more often. Its path is checked all the same.
- Taken from this planner's own solutions in free space that is two rectangles, not from drivers.

## Learnt from

Metres and radians; the last column begins the SHA-256 of the vehicle's data set.

| length | width | wheelbase | rear overhang | steering limit | turning radius | data |
|--:|--:|--:|--:|--:|--:|---|
{vehicles}
| type | solved samples | manoeuvres |
|---|--:|--:|
{kinds}",
        file = name(out),
    )
}
