//! Samples → `knn.bin`.

use std::path::Path;

use serde::{Deserialize, Serialize};

pub use super::leave_one_out::LeaveOneOut;
use super::leave_one_out::leave_one_out;
use super::library::{self, Source};
use super::worlds::{Worlds, WorldsConfig};
use super::{TrainingError, card, solved, write_beside};
use crate::curves::Segment;
use crate::geometry::Pose;
use crate::lab::dataset::{Metadata, Sample, content_sha256};
use crate::selectors::artefact;
use crate::selectors::knn_file::{self, KindHeader, KnnEntries, KnnEntry, KnnHeader};
use crate::world::{ParkingType, Stance};

/// What is learnt from, and what is kept of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnnConfig {
    /// Worlds in which manoeuvres are learnt beside the samples.
    pub worlds: WorldsConfig,
    /// Samples stored of each cell, at most; the manoeuvres are learnt from all.
    pub samples_per_cell: u32,
}

impl From<WorldsConfig> for KnnConfig {
    fn from(worlds: WorldsConfig) -> Self {
        Self { worlds, samples_per_cell: u32::MAX }
    }
}

/// What was stored; written as JSON beside the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnnLog {
    /// SHA-256 of the data set.
    pub data_sha256: String,
    /// Seed of the data set.
    pub seed: u64,
    /// The worlds that manoeuvres were learnt in, beside the samples.
    pub worlds: WorldsConfig,
    /// Metres per radian of the metric's heading part; see [`crate::selectors::knn`].
    pub heading_radius: f64,
    /// Size of the file, bytes.
    pub bytes: usize,
    /// The parking types, in the order of the file.
    pub kinds: Vec<KnnKindLog>,
}

/// What was stored of one parking type.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnnKindLog {
    /// The parking type.
    pub kind: ParkingType,
    /// Rows of the data set.
    pub rows: usize,
    /// Rows stored: solved ones, the first `samples_per_cell` of each cell.
    pub samples: usize,
    /// Rows solved, where not all of them are stored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solved: Option<usize>,
    /// Cells of the grid.
    pub cells: usize,
    /// Cells that have a sample.
    pub occupied_cells: usize,
    /// Manoeuvres of the library.
    pub manoeuvres: usize,
    /// What stored samples' neighbours answer for them; `None` where no cell has two.
    pub leave_one_out: Option<LeaveOneOut>,
}

/// Stores the solved samples of `kinds`, the first `samples_per_cell` of each cell, and the manoeuvres
/// that serve them all, in the file `out`, with its log and its model card beside it.
///
/// A parking type without a solved sample is an error: a selector that knows nothing of it
/// would be found out only on the road.
pub fn train(
    metadata: &Metadata,
    samples: &[Sample],
    kinds: &[ParkingType],
    config: &KnnConfig,
    out: &Path,
) -> Result<KnnLog, TrainingError> {
    config.worlds.validate()?;
    let mut known = Vec::new();
    for &kind in kinds {
        let solved = solved(samples, kind, metadata.grid.cell_count(kind))?;
        if solved.is_empty() {
            return Err(TrainingError::NoSamples(kind));
        }
        known.push((kind, solved));
    }
    let heading_radius = metadata.vehicle.turning_radius() / 2.0;
    let learnt = config.worlds.learn(&known, |(kind, solved), worlds| {
        let stored = stored(solved, config.samples_per_cell);
        let leave_one_out = leave_one_out(metadata, &stored, heading_radius);
        (by_stance(metadata, *kind, solved, worlds), stored, leave_one_out)
    });
    let mut headers = Vec::new();
    let mut entries = Vec::new();
    let mut logs = Vec::new();
    for ((kind, solved), (by_stance, stored, leave_one_out)) in known.iter().zip(learnt) {
        let kind = *kind;
        let cells = metadata.grid.cell_count(kind);
        let entry =
            |s: &&Sample| KnnEntry { cell: s.cell_index, start: s.start, preparatory: s.rs_start };
        let manoeuvres_by_stance = match &by_stance[..] {
            [_] => Vec::new(),
            several => several.iter().map(Vec::len).collect(),
        };
        let manoeuvres = by_stance.concat();
        let collected = KnnEntries { samples: stored.iter().map(entry).collect(), manoeuvres };
        logs.push(KnnKindLog {
            kind,
            rows: samples.iter().filter(|s| s.cell.kind() == kind).count(),
            samples: stored.len(),
            solved: (stored.len() < solved.len()).then_some(solved.len()),
            cells,
            occupied_cells: stored.chunk_by(|a, b| a.cell_index == b.cell_index).count(),
            manoeuvres: collected.manoeuvres.len(),
            leave_one_out,
        });
        headers.push(KindHeader {
            kind,
            cells,
            samples: stored.len(),
            poses: 0,
            manoeuvres: collected.manoeuvres.len(),
            segments: collected.manoeuvres.iter().map(Vec::len).sum(),
            manoeuvres_by_stance,
        });
        entries.push(collected);
    }
    let of_kinds = samples.iter().filter(|s| kinds.contains(&s.cell.kind()));
    let header = KnnHeader {
        vehicle: metadata.vehicle,
        grid: metadata.grid,
        heading_radius,
        extent: extent(&entries),
        kinds: headers,
        data_sha256: content_sha256(metadata, of_kinds),
        seed: metadata.seed,
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let (data_sha256, seed) = (header.data_sha256.clone(), header.seed);
    let bytes = knn_file::encode(header, &entries);
    artefact::write(out, &bytes)?;
    let worlds = config.worlds;
    let log = KnnLog { data_sha256, seed, worlds, heading_radius, bytes: bytes.len(), kinds: logs };
    write_beside(out, &log, card::knn(out, metadata, &log))?;
    Ok(log)
}

/// The manoeuvres for each of the grid's stances.
fn by_stance(
    metadata: &Metadata,
    kind: ParkingType,
    solved: &[&Sample],
    worlds: &Worlds,
) -> Vec<Vec<Vec<Segment>>> {
    let of_stance = |stance: Stance| {
        let own = solved.iter().copied().filter(|s| s.cell.stance == stance);
        let sources = [Source { metadata, solved: &own.collect::<Vec<_>>(), unit: 1.0 }];
        worlds.learn(stance, library::condense(&sources), &sources)
    };
    metadata.grid.stances(kind).into_iter().map(of_stance).collect()
}

/// The first `samples_per_cell` samples of each cell.
fn stored<'a>(solved: &[&'a Sample], samples_per_cell: u32) -> Vec<&'a Sample> {
    let most = usize::try_from(samples_per_cell).unwrap_or(usize::MAX);
    let cells = solved.chunk_by(|a, b| a.cell_index == b.cell_index);
    cells.flat_map(|cell| &cell[..most.min(cell.len())]).copied().collect()
}

/// The least power of two, from 16 m, that no coordinate exceeds.
fn extent(entries: &[KnnEntries]) -> f64 {
    let largest = |p: Pose| p.x.abs().max(p.y.abs());
    let all = entries.iter().flat_map(|e| &e.samples);
    let most = all.fold(0.0, |m: f64, e| m.max(largest(e.start)).max(largest(e.preparatory)));
    let mut extent = 16.0;
    while extent < most {
        extent *= 2.0;
    }
    extent
}
