//! Preparatory poses of the nearest stored samples.
//!
//! Only samples of the query's own grid cell are neighbours, or, where that cell has none,
//! those of the nearest smaller cell. The neighbour's cell is thus never larger than the
//! query's, and its Reeds-Shepp connection to the goal is free by construction.
//!
//! Starts are compared as points `(x, y, r·cos θ, r·sin θ)`, metres: turning by Δθ counts
//! like moving `r·Δθ`. `r` is half the turning radius ρ by default, since a car turns by Δθ
//! on an arc of length ρ·Δθ, half of it forward and half backward when it must not move on.
//!
//! Sources: paper, section IV (KNN-N3P). Read next: [`super::knn_file`].

use std::borrow::Cow;
use std::num::NonZero;
use std::path::Path;
use std::sync::OnceLock;

use super::artefact::{self, ArtefactError};
use super::knn_file::KnnFile;
use super::nearest::{MetricPoint, Points};
use super::{Features, PoseSelector};
use crate::curves::Segment;
use crate::geometry::{Pose, signed_angle};
use crate::vehicle::Vehicle;
use crate::world::cell::Grid;
use crate::world::{ParkingType, Stance};

/// The KNN selector. A cell's points are computed when the cell is first asked for, so that loading
/// costs little more than the checksum.
#[derive(Debug)]
pub struct KnnSelector {
    file: KnnFile,
    /// `[kind][cell]`, as in the file.
    cells: Vec<Vec<OnceLock<Points>>>,
}

/// A stored sample near a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Squared distance in the metric, m².
    pub distance_sq: f64,
    /// Index of the cell it was stored for: the query's, or a smaller one.
    pub cell: usize,
    /// Its position among all samples of its parking type.
    pub sample: usize,
}

impl KnnSelector {
    /// Two preparatory poses this close count as one, metres.
    pub const SAME_POSITION: f64 = 0.05;
    /// Two preparatory poses this close count as one, radians (2°).
    pub const SAME_HEADING: f64 = 2.0 * std::f64::consts::PI / 180.0;
    /// When several poses are wanted, this many neighbours per pose are looked at, since
    /// neighbours often agree.
    pub const NEIGHBOURS_PER_POSE: usize = 4;

    /// Maps and checks a `knn.bin`.
    pub fn load(path: &Path) -> Result<Self, ArtefactError> {
        Self::from_bytes(path, artefact::read(path)?)
    }

    /// Checks the content of the file at `path`.
    pub fn from_bytes(path: &Path, bytes: Cow<'static, [u8]>) -> Result<Self, ArtefactError> {
        let file = KnnFile::new(path, bytes)?;
        let kinds = &file.header().kinds;
        let cells = kinds.iter().map(|k| (0..k.cells).map(|_| OnceLock::new()).collect()).collect();
        Ok(Self { file, cells })
    }

    /// The vehicle the samples were driven with.
    pub fn vehicle(&self) -> &Vehicle {
        &self.file.header().vehicle
    }

    /// The file it was loaded from.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// The file: header and stored samples.
    pub fn file(&self) -> &KnnFile {
        &self.file
    }

    /// The point of a pose in the metric, metres. `radius`: metres per radian.
    pub fn point(pose: Pose, radius: f64) -> MetricPoint {
        let (sin, cos) = pose.sin_cos();
        [pose.x, pose.y, radius * cos, radius * sin].map(|v| v as f32)
    }

    /// The cell whose samples answer for `cell`: itself, or where it has none the nearest
    /// smaller one, by grid steps in all three parameters together; of equally near ones
    /// the one with the widest lane, then the widest spot. The parked car stands as in `cell`.
    pub fn source_cell(&self, kind: usize, cell: usize) -> Option<usize> {
        if !self.file.samples(kind, cell).is_empty() {
            return Some(cell);
        }
        let header = self.file.header();
        let (grid, parking_type) = (&header.grid, header.kinds[kind].kind);
        let [stance, lane, spot, dead] = grid.place(parking_type, cell);
        let mut best: Option<(usize, usize)> = None;
        for l in (0..=lane).rev() {
            for s in (0..=spot).rev() {
                for d in (0..=dead).rev() {
                    let steps = (lane - l) + (spot - s) + (dead - d);
                    if best.is_some_and(|(least, _)| steps >= least) {
                        break;
                    }
                    let candidate = grid.index(parking_type, [stance, l, s, d]);
                    if !self.file.samples(kind, candidate).is_empty() {
                        best = Some((steps, candidate));
                    }
                }
            }
        }
        best.map(|(_, candidate)| candidate)
    }

    /// The `n` nearest samples, nearest first; equally near ones in sample order. Empty for
    /// a parking type, or below a cell, without samples.
    pub fn nearest(&self, features: &Features, n: usize) -> Vec<Neighbour> {
        let header = self.file.header();
        let source = || {
            let kind = header.kinds.iter().position(|k| k.kind == features.cell.kind())?;
            Some((kind, self.source_cell(kind, header.grid.floor(&features.cell)?)?))
        };
        let (Some((kind, cell)), Some(n)) = (source(), NonZero::new(n)) else {
            return Vec::new();
        };
        if !features.start.is_finite() {
            return Vec::new();
        }
        let first = self.file.samples(kind, cell).start;
        let query = Self::point(features.start, header.heading_radius);
        let hits = self.points(kind, cell).nearest(&query, n);
        hits.into_iter()
            .map(|(distance_sq, i)| Neighbour { distance_sq, cell, sample: first + i })
            .collect()
    }

    fn points(&self, kind: usize, cell: usize) -> &Points {
        self.cells[kind][cell].get_or_init(|| {
            let radius = self.file.header().heading_radius;
            let starts = self.file.samples(kind, cell).map(|i| self.file.start(kind, i));
            Points::new(starts.map(|s| Self::point(s, radius)).collect())
        })
    }
}

impl PoseSelector for KnnSelector {
    fn select(&self, features: &Features, _vehicle: &Vehicle, k: usize, out: &mut Vec<Pose>) {
        let header = self.file.header();
        let Some(kind) = header.kinds.iter().position(|h| h.kind == features.cell.kind()) else {
            return;
        };
        let first = out.len();
        let looked_at = if k > 1 { k.saturating_mul(Self::NEIGHBOURS_PER_POSE) } else { k };
        for neighbour in self.nearest(features, looked_at) {
            let pose = self.file.preparatory(kind, neighbour.sample);
            let known = |other: &Pose| {
                other.distance(pose) <= Self::SAME_POSITION
                    && signed_angle(other.heading, pose.heading).abs() <= Self::SAME_HEADING
            };
            if !out[first..].iter().any(known) {
                out.push(pose);
            }
            if out.len() - first == k {
                return;
            }
        }
    }

    fn manoeuvres(&self, stance: Stance, _vehicle: &Vehicle) -> Vec<Vec<Segment>> {
        let header = self.file.header();
        let Some(kind) = header.kinds.iter().position(|h| h.kind == stance.kind()) else {
            return Vec::new();
        };
        let known = header.kinds[kind].manoeuvres_for(stance, &header.grid);
        known.into_iter().map(|i| self.file.segments(kind, i).collect()).collect()
    }

    fn grid(&self, _kind: ParkingType) -> &Grid {
        &self.file.header().grid
    }

    fn kinds(&self) -> Vec<ParkingType> {
        self.file.header().kinds.iter().map(|k| k.kind).collect()
    }
}
