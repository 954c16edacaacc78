//! Samples → `knn.bin`.

use std::path::Path;

use super::{TrainingError, library, solved};
use crate::dataset::{Metadata, Sample, content_sha256};
use crate::geometry::Pose;
use crate::selectors::artefact;
use crate::selectors::knn_file::{self, KindHeader, KnnEntries, KnnEntry, KnnHeader};
use crate::world::ParkingType;

/// What was stored.
#[derive(Clone, Debug, PartialEq)]
pub struct KnnReport {
    /// Per parking type: solved samples, cells that have any, and manoeuvres.
    pub kinds: Vec<(ParkingType, usize, usize, usize)>,
    /// Size of the file, bytes.
    pub bytes: usize,
}

/// Stores the solved samples of `kinds`, and the manoeuvres that serve them, in the file `out`.
///
/// A parking type without a solved sample is an error: a selector that knows nothing of it
/// would be found out only on the road.
pub fn train(
    metadata: &Metadata,
    samples: &[Sample],
    kinds: &[ParkingType],
    out: &Path,
) -> Result<KnnReport, TrainingError> {
    let mut known = Vec::new();
    for &kind in kinds {
        let solved = solved(samples, kind, metadata.grid.cell_count(kind))?;
        if solved.is_empty() {
            return Err(TrainingError::NoSamples(kind));
        }
        known.push((kind, solved));
    }
    let libraries: Vec<_> = std::thread::scope(|scope| {
        let condense = |(kind, solved): &(ParkingType, Vec<&Sample>)| {
            library::condense(metadata, *kind, solved)
        };
        let running: Vec<_> = known.iter().map(|k| scope.spawn(move || condense(k))).collect();
        running.into_iter().map(|r| r.join().expect("condensing does not panic")).collect()
    });
    let mut headers = Vec::new();
    let mut entries = Vec::new();
    let mut report = Vec::new();
    for ((kind, solved), manoeuvres) in known.into_iter().zip(libraries) {
        let cells = metadata.grid.cell_count(kind);
        let occupied = solved.chunk_by(|a, b| a.cell_index == b.cell_index).count();
        let entry =
            |s: &&Sample| KnnEntry { cell: s.cell_index, start: s.start, preparatory: s.rs_start };
        let collected = KnnEntries { samples: solved.iter().map(entry).collect(), manoeuvres };
        report.push((kind, solved.len(), occupied, collected.manoeuvres.len()));
        headers.push(KindHeader {
            kind,
            cells,
            samples: solved.len(),
            manoeuvres: collected.manoeuvres.len(),
            segments: collected.manoeuvres.iter().map(Vec::len).sum(),
        });
        entries.push(collected);
    }
    let of_kinds = samples.iter().filter(|s| kinds.contains(&s.cell.kind));
    let header = KnnHeader {
        vehicle: metadata.vehicle,
        grid: metadata.grid,
        heading_radius: metadata.vehicle.turning_radius() / 2.0,
        extent: extent(&entries),
        kinds: headers,
        data_sha256: content_sha256(metadata, of_kinds),
        seed: metadata.seed,
        crate_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let bytes = knn_file::encode(&header, &entries);
    artefact::write(out, &bytes)?;
    Ok(KnnReport { kinds: report, bytes: bytes.len() })
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
