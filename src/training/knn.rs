//! Samples → `knn.bin`.

use std::collections::HashMap;
use std::path::Path;

use super::{TrainingError, solved};
use crate::curves::Segment;
use crate::dataset::{Metadata, Sample};
use crate::geometry::Pose;
use crate::selectors::artefact;
use crate::selectors::knn_file::{self, KindHeader, KnnEntries, KnnEntry, KnnHeader};
use crate::world::ParkingType;

/// What was stored.
#[derive(Clone, Debug, PartialEq)]
pub struct KnnReport {
    /// Solved samples and cells that have any, per parking type.
    pub kinds: Vec<(ParkingType, usize, usize)>,
    /// Size of the file, bytes.
    pub bytes: usize,
}

/// Stores the solved samples of `kinds` in the file `out`.
///
/// A parking type without a solved sample is an error: a selector that knows nothing of it
/// would be found out only on the road.
pub fn train(
    metadata: &Metadata,
    samples: &[Sample],
    data_sha256: &str,
    kinds: &[ParkingType],
    out: &Path,
) -> Result<KnnReport, TrainingError> {
    let mut headers = Vec::new();
    let mut entries = Vec::new();
    let mut report = Vec::new();
    for &kind in kinds {
        let cells = metadata.grid.cell_count(kind);
        let solved = solved(samples, kind, cells)?;
        if solved.is_empty() {
            return Err(TrainingError::NoSamples(kind));
        }
        let occupied = solved.chunk_by(|a, b| a.cell_index == b.cell_index).count();
        report.push((kind, solved.len(), occupied));
        let collected = collect(&solved);
        headers.push(KindHeader {
            kind,
            cells,
            samples: solved.len(),
            manoeuvres: collected.manoeuvres.len(),
            segments: collected.manoeuvres.iter().map(Vec::len).sum(),
        });
        entries.push(collected);
    }
    let header = KnnHeader {
        vehicle: metadata.vehicle,
        grid: metadata.grid,
        heading_radius: metadata.vehicle.turning_radius() / 2.0,
        extent: extent(&entries),
        kinds: headers,
        data_sha256: data_sha256.to_owned(),
        seed: metadata.seed,
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let bytes = knn_file::encode(&header, &entries);
    artefact::write(out, &bytes)?;
    Ok(KnnReport { kinds: report, bytes: bytes.len() })
}

/// The samples, and each different manoeuvre once.
fn collect(solved: &[&Sample]) -> KnnEntries {
    let mut entries = KnnEntries::default();
    let mut known: HashMap<Vec<[u64; 2]>, u32> = HashMap::new();
    for s in solved {
        let manoeuvre = (!s.manoeuvre.is_empty()).then(|| {
            let bits = |m: &Segment| [m.curvature.to_bits(), m.length.to_bits()];
            *known.entry(s.manoeuvre.iter().map(bits).collect()).or_insert_with(|| {
                entries.manoeuvres.push(s.manoeuvre.clone());
                entries.manoeuvres.len() as u32 - 1
            })
        });
        let (cell, start, preparatory) = (s.cell_index, s.start, s.rs_start);
        entries.samples.push(KnnEntry { cell, start, preparatory, manoeuvre });
    }
    entries
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
