//! Samples of many vehicles → one model for any: a library of manoeuvres, and networks that see
//! the shape of the vehicle.

use std::num::NonZero;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::curve::{self, EpochLoss};
use super::library::{Source, condense};
use super::mlp::{LEAST_SAMPLES, split};
use super::quality::{Errors, Reach, errors, reach};
use super::regression::{Rows, Trainable, fit, predictions};
use super::targets::{self, Example};
use super::watch::Watch;
use super::worlds::WorldsConfig;
use super::{MlpConfig, TrainingError, card, solved, write_beside};
use crate::geometry::Pose;
use crate::lab::dataset::{Dataset, Sample};
use crate::selectors::artefact;
use crate::selectors::fleet::{self, FleetHeader, Scaling, UNIT_LAYERS, UnitManoeuvres, in_metres};
use crate::selectors::network::{LayerWeights, OUTPUTS, outputs_from_pose};
use crate::selectors::{Features, Normaliser, UNIT_COUNT, UNIT_NAMES};
use crate::vehicle::Vehicle;
use crate::world::{ParkingType, Stance};

/// The training's log, written as JSON beside the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FleetLog {
    /// The vehicles, in the order of their data sets.
    pub fleet: Vec<Vehicle>,
    /// SHA-256 of their data sets.
    pub data_sha256: Vec<String>,
    /// Settings of the networks' training.
    pub config: MlpConfig,
    /// The worlds that manoeuvres were learnt in.
    pub worlds: WorldsConfig,
    /// Parking type by parking type.
    pub kinds: Vec<FleetKindLog>,
    /// Size of the model, bytes.
    pub bytes: usize,
}

/// What was learnt of one parking type.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FleetKindLog {
    /// The type.
    pub kind: ParkingType,
    /// Solved samples of all vehicles.
    pub samples: usize,
    /// Manoeuvres kept.
    pub manoeuvres: usize,
    /// Rows that the network learnt.
    pub train_rows: usize,
    /// Rows kept apart.
    pub validation_rows: usize,
    /// Losses epoch by epoch.
    pub losses: Vec<EpochLoss>,
    /// The epoch of the stored network, from 1.
    pub best_epoch: usize,
    /// Errors of the stored network on the rows kept apart.
    pub validation: Errors,
    /// What its predictions for these rows are worth to a planner.
    pub reach: Reach,
}

/// Condenses the samples of `sets`, one of each vehicle and all of one grid, into the model `out`,
/// learns further manoeuvres in `worlds`, and trains its networks; log, model card and loss curves are written beside it.
///
/// # Panics
///
/// Without a data set.
pub fn train(
    sets: &[Dataset],
    config: &MlpConfig,
    worlds: &WorldsConfig,
    out: &Path,
) -> Result<FleetLog, TrainingError> {
    config.validate()?;
    worlds.validate()?;
    let mut solved = Vec::new();
    for kind in ParkingType::SQUARE {
        solved.push((kind, solved_of(sets, kind)?));
    }
    let condensed = worlds.learn(&solved, |(kind, of_sets), worlds| {
        let sources = sources(sets, of_sets);
        worlds.learn(Stance::new(*kind, 0.0), condense(&sources), &sources)
    });
    let mut watch = Watch::begin(out, false)?;
    let (mut scaling, mut networks, mut logs) = (Vec::new(), Vec::new(), Vec::new());
    for ((kind, of_sets), manoeuvres) in solved.iter().zip(&condensed) {
        let learnt = learn(sets, *kind, of_sets, config, manoeuvres.len(), &mut watch)?;
        scaling.push(learnt.scaling);
        networks.push(learnt.weights);
        logs.push(learnt.log);
    }
    let count = |m: &UnitManoeuvres| m.iter().map(Vec::len).sum();
    let kinds = ParkingType::SQUARE.into_iter().zip(&condensed);
    let header = FleetHeader {
        format_version: fleet::VERSION,
        fleet: sets.iter().map(|s| s.metadata.vehicle).collect(),
        data_sha256: sets.iter().map(|s| s.content_sha256(&ParkingType::SQUARE)).collect(),
        kinds: kinds.map(|(kind, m)| (kind, m.len(), count(m))).collect(),
        grid: sets[0].metadata.grid,
        features: UNIT_NAMES.map(str::to_owned).to_vec(),
        scaling,
        training: serde_json::to_value(config).expect("settings are plain data"),
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let bytes = fleet::encode(&header, &condensed, &networks);
    artefact::write(out, &bytes)?;
    let FleetHeader { fleet, data_sha256, .. } = header;
    let (config, worlds, bytes) = (config.clone(), *worlds, bytes.len());
    let log = FleetLog { fleet, data_sha256, config, worlds, kinds: logs, bytes };
    write_beside(out, &log, card::fleet(out, &log))?;
    for FleetKindLog { kind, losses, .. } in &log.kinds {
        let picture = curve::svg(&format!("fleet, {kind}: loss"), losses)?;
        let name = format!("{kind}.training.svg");
        artefact::write(&out.with_extension(name), picture.as_bytes())?;
    }
    Ok(log)
}

/// The solved samples of a type, set by set; each has a few.
fn solved_of(sets: &[Dataset], kind: ParkingType) -> Result<Vec<Vec<&Sample>>, TrainingError> {
    let mut all = Vec::new();
    for set in sets {
        let of_set = solved(&set.samples, kind, set.metadata.grid.cell_count(kind))?;
        if of_set.len() < LEAST_SAMPLES {
            let (samples, needed) = (of_set.len(), LEAST_SAMPLES);
            return Err(TrainingError::TooFew { kind, samples, needed });
        }
        all.push(of_set);
    }
    Ok(all)
}

/// The samples of every vehicle, lengths in turning radii.
fn sources<'a>(sets: &'a [Dataset], solved: &'a [Vec<&'a Sample>]) -> Vec<Source<'a>> {
    let source = |(set, solved): (&'a Dataset, &'a Vec<&'a Sample>)| {
        let unit = set.metadata.vehicle.turning_radius();
        Source { metadata: &set.metadata, solved, unit }
    };
    sets.iter().zip(solved).map(source).collect()
}

/// A network and how it was learnt.
struct Learnt {
    scaling: Scaling,
    weights: Vec<LayerWeights>,
    log: FleetKindLog,
}

/// One network for the samples of all vehicles.
fn learn(
    sets: &[Dataset],
    kind: ParkingType,
    solved: &[Vec<&Sample>],
    config: &MlpConfig,
    manoeuvres: usize,
    watch: &mut Watch,
) -> Result<Learnt, TrainingError> {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    let parts = sets.iter().zip(solved).map(|(set, solved)| {
        let (train, validation) =
            split(targets::examples(&set.metadata, solved, config, threads), config);
        Part { set, train, validation }
    });
    let parts: Vec<Part> = parts.collect();
    let [train, validation] = [|p: &Part| p.raw(&p.train), |p: &Part| p.raw(&p.validation)]
        .map(|rows| parts.iter().flat_map(rows).unzip::<_, _, Vec<_>, Vec<_>>());
    let scaling = Scaling { input: Normaliser::fit(&train.0), output: Normaliser::fit(&train.1) };
    let [train, validation] = [train, validation]
        .map(|(inputs, outputs)| Rows::new(&inputs, &outputs, &scaling.input, &scaling.output));
    let model = Trainable::new(&UNIT_LAYERS, config.seed)?;
    let mut best = None;
    let losses = fit(&model, &train, &validation, config, (kind.name(), watch), |losses| {
        let predicted = predictions(&model, &validation, &scaling.output)?;
        let (errors, reach) = judge(&parts, &predicted);
        best = Some((model.weights()?, losses.len(), errors, reach));
        let (median, direct) = (errors.position_median_m, 100.0 * reach.direct);
        Ok(format!("median {median:.2} m, direct {direct:.0} %"))
    })?;
    let (weights, best_epoch, errors, reach) = best.expect("any loss is better than none");
    let log = FleetKindLog {
        kind,
        samples: solved.iter().map(Vec::len).sum(),
        manoeuvres,
        train_rows: train.len(),
        validation_rows: validation.len(),
        losses,
        best_epoch,
        validation: errors,
        reach,
    };
    Ok(Learnt { scaling, weights, log })
}

/// Rows of one vehicle.
struct Part<'a> {
    set: &'a Dataset,
    train: Vec<Example>,
    validation: Vec<Example>,
}

impl Part<'_> {
    /// Inputs and outputs of `examples`, lengths in turning radii.
    fn raw(&self, examples: &[Example]) -> Vec<([f32; UNIT_COUNT], [f32; OUTPUTS])> {
        let (grid, vehicle) = (&self.set.metadata.grid, &self.set.metadata.vehicle);
        let row = |e: &Example| {
            let input = Features::new(e.start, e.cell).unit_values(grid, vehicle);
            (input, outputs_from_pose(in_radii(e.target, vehicle)))
        };
        examples.iter().map(row).collect()
    }
}

/// How good `predicted`, the poses for the validation rows of all parts in turning radii, are.
fn judge(parts: &[Part], predicted: &[Pose]) -> (Errors, Reach) {
    let (mut poses, mut wanted, mut reaches) = (Vec::new(), Vec::new(), Vec::new());
    let mut rest = predicted;
    for Part { set, validation, .. } in parts {
        let (own, others) = rest.split_at(validation.len());
        rest = others;
        let own: Vec<Pose> = own.iter().map(|&p| in_metres(p, &set.metadata.vehicle)).collect();
        reaches.push(reach(&set.metadata, validation, &own));
        poses.extend(own);
        wanted.extend_from_slice(validation);
    }
    (errors(&poses, &wanted), Reach::mean(&reaches))
}

/// A pose in turning radii of `vehicle`.
fn in_radii(pose: Pose, vehicle: &Vehicle) -> Pose {
    let unit = vehicle.turning_radius();
    Pose { x: pose.x / unit, y: pose.y / unit, ..pose }
}
