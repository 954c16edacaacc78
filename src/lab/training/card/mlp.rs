//! The card of a network.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use super::{INPUTS, VERSION, data, metrics, name, number, percent, spots, vehicle};
use crate::lab::dataset::Metadata;
use crate::lab::training::mlp::TrainingLog;
use crate::lab::training::{Targets, Validation};
use crate::selectors::mlp::layers_for;
use crate::world::ParkingType;

/// The card of the network `out`. `rows`: of its parking type in the data set, solved or not.
pub(in crate::lab::training) fn mlp(
    out: &Path,
    metadata: &Metadata,
    rows: usize,
    log: &TrainingLog,
) -> String {
    let (file, spots) = (name(out), spots(log.kind));
    let widths = layers_for(log.kind);
    let layers = widths.map(|width| width.to_string()).join(" → ");
    let parameters: usize = widths.windows(2).map(|size| size[1] * (size[0] + 1)).sum();
    let solved = log.train_rows + log.validation_rows;
    let reach = log.reach;
    let (to_goal, vehicle) = (percent(reach.to_goal), vehicle(metadata));
    let data = data(metadata, &log.data_sha256, &[(log.kind, rows, solved)]);
    let training = mlp_training(out, log);
    let slant = match log.kind {
        ParkingType::Angled => "| cos ψ, sin ψ | | ψ: heading of the parked car |\n",
        _ => "",
    };
    let metrics = metrics(&[(log.kind, log.validation_rows, log.validation, reach)]);
    let chosen = match (log.config.targets, log.config.validation) {
        (Targets::PerCell, Validation::Starts) => {
            "\nA cell's pose was chosen with all of its rows at hand, so these numbers say nothing of cells\n\
             that the network has never seen; planning asks for no others."
        }
        _ => "",
    };
    format!(
        "\
# Model card: {file}

A neural network that proposes a *preparatory pose* for {spots}: where the
car is to stand before the last Reeds-Shepp curve takes it into the spot. Trained by n3p {VERSION}.

## What it is for

The planners `mlp-n3p` and, without a KNN model, `n3p` ask it where to drive first. They check what it
says and search where it does not help, so a bad answer costs planning time, not clearance. The model is
no planner and no controller: it sees neither obstacles nor anything else outside of the cell.

{INPUTS}{slant}
| out | unit | |
|---|---|---|
| x, y | m | the preparatory pose |
| cos θ, sin θ | | its heading |

The network is the paper's: {layers} with ReLU between layers, {parameters} weights in single
precision. Inputs and outputs are normalised; the file holds the scaling.

## Limits

- **No guarantee.** Nothing ensures that a curve leads from the proposed pose into the spot, or that the
  pose is free. Of the rows kept apart that were judged, {to_goal} had such a curve.
- **One vehicle**: {vehicle}. It serves
  vehicles that this one covers, too (docs/vehicles.md); for any other the model is refused.
- **{Spots} only**, in cells of the grid below. Smaller spots, lanes and dead ends have
  no cell, hence no answer.
- Learnt from this planner's own solutions in free space that is two rectangles, not from drivers.

{data}
{training}
## How good it is

On rows kept apart from learning; *wanted* is the pose that the network was to learn. The best
epoch was chosen by the loss on the same rows, which flatters a little.{chosen}

{metrics}",
        Spots = capital(spots),
    )
}

/// Settings, counts and losses of a network's training.
fn mlp_training(out: &Path, log: &TrainingLog) -> String {
    let config = &log.config;
    let settings = toml::to_string(config).expect("settings are plain data");
    let (epochs, best) = (log.losses.len(), log.best_epoch);
    let (kind, train_rows, kept_rows) = (log.kind, log.train_rows, log.validation_rows);
    let wanted = match config.targets {
        Targets::Stored => "Each row's own preparatory pose".to_owned(),
        Targets::PerCell => {
            let behind = match config.behind {
                0.0 => String::new(),
                metres => {
                    format!(
                        "; every other row starts anew, up to {} m behind the lane",
                        number(metres)
                    )
                }
            };
            format!(
                "One pose for all rows of a cell, chosen for short paths and little search{behind}"
            )
        }
    };
    let kept = match config.validation {
        Validation::Starts => "some starts of every cell",
        Validation::Cells => "whole cells",
    };
    let curve = out.with_extension("training.svg");
    let curve = curve.file_name().unwrap_or_default().to_string_lossy();
    let mut losses = String::new();
    for epoch in shown_epochs(epochs, best) {
        let loss = log.losses[epoch - 1];
        let mark = if epoch == best { " (best)" } else { "" };
        let (train, validation) = (loss.train, loss.validation);
        let _ = writeln!(losses, "| {epoch}{mark} | {train:.5} | {validation:.5} |");
    }
    format!(
        "\
## Training

| | |
|---|---|
| Learnt | {wanted} |
| Rows learnt | {train_rows} |
| Rows kept apart | {kept_rows}: {kept} |
| Epochs | {epochs} of at most {most}; stored is the network of epoch {best} |
| Seed | {seed} (weights, order of rows, rows kept apart, starts and poses chosen) |

Every setting, as a file for `n3p-train mlp --type {kind} --config FILE`:

```toml
{settings}```

Mean loss per output, outputs in units of their standard deviation ([all epochs](<{curve}>)):

| epoch | rows learnt | rows kept apart |
|--:|--:|--:|
{losses}
![Loss over the epochs](<{curve}>)
",
        most = config.epochs,
        seed = config.seed,
    )
}

/// About eight epochs, evenly spread on a logarithmic scale, and the `best`; from 1.
fn shown_epochs(epochs: usize, best: usize) -> BTreeSet<usize> {
    const SHOWN: i32 = 8;
    let share = |i: i32| f64::from(i) / f64::from(SHOWN - 1);
    let spread = (0..SHOWN).map(|i| (epochs as f64).powf(share(i)).round() as usize);
    spread.chain([best]).filter(|epoch| (1..=epochs).contains(epoch)).collect()
}

fn capital(text: &str) -> String {
    text[..1].to_uppercase() + &text[1..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn epochs_are_spread_and_hold_the_best() {
        let shown = |epochs, best| shown_epochs(epochs, best).into_iter().collect::<Vec<_>>();
        assert_eq!(shown(300, 190), [1, 2, 5, 12, 26, 59, 133, 190, 300]);
        assert_eq!(shown(3, 3), [1, 2, 3]);
        assert_eq!(shown(1, 1), [1]);
    }
}
