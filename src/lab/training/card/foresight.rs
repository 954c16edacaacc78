//! The card of foresight.

use std::fmt::Write;
use std::path::Path;

use super::{VERSION, name, percent};
use crate::lab::training::foresight::ForesightLog;
use crate::selectors::foresight::{MANOEUVRE_LAYERS, SCENE_LAYERS};

/// The card of the network in `out`.
pub(in crate::lab::training) fn foresight(out: &Path, log: &ForesightLog) -> String {
    let mut models = String::new();
    for (model, sha256) in &log.models {
        let _ = writeln!(models, "| `{model}` | `{sha256}` |");
    }
    let mut libraries = String::new();
    for l in &log.libraries {
        let v = l.validation;
        let shares = [v.in_first, v.in_order, v.in_first_by_estimate, v.in_order_by_estimate];
        let shares = shares.map(percent).join(" | ");
        let off = [v.cost_median, v.cost_p95].map(percent).join(" | ");
        let (model, length, kind) = (&l.model, l.vehicle.length, l.kind);
        let (examples, scenes) = (l.examples, v.scenes);
        let _ = writeln!(
            libraries,
            "| `{model}` | {length:.2} | {kind} | {examples} | {scenes} | {shares} | {off} |"
        );
    }
    let layers =
        |widths: &[usize]| widths.iter().map(usize::to_string).collect::<Vec<_>>().join(" → ");
    let curve = out.with_extension("training.svg");
    format!(
        "\
# Model card: {file}

A network that sees the free space around a spot, and foresees what known manoeuvres are worth there and
what the best plan will cost. Written by n3p {VERSION}.

## What it is for

The planner `n3p` tries the manoeuvres it promises most of first, and takes the best of these where it costs
about what was foreseen; only else it goes on. It serves the libraries of all models and vehicles of any
size, for all lengths are in turning radii; not angled bays. It decides nothing about safety: every path is
checked as exactly as without it.

One tower sees the scene, {scene} with ReLU between layers: start, vehicle, estimates of the library, and
how far it is from the lane's middle to obstacles in strips along the lane, and in the spot. The other sees
a manoeuvre, {manoeuvre}: where it begins, what it costs, what it sweeps.

## Learnt from

| model | SHA-256 |
|---|---|
{models}
Generated worlds, their sizes drawn far wider than those of any level; those in common use were tried in each, and
Hybrid A* looked for something better. In some the car begins somewhere along a plan. Epoch kept:
{best} of {epochs} ([losses](<{curve}>)).

```toml
{settings}```

## How good it is

In worlds of another seed. The shares say in how many scenes one of the first 3 or 12 manoeuvres costs
at most a tenth of a turning radius more than the best of the library, by this network and by
estimates that see no obstacles; the last columns how far the foreseen cost is off.

| model | vehicle, m | type | examples | scenes | first 3 | first 12 | estimates, first 3 | first 12 | cost off by, median | P95 |
|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|
{libraries}",
        file = name(out),
        scene = layers(&SCENE_LAYERS),
        manoeuvre = layers(&MANOEUVRE_LAYERS),
        best = log.best_epoch,
        epochs = log.losses.len(),
        curve = curve.file_name().unwrap_or_default().to_string_lossy(),
        settings = toml::to_string(&log.config).expect("settings are plain data"),
    )
}
