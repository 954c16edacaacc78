//! The file format `knn.bin`, version 4.
//!
//! All numbers are little-endian. Nothing needs alignment, so the bytes are used as they lie.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic `N3P-KNN` and a zero |
//! | 4 | format version |
//! | 4 | length of the header |
//! | 8 | length of the payload |
//! | 32 | SHA-256 of the 24 bytes above, the header and the payload |
//! | … | header: [`KnnHeader`] as JSON |
//! | … | payload: for each entry of [`KnnHeader::kinds`] six arrays |
//!
//! The arrays of a parking type: `cells + 1` offsets (u32), where cell `i` owns the samples
//! `offsets[i]..offsets[i + 1]`; the starts (3 × i16 each); which preparatory pose each sample has
//! (as many bytes as [`KindHeader::poses`] needs); the preparatory poses, since samples share them
//! (3 × 24-bit integer each); where the manoeuvres of the library begin among the segments
//! (`manoeuvres + 1` × u32); the segments (curvature in 1/m and signed length in m, 2 × f32
//! each). Positions count in `extent / 32767` metres for starts, which
//! only enter a distance, and in `extent / 8388607` metres for poses; headings in
//! π / 32767 and π / 8388607 radians. With an extent of 16 m a pose is exact to 1 µm and
//! 0.2 µrad, some thousand times below the planner's clearance margin
//! ([`crate::planners::Problem::MARGIN`]), so rounding does not take its free Reeds-Shepp
//! connection away. Manoeuvres are driven back from the goal, so they always end there.

use std::borrow::Cow;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::artefact::{ArtefactError, Fault};
use crate::curves::Segment;
use crate::files::sha256;
use crate::geometry::{Pose, signed_angle, wrap_angle};
use crate::vehicle::Vehicle;
use crate::world::cell::Grid;
use crate::world::{ParkingType, Stance};

/// First bytes of every `knn.bin`.
pub const MAGIC: [u8; 8] = *b"N3P-KNN\0";
/// The format version written and read by this program.
pub const VERSION: u32 = 4;

const PREAMBLE: usize = 56;
const CHECKSUM: Range<usize> = 24..56;
const START_BYTES: usize = 6;
const POSE_BYTES: usize = 9;
const SEGMENT_BYTES: usize = 8;
const START_STEPS: f64 = 32_767.0;
const POSE_STEPS: f64 = 8_388_607.0;

/// What a `knn.bin` says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnnHeader {
    /// The vehicle the samples were driven with.
    pub vehicle: Vehicle,
    /// The grid of cells.
    pub grid: Grid,
    /// Metres per radian of the metric's heading part; see [`super::knn`].
    pub heading_radius: f64,
    /// No coordinate exceeds this, metres; it scales the integers.
    pub extent: f64,
    /// The parking types, in the order of the payload.
    pub kinds: Vec<KindHeader>,
    /// SHA-256 of the data set, lower-case hexadecimal.
    pub data_sha256: String,
    /// Seed of the data set.
    pub seed: u64,
    /// Version of this crate at training.
    pub crate_version: String,
}

/// One parking type of a `knn.bin`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KindHeader {
    /// The parking type.
    pub kind: ParkingType,
    /// Number of cells of the grid.
    pub cells: usize,
    /// Number of samples.
    pub samples: usize,
    /// Number of different preparatory poses; [`encode`] counts them.
    pub poses: usize,
    /// Number of manoeuvres in the library.
    pub manoeuvres: usize,
    /// Number of segments of all manoeuvres.
    pub segments: usize,
    /// How many of the manoeuvres are for each of the grid's stances, in their order; none where all
    /// are for all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub manoeuvres_by_stance: Vec<usize>,
}

/// Manoeuvres of stances within this of a car's own may serve it, radians: two or three of the usual
/// grid.
const NEAR_STANCE: f64 = 15.001 * PI / 180.0;

impl KindHeader {
    /// The manoeuvres that may serve a car that stands so, those of most use first: of each near
    /// stance in turn.
    pub(super) fn manoeuvres_for(&self, stance: Stance, grid: &Grid) -> Vec<usize> {
        if self.manoeuvres_by_stance.is_empty() {
            return (0..self.manoeuvres).collect();
        }
        let mut end = 0;
        let each = self.manoeuvres_by_stance.iter().map(|count| {
            end += count;
            end - count..end
        });
        let is_near = |(of, _): &(Stance, Range<usize>)| {
            signed_angle(of.heading(), stance.heading()).abs() < NEAR_STANCE
        };
        let near = grid.stances(self.kind).into_iter().zip(each).filter(is_near);
        let near: Vec<_> = near.map(|(_, range)| range).collect();
        let most = near.iter().map(Range::len).max().unwrap_or(0);
        let of_rank = |rank| near.iter().filter_map(move |range| range.clone().nth(rank));
        (0..most).flat_map(of_rank).collect()
    }
}

/// One stored sample.
#[derive(Clone, Debug, PartialEq)]
pub struct KnnEntry {
    /// Index of its cell.
    pub cell: u32,
    /// Rear-axle start, spot frame.
    pub start: Pose,
    /// Rear-axle preparatory pose, spot frame.
    pub preparatory: Pose,
}

/// The samples and manoeuvres of one parking type.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnnEntries {
    /// The samples, sorted by cell; the order within a cell breaks ties between equally near
    /// neighbours.
    pub samples: Vec<KnnEntry>,
    /// The library: manoeuvres in driving order, each ending at the goal.
    pub manoeuvres: Vec<Vec<Segment>>,
}

/// The bytes of a file. `entries`: of each of [`KnnHeader::kinds`].
#[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
pub fn encode(mut header: KnnHeader, entries: &[KnnEntries]) -> Vec<u8> {
    let mut payload = Vec::new();
    let extent = header.extent;
    for (kind, KnnEntries { samples: entries, manoeuvres }) in header.kinds.iter_mut().zip(entries)
    {
        for cell in 0..=kind.cells {
            let offset = entries.partition_point(|e| (e.cell as usize) < cell) as u32;
            payload.extend(offset.to_le_bytes());
        }
        for e in entries {
            for v in steps(e.start, extent, START_STEPS) {
                payload.extend((v as i16).to_le_bytes());
            }
        }
        let mut poses: Vec<[i32; 3]> = Vec::new();
        let mut known = HashMap::new();
        let mut which = |e: &KnnEntry| {
            let pose = steps(e.preparatory, extent, POSE_STEPS);
            *known.entry(pose).or_insert_with(|| {
                poses.push(pose);
                poses.len() - 1
            })
        };
        let which: Vec<usize> = entries.iter().map(&mut which).collect();
        kind.poses = poses.len();
        for pose in which {
            payload.extend(&pose.to_le_bytes()[..index_bytes(poses.len())]);
        }
        for v in poses.as_flattened() {
            payload.extend(&v.to_le_bytes()[..3]);
        }
        let mut begin = 0_u32;
        for manoeuvre in manoeuvres {
            payload.extend(begin.to_le_bytes());
            begin += manoeuvre.len() as u32;
        }
        payload.extend(begin.to_le_bytes());
        for s in manoeuvres.iter().flatten() {
            payload.extend((s.curvature as f32).to_le_bytes());
            payload.extend((s.length as f32).to_le_bytes());
        }
    }
    let json = serde_json::to_vec(&header).expect("a header is plain data");
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    let sum = sha256(&[&bytes, &json, &payload]);
    bytes.extend(sum);
    bytes.extend(json);
    bytes.extend(payload);
    bytes
}

/// Bytes of a number below `count`.
fn index_bytes(count: usize) -> usize {
    let last = count.saturating_sub(1);
    (usize::BITS - last.leading_zeros()).div_ceil(8).max(1) as usize
}

/// A checked `knn.bin`, in memory.
#[derive(Debug)]
pub struct KnnFile {
    bytes: Cow<'static, [u8]>,
    path: PathBuf,
    header: Box<KnnHeader>,
    sections: Vec<Section>,
}

/// Where the arrays of one parking type begin in the file.
#[derive(Debug)]
struct Section {
    offsets: usize,
    starts: usize,
    which_pose: Indices,
    poses: usize,
    segment_begins: usize,
    segments: usize,
}

/// An array of numbers that take the same few bytes each.
#[derive(Clone, Copy, Debug)]
struct Indices {
    begin: usize,
    bytes: usize,
}

impl Indices {
    fn get(self, bytes: &[u8], i: usize) -> usize {
        let at = self.begin + self.bytes * i;
        bytes[at..at + self.bytes].iter().rev().fold(0, |n, byte| n << 8 | usize::from(*byte))
    }
}

impl KnnFile {
    /// Checks the content of the file at `path`. The checksum reads every byte anyway, and what is in
    /// memory stays as it was checked, whatever becomes of the file.
    pub fn new(path: &Path, bytes: Cow<'static, [u8]>) -> Result<Self, ArtefactError> {
        // What is compiled in is as whole as the program, and a test has checked it.
        let is_compiled_in = matches!(bytes, Cow::Borrowed(_));
        let (header, sections) = check(&bytes, is_compiled_in).map_err(|fault| fault.of(path))?;
        Ok(Self { bytes, path: path.to_owned(), header: Box::new(header), sections })
    }

    /// The file's header.
    pub fn header(&self) -> &KnnHeader {
        &self.header
    }

    /// The file itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The samples of a cell. `kind` is a position in [`KnnHeader::kinds`].
    pub fn samples(&self, kind: usize, cell: usize) -> Range<usize> {
        let at = self.sections[kind].offsets + 4 * cell;
        u32_at(&self.bytes, at) as usize..u32_at(&self.bytes, at + 4) as usize
    }

    /// The start of a sample, spot frame.
    pub fn start(&self, kind: usize, sample: usize) -> Pose {
        let at = self.sections[kind].starts + START_BYTES * sample;
        let bytes = &self.bytes[at..at + START_BYTES];
        let v = [0, 2, 4].map(|i| i32::from(i16::from_le_bytes([bytes[i], bytes[i + 1]])));
        pose(v, self.header.extent, START_STEPS)
    }

    /// The preparatory pose of a sample, spot frame.
    pub fn preparatory(&self, kind: usize, sample: usize) -> Pose {
        let section = &self.sections[kind];
        let at = section.poses + POSE_BYTES * section.which_pose.get(&self.bytes, sample);
        let bytes = &self.bytes[at..at + POSE_BYTES];
        // The sign sits in the third byte: place the three above an empty one and shift.
        let v =
            [0, 3, 6].map(|i| i32::from_le_bytes([0, bytes[i], bytes[i + 1], bytes[i + 2]]) >> 8);
        pose(v, self.header.extent, POSE_STEPS)
    }

    /// The motions of a manoeuvre, in driving order; they end at the goal.
    pub fn segments(&self, kind: usize, manoeuvre: usize) -> impl Iterator<Item = Segment> + '_ {
        let section = &self.sections[kind];
        let begin = |i: usize| u32_at(&self.bytes, section.segment_begins + 4 * i) as usize;
        (begin(manoeuvre)..begin(manoeuvre + 1)).map(|i| {
            let at = section.segments + SEGMENT_BYTES * i;
            Segment { curvature: f32_at(&self.bytes, at), length: f32_at(&self.bytes, at + 4) }
        })
    }
}

fn f32_at(bytes: &[u8], at: usize) -> f64 {
    f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
}

fn check(bytes: &[u8], is_compiled_in: bool) -> Result<(KnnHeader, Vec<Section>), Fault> {
    if bytes.is_empty() {
        return Err(Fault::Empty);
    }
    let got = bytes.len() as u64;
    if bytes.len() < MAGIC.len() || bytes[..MAGIC.len()] != MAGIC {
        return Err(Fault::NotAModel);
    }
    if bytes.len() < PREAMBLE {
        return Err(Fault::Length { expected: PREAMBLE as u64, got });
    }
    let found = u32_at(bytes, 8);
    if found != VERSION {
        return Err(Fault::Version { found, supported: VERSION });
    }
    let header_len = u32_at(bytes, 12) as usize;
    let payload_len = u64::from_le_bytes(bytes[16..24].try_into().expect("eight bytes"));
    let expected = (PREAMBLE + header_len) as u64;
    let expected = expected.saturating_add(payload_len);
    if got != expected {
        return Err(Fault::Length { expected, got });
    }
    if !is_compiled_in && sha256(&[&bytes[..CHECKSUM.start], &bytes[PREAMBLE..]]) != bytes[CHECKSUM]
    {
        return Err(Fault::Checksum);
    }
    let payload = PREAMBLE + header_len;
    let json = std::str::from_utf8(&bytes[PREAMBLE..payload]);
    let json = json.map_err(|e| Fault::Header(e.to_string()))?;
    let header: KnnHeader = serde_json::from_str(json).map_err(|e| Fault::Header(e.to_string()))?;
    let sections = sections(bytes, payload, &header).map_err(Fault::Header)?;
    Ok((header, sections))
}

/// Lays out the payload. The checksum has vouched for the bytes; this guards against
/// headers that were never right.
fn sections(bytes: &[u8], payload: usize, header: &KnnHeader) -> Result<Vec<Section>, String> {
    header.vehicle.validate().map_err(|e| e.to_string())?;
    header.grid.validate().map_err(|e| e.to_string())?;
    for (name, v) in [("heading_radius", header.heading_radius), ("extent", header.extent)] {
        if !(v.is_finite() && v > 0.0) {
            return Err(format!("{name} is {v}; expected a positive number"));
        }
    }
    let mut at = payload;
    let mut sections = Vec::new();
    for k in &header.kinds {
        let cells = header.grid.cell_count(k.kind);
        if k.cells != cells {
            return Err(format!("{}: expected {cells} cells, got {}", k.kind, k.cells));
        }
        let by_stance = &k.manoeuvres_by_stance;
        let fits = by_stance.len() == header.grid.stances(k.kind).len()
            && by_stance.iter().try_fold(0, |sum: usize, n| sum.checked_add(*n))
                == Some(k.manoeuvres);
        if !by_stance.is_empty() && !fits {
            return Err(format!("{}: the manoeuvres of its stances do not add up", k.kind));
        }
        let size = k
            .samples
            .checked_mul(START_BYTES + index_bytes(k.poses))
            .and_then(|n| n.checked_add(k.poses.checked_mul(POSE_BYTES)?))
            .and_then(|n| n.checked_add(4 * (cells + 1)))
            .and_then(|n| n.checked_add(k.manoeuvres.checked_add(1)?.checked_mul(4)?))
            .and_then(|n| n.checked_add(k.segments.checked_mul(SEGMENT_BYTES)?))
            .filter(|n| *n <= bytes.len() - at)
            .ok_or_else(|| format!("{}: {} samples do not fit", k.kind, k.samples))?;
        let starts = at + 4 * (cells + 1);
        let which_pose =
            Indices { begin: starts + START_BYTES * k.samples, bytes: index_bytes(k.poses) };
        let poses = which_pose.begin + which_pose.bytes * k.samples;
        let segment_begins = poses + POSE_BYTES * k.poses;
        let segments = segment_begins + 4 * (k.manoeuvres + 1);
        let section = Section { offsets: at, starts, which_pose, poses, segment_begins, segments };
        let offset = |i: usize| u32_at(bytes, at + 4 * i) as usize;
        let rising = (0..cells).all(|i| offset(i) <= offset(i + 1));
        if offset(0) != 0 || offset(cells) != k.samples || !rising {
            return Err(format!("{}: the offsets of the cells do not rise in order", k.kind));
        }
        if !(0..k.samples).all(|i| which_pose.get(bytes, i) < k.poses) {
            return Err(format!("{}: a sample has a pose beyond the last", k.kind));
        }
        let begin = |i: usize| u32_at(bytes, segment_begins + 4 * i) as usize;
        let rising = (0..k.manoeuvres).all(|i| begin(i) <= begin(i + 1));
        if begin(0) != 0 || begin(k.manoeuvres) != k.segments || !rising {
            return Err(format!("{}: the manoeuvres do not rise in order", k.kind));
        }
        let value = |i: usize| f32_at(bytes, segments + 4 * i);
        let drivable = |i: usize| value(2 * i).is_finite() && value(2 * i + 1).is_finite();
        if !(0..k.segments).all(drivable) {
            return Err(format!("{}: a segment of a manoeuvre is not finite", k.kind));
        }
        sections.push(section);
        at += size;
    }
    if at != bytes.len() {
        return Err(format!("{} bytes are left over", bytes.len() - at));
    }
    Ok(sections)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn steps(pose: Pose, extent: f64, steps: f64) -> [i32; 3] {
    let heading = wrap_angle(pose.heading) / PI;
    [pose.x / extent, pose.y / extent, heading].map(|v| (v * steps).round() as i32)
}

fn pose([x, y, heading]: [i32; 3], extent: f64, steps: f64) -> Pose {
    let length = extent / steps;
    Pose::new(f64::from(x) * length, f64::from(y) * length, f64::from(heading) * (PI / steps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_keep_their_micrometres() {
        for p in [Pose::new(-15.99, 6.5, PI), Pose::new(3.1, -0.2, -3.1), Pose::default()] {
            let fine = pose(steps(p, 16.0, POSE_STEPS), 16.0, POSE_STEPS);
            assert!(fine.distance(p) < 1.5e-6, "{p:?} {fine:?}");
            assert!(signed_angle(fine.heading, p.heading).abs() < 2e-7, "{p:?} {fine:?}");
            let coarse = pose(steps(p, 16.0, START_STEPS), 16.0, START_STEPS);
            assert!(coarse.distance(p) < 4e-4, "{p:?} {coarse:?}");
        }
    }

    #[test]
    fn samples_share_their_poses_whatever_their_number() {
        for (count, bytes) in [(0, 1), (1, 1), (256, 1), (257, 2), (65_536, 2), (65_537, 3)] {
            assert_eq!(index_bytes(count), bytes, "{count}");
        }
        let header = {
            let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/knn.bin");
            let bytes = Cow::Owned(std::fs::read(&shipped).unwrap());
            KnnFile::new(&shipped, bytes).unwrap().header().clone()
        };
        for count in [1, 256, 257, 300] {
            let pose = |i: usize| Pose::new(0.01 * (i % count) as f64, 1.0, 0.5);
            let sample =
                |i: usize| KnnEntry { cell: 0, start: Pose::default(), preparatory: pose(i) };
            let samples: Vec<_> = (0..1000).map(sample).collect();
            let kind = KindHeader {
                samples: samples.len(),
                manoeuvres: 0,
                segments: 0,
                manoeuvres_by_stance: Vec::new(),
                ..header.kinds[0].clone()
            };
            let header = KnnHeader { kinds: vec![kind], ..header.clone() };
            let entries = KnnEntries { samples, manoeuvres: Vec::new() };
            let path = Path::new("knn.bin");
            let file = KnnFile::new(path, Cow::Owned(encode(header, &[entries]))).unwrap();
            assert_eq!(file.header().kinds[0].poses, count);
            for i in 0..1000 {
                assert!(file.preparatory(0, i).distance(pose(i)) < 1.5e-6, "{i} of {count}");
            }
        }
    }

    /// Whoever changes the file later, by renaming or in place, changes nothing here.
    #[test]
    fn a_file_that_is_cut_off_after_it_was_opened_stays_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("knn.bin");
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/knn.bin");
        std::fs::copy(&shipped, &path).unwrap();
        let open =
            |path: &Path| KnnFile::new(path, Cow::Owned(std::fs::read(path).unwrap())).unwrap();
        let (file, expected) = (open(&path), open(&shipped));
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(0).unwrap();
        for (kind, k) in expected.header().kinds.iter().enumerate() {
            let last = k.samples - 1;
            assert_eq!(file.samples(kind, 0), expected.samples(kind, 0));
            assert_eq!(file.start(kind, last), expected.start(kind, last));
            assert_eq!(file.preparatory(kind, last), expected.preparatory(kind, last));
            let same = file.segments(kind, 0).eq(expected.segments(kind, 0));
            assert!(same, "{}", k.kind);
        }
    }
}
