//! Making a path smooth: clothoids wherever its curvature jumps while the car drives.
//!
//! Fraichard and Scheuer ("From Reeds and Shepp's to continuous-curvature paths", IEEE T-RO 20(6), 2004)
//! put between a straight and an arc a clothoid, on which the wheels turn steadily. Here a path keeps its
//! straights and turns, each turn with its clothoids at its ends, and their lengths are fitted so that
//! the path ends where it did ([`smooth`]): unknowns as many as straights and turns, three equations,
//! Newton's method, the smallest change of lengths first. Where the car stops to change gear the wheels may
//! turn at standstill, if that is allowed: no clothoid is needed there.

mod fit;
mod turn;

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::smooth_path::jumps;
use super::{Clothoid, Path, Segment, SmoothPath};
use crate::geometry::Pose;
use turn::Piece;

/// Where the steering wheel may be turned while the car stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StandstillSteering {
    /// Nowhere: the curvature is continuous through changes of gear, too.
    Never,
    /// Where the car changes gear, and at the start where nothing else fits.
    AtChanges,
    /// Wherever curvature jumps: paths are arcs and straights, as in the paper.
    #[default]
    Anywhere,
}

impl StandstillSteering {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Never, Self::AtChanges, Self::Anywhere];

    /// The name in files and arguments.
    pub fn name(self) -> &'static str {
        match self {
            Self::Never => "never",
            Self::AtChanges => "at-changes",
            Self::Anywhere => "anywhere",
        }
    }
}

impl fmt::Display for StandstillSteering {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for StandstillSteering {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|s| s.name() == text);
        found.ok_or_else(|| format!("expected never, at-changes or anywhere, not {text:?}"))
    }
}

/// How a path is made smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing<'a> {
    /// The curvature that the wheels stand for at the start, 1/m.
    pub begin: f64,
    /// Whether the wheels may turn at the start, before the car moves.
    pub turned_at_start: bool,
    /// Whether they may turn where the gear changes.
    pub turned_at_changes: bool,
    /// |Change of curvature| per metre of the clothoids of each run, the part of a path from one change of
    /// gear to the next, 1/m².
    pub sharpness: &'a [f64],
    /// The least length of the straight that the path ends with, metres; 0 for no more than straight wheels there.
    /// `None` for any end.
    pub last_straight: Option<f64>,
}

/// `path` with clothoids in place of its jumps of curvature, from the same start to `goal`; `None` where
/// its straights and turns cannot be fitted.
///
/// Nothing is asked of obstacles. The sharpness of runs beyond those given is that of the last one given.
pub fn smooth(path: &Path, goal: Pose, smoothing: &Smoothing) -> Option<SmoothPath> {
    let unwinding = unwinding(path, smoothing);
    let mut pieces = pieces(path, smoothing);
    if !fit::fit(&mut pieces, unwinding.end(path.start), goal) {
        return None;
    }
    let mut motions: Vec<Clothoid> = Vec::with_capacity(2 * pieces.len() + 1);
    for motion in std::iter::once(unwinding).chain(pieces.iter().flat_map(Piece::motions)) {
        match motions.last_mut() {
            _ if motion.length.abs() < 1e-9 => {}
            Some(last)
                if last.is_arc()
                    && motion.is_arc()
                    && last.to == motion.from
                    && last.gear() == motion.gear() =>
            {
                last.length += motion.length;
            }
            _ => motions.push(motion),
        }
    }
    Some(SmoothPath { start: path.start, begin: smoothing.begin, motions })
}

/// The curvature with which the first turn begins, where that is to the side to which the wheels stand already.
fn begun(first: Segment, smoothing: &Smoothing) -> f64 {
    /// Angles that were curvatures once differ by rounding.
    const ROUNDING: f64 = 1e-9;
    let (begin, most) = (smoothing.begin, first.curvature.abs());
    let goes_on = begin * first.curvature > 0.0 && begin.abs() <= most * (1.0 + ROUNDING);
    if goes_on { begin.abs().min(most) } else { 0.0 }
}

/// The clothoid on which the wheels become straight at the start, where they may not turn before; of no length else.
fn unwinding(path: &Path, smoothing: &Smoothing) -> Clothoid {
    let Some(&first) = path.segments.first() else { return Clothoid::default() };
    let begin = smoothing.begin;
    if smoothing.turned_at_start || begin == 0.0 || begun(first, smoothing) > 0.0 {
        return Clothoid::default();
    }
    let length = first.gear().sign() * begin.abs() / smoothing.sharpness[0];
    Clothoid { from: begin, to: 0.0, length }
}

/// The straights and turns of `path`, and straights of no length wherever the wheels are straight between two
/// turns: one more length to fit.
fn pieces(path: &Path, smoothing: &Smoothing) -> Vec<Piece> {
    // Of curvatures that differ by rounding, one.
    let mut segments: Vec<Segment> = Vec::with_capacity(path.segments.len());
    for &s in &path.segments {
        match segments.last_mut() {
            Some(last) if last.gear() == s.gear() && !jumps(last.curvature, s.curvature) => {
                last.length += s.length;
            }
            _ => segments.push(s),
        }
    }
    let mut pieces = Vec::with_capacity(2 * segments.len() + 1);
    // What the turns on both sides of a border agree on.
    let shared = |a: f64, b: f64| if a * b > 0.0 { a.abs().min(b.abs()) } else { 0.0 };
    let mut run = 0;
    for (i, s) in segments.iter().enumerate() {
        run += usize::from(i > 0 && segments[i - 1].gear() != s.gear());
        let border = |neighbour: Option<usize>| {
            let other = segments[neighbour?];
            let free = other.gear() != s.gear() && smoothing.turned_at_changes;
            (!free).then(|| shared(other.curvature, s.curvature))
        };
        let begin = match i {
            0 => (!smoothing.turned_at_start).then(|| begun(*s, smoothing)),
            _ => border(Some(i - 1)),
        };
        let is_last = i + 1 == segments.len();
        let last_straight = smoothing.last_straight.filter(|_| is_last);
        let end = match last_straight {
            Some(_) => Some(0.0),
            None => border((!is_last).then_some(i + 1)),
        };
        let gear = s.gear().sign();
        let sharpness = smoothing.sharpness[run.min(smoothing.sharpness.len() - 1)];
        let straight =
            Piece { gear, curvature: 0.0, ends: [None; 2], sharpness, floor: 0.0, value: 0.0 };
        let floor = last_straight.unwrap_or(0.0);
        if s.curvature == 0.0 {
            pieces.push(Piece { value: s.length.abs().max(floor), floor, ..straight });
            continue;
        }
        let is_turn = |p: &Piece| !p.is_straight() || p.gear != gear;
        if begin == Some(0.0) && pieces.last().is_none_or(is_turn) {
            pieces.push(straight);
        }
        let (curvature, ends) = (s.curvature, [begin, end]);
        let turn = Piece { curvature, ends, value: s.turn().abs(), ..straight };
        pieces.push(Piece { value: turn.value.max(turn.least()), ..turn });
        let changes = segments.get(i + 1).is_some_and(|next| next.gear() != s.gear());
        if end == Some(0.0) && (changes || last_straight.is_some()) {
            pieces.push(Piece { value: floor, floor, ..straight });
        }
    }
    pieces
}
