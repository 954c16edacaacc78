//! Samples of many vehicles → one library of manoeuvres for any vehicle.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::library::{Source, condense};
use super::{TrainingError, card, solved, write_beside};
use crate::dataset::{Dataset, Sample};
use crate::selectors::artefact;
use crate::selectors::fleet::{self, FleetHeader};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// The training's log, written as JSON beside the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FleetLog {
    /// The vehicles, in the order of their data sets.
    pub fleet: Vec<Vehicle>,
    /// SHA-256 of their data sets.
    pub data_sha256: Vec<String>,
    /// Parking types, and the solved samples of all vehicles and the manoeuvres of each.
    pub kinds: Vec<(ParkingType, usize, usize)>,
    /// Size of the model, bytes.
    pub bytes: usize,
}

/// Condenses the samples of `sets`, one of each vehicle, into the model `out`, with its log and its
/// model card beside it.
pub fn train(sets: &[Dataset], out: &Path) -> Result<FleetLog, TrainingError> {
    let condensed: Vec<Result<_, TrainingError>> = std::thread::scope(|scope| {
        let running = ParkingType::ALL.map(|kind| scope.spawn(move || learn(sets, kind)));
        running.into_iter().map(|r| r.join().expect("learning does not panic")).collect()
    });
    let (mut kinds, mut logs, mut manoeuvres) = (Vec::new(), Vec::new(), Vec::new());
    for (kind, result) in ParkingType::ALL.into_iter().zip(condensed) {
        let (samples, of_kind) = result?;
        kinds.push((kind, of_kind.len(), of_kind.iter().map(Vec::len).sum()));
        logs.push((kind, samples, of_kind.len()));
        manoeuvres.push(of_kind);
    }
    let fleet: Vec<Vehicle> = sets.iter().map(|s| s.metadata.vehicle).collect();
    let data_sha256: Vec<String> =
        sets.iter().map(|s| s.content_sha256(&ParkingType::ALL)).collect();
    let header = FleetHeader {
        format_version: fleet::VERSION,
        fleet: fleet.clone(),
        data_sha256: data_sha256.clone(),
        kinds,
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let bytes = fleet::encode(&header, &manoeuvres);
    artefact::write(out, &bytes)?;
    let log = FleetLog { fleet, data_sha256, kinds: logs, bytes: bytes.len() };
    write_beside(out, &log, card::fleet(out, &log))?;
    Ok(log)
}

/// The solved samples of a type, counted, and the manoeuvres that serve them.
fn learn(
    sets: &[Dataset],
    kind: ParkingType,
) -> Result<(usize, fleet::UnitManoeuvres), TrainingError> {
    let mut samples: Vec<Vec<&Sample>> = Vec::new();
    for set in sets {
        let of_set = solved(&set.samples, kind, set.metadata.grid.cell_count(kind))?;
        if of_set.is_empty() {
            return Err(TrainingError::NoSamples(kind));
        }
        samples.push(of_set);
    }
    let sources = sets.iter().zip(&samples).map(|(set, solved)| {
        let unit = set.metadata.vehicle.turning_radius();
        Source { metadata: &set.metadata, solved, unit }
    });
    let sources: Vec<Source> = sources.collect();
    Ok((samples.iter().map(Vec::len).sum(), condense(kind, &sources)))
}
