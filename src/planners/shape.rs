//! The shape of paths that are to be driven: no move shorter than need be, and straight in at the end.

use super::Problem;
use crate::curves::{Path, Segment};

/// What is asked of the shape of a path, where there is room for it. What is left out is as usual: nothing of
/// arcs, 0.3 m and 0.5 m of paths that a default vehicle is to follow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shape {
    /// The least length of a move, from one change of gear to the next, metres.
    pub least_move: Option<f64>,
    /// The least length of the straight that a path ends with, metres.
    pub last_straight: Option<f64>,
}

impl Shape {
    /// Nothing is asked.
    pub const ANY: Self = Self { least_move: Some(0.0), last_straight: Some(0.0) };

    /// The longest of each that can be asked for, metres.
    pub const MOST: f64 = 5.0;
}

/// `path` with its short moves made longer, each where there is room: the car drives on beyond the change of
/// gear after it, or else begins farther back before it, and comes the same way back.
pub(super) fn lengthened(problem: &Problem, path: &Path, least: f64) -> Path {
    let mut runs: Vec<Vec<Segment>> = Vec::new();
    for &s in &path.segments {
        match runs.last_mut() {
            Some(run) if run[0].gear() == s.gear() => run.push(s),
            _ => runs.push(vec![s]),
        }
    }
    let length = |run: &[Segment]| run.iter().map(|s| s.length.abs()).sum::<f64>();
    let mut from = path.start;
    for i in 0..runs.len() {
        let end = runs[i].iter().fold(from, |pose, s| s.end(pose));
        let short = least - length(&runs[i]);
        // A rounding more, so that it is not short once it is driven.
        let more = |s: Segment| Segment { length: (short * (1.0 + 1e-9)).copysign(s.length), ..s };
        if short > 0.0 {
            let [first, last] = [runs[i][0], runs[i][runs[i].len() - 1]].map(more);
            if i + 1 < runs.len() && problem.collision.segment_is_free(end, last) {
                runs[i].push(last);
                runs[i + 1].insert(0, last.reversed());
            } else if i > 0 && problem.collision.segment_is_free(from, first.reversed()) {
                runs[i - 1].push(first.reversed());
                runs[i].insert(0, first);
            }
        }
        // What was driven on is driven back before the next move begins where it did.
        from = end;
    }
    Path::new(path.start, runs.into_iter().flatten())
}

/// Length of the straight that `path` ends with, metres.
pub(super) fn ended_straight(path: &Path) -> f64 {
    let gear = path.segments.last().map(|s| s.gear());
    let straight = |s: &&Segment| s.curvature == 0.0 && Some(s.gear()) == gear;
    path.segments.iter().rev().take_while(straight).map(|s| s.length.abs()).sum()
}
