//! Words without motions that only mend rounding.
//!
//! A start on an earlier plan lies on a curve of few segments, up to rounding; the formulas then
//! find a word with one more segment, of millimetres or less. Left out, the others are refitted.

use super::Word;
use crate::curves::Segment;
use crate::curves::least_norm::{self, Move};
use crate::geometry::{Pose, signed_angle};

/// What the refitted word may miss its end by, metres and radians.
const EXACT: f64 = 3e-7;
/// Few segments do not lead everywhere; their steps are solved with so much more on the diagonal.
const DAMPING: f64 = 1e-12;

impl Word {
    /// This word from `from` to `to` without its segments shorter than `least` metres, if the
    /// others can be refitted to end there as well.
    pub fn without_shorter_than(&self, least: f64, from: Pose, to: Pose) -> Option<Word> {
        let kept = self.segments().iter().copied().filter(|s| s.length.abs() >= least);
        let mut word = Word::default();
        for s in kept {
            match word.segments[..word.len].last_mut() {
                Some(last) if last.curvature == s.curvature && last.gear() == s.gear() => {
                    last.length += s.length;
                }
                _ => {
                    word.segments[word.len] = s;
                    word.len += 1;
                }
            }
        }
        for _ in 0..4 {
            let error = miss(&word, from, to);
            if largest(error) < EXACT {
                return Some(word);
            }
            if word.len == 0 || largest(error) > 10.0 * least {
                return None;
            }
            let columns = jacobian(&word, from, to, error);
            let moves = columns[..word.len].iter().copied();
            let by = least_norm::multipliers(moves, error, DAMPING, 0.0)?;
            for (s, column) in word.segments[..word.len].iter_mut().zip(columns) {
                let gear = s.gear();
                s.length -= least_norm::dot(column, by);
                if s.gear() != gear {
                    return None;
                }
            }
        }
        None
    }
}

/// How far the word ends from `to`.
fn miss(word: &Word, from: Pose, to: Pose) -> Move {
    let end = word.segments().iter().fold(from, |pose, s| s.end(pose));
    [end.x - to.x, end.y - to.y, signed_angle(to.heading, end.heading)]
}

fn largest(miss: Move) -> f64 {
    miss.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// How the miss changes with the length of each segment, as far as there are segments.
fn jacobian(word: &Word, from: Pose, to: Pose, error: Move) -> [Move; Word::MOST] {
    const H: f64 = 1e-6;
    let mut columns = [[0.0; 3]; Word::MOST];
    for (i, column) in columns[..word.len].iter_mut().enumerate() {
        let mut longer = *word;
        let s = longer.segments[i];
        longer.segments[i] = Segment { length: s.length + H, ..s };
        let moved = miss(&longer, from, to);
        *column = [0, 1, 2].map(|k| (moved[k] - error[k]) / H);
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::super::words;
    use super::*;
    use crate::rng::{Stream, rng};
    use rand::RngExt;

    /// From any pose on a curve of few segments, rounded, the rest of it is among the words.
    #[test]
    fn the_rest_of_a_curve_is_found_from_any_pose_on_it() {
        let mut rng = rng(9, Stream::Start, 0);
        let (radius, least) = (4.057, 0.01);
        let mut missed = 0;
        for _ in 0..20_000 {
            let mut r = |a: f64| rng.random_range(-a..a);
            let (start, to) =
                (Pose::new(r(5.0), r(5.0), r(3.0)), Pose::new(r(9.0), r(9.0), r(3.0)));
            let mut out = Vec::new();
            words(start, to, radius, &mut out);
            let by_length = |a: &&Word, b: &&Word| a.length().total_cmp(&b.length());
            let curve = *out.iter().min_by(by_length).unwrap();
            // Somewhere on it, as far as numbers are passed on.
            let (mut from, mut length) = (start, curve.length());
            let mut driven = r(1.0).abs() * length;
            for s in curve.segments() {
                let part = driven.min(s.length.abs());
                from = s.at(from, part.copysign(s.length));
                (driven, length) = (driven - part, length - part);
            }
            let from = Pose::new(from.x + r(3e-8), from.y + r(3e-8), from.heading + r(3e-8));
            out.clear();
            words(from, to, radius, &mut out);
            let tidy = |w: &Word| {
                let tidied = if w.shortest_segment() < least {
                    w.without_shorter_than(least, from, to)
                } else {
                    Some(*w)
                };
                tidied.is_some_and(|w| w.length() <= length + 1e-3)
            };
            // The last centimetres are shorter than any motion worth driving.
            if length > 0.1 && !out.iter().any(tidy) {
                missed += 1;
            }
            for w in out.iter().filter_map(|w| w.without_shorter_than(least, from, to)) {
                assert!(largest(miss(&w, from, to)) < EXACT && w.shortest_segment() > 0.5 * least);
            }
        }
        // Now and then what mends the rounding is longer than the shortest motion.
        assert!(missed < 200, "{missed} of 20,000");
    }
}
