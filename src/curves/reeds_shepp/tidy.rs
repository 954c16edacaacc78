//! Words without motions that only mend rounding.
//!
//! A start on an earlier plan lies on a curve of few segments, up to rounding; the formulas then
//! find a word with one more segment, of millimetres or less. Left out, the others are refitted.

use nalgebra::{DMatrix, DVector};

use super::Word;
use crate::curves::Segment;
use crate::geometry::{Pose, signed_angle};

/// What the refitted word may miss its end by, metres and radians.
const EXACT: f64 = 3e-7;

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
            if error.amax() < EXACT {
                return Some(word);
            }
            if word.len == 0 || error.amax() > 10.0 * least {
                return None;
            }
            let step =
                jacobian(&word, from, to, &error).svd(true, true).solve(&error, 1e-9).ok()?;
            for (s, change) in word.segments[..word.len].iter_mut().zip(step.iter()) {
                let gear = s.gear();
                s.length -= change;
                if s.gear() != gear {
                    return None;
                }
            }
        }
        None
    }
}

/// How far the word ends from `to`.
fn miss(word: &Word, from: Pose, to: Pose) -> DVector<f64> {
    let end = word.segments().iter().fold(from, |pose, s| s.end(pose));
    DVector::from_vec(vec![end.x - to.x, end.y - to.y, signed_angle(to.heading, end.heading)])
}

/// How the miss changes with the length of each segment.
fn jacobian(word: &Word, from: Pose, to: Pose, error: &DVector<f64>) -> DMatrix<f64> {
    const H: f64 = 1e-6;
    let column = |i: usize| {
        let mut longer = *word;
        let s = longer.segments[i];
        longer.segments[i] = Segment { length: s.length + H, ..s };
        (miss(&longer, from, to) - error) / H
    };
    DMatrix::from_columns(&(0..word.len).map(column).collect::<Vec<_>>())
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
                assert!(miss(&w, from, to).amax() < EXACT && w.shortest_segment() > 0.5 * least);
            }
        }
        // Now and then what mends the rounding is longer than the shortest motion.
        assert!(missed < 200, "{missed} of 20,000");
    }
}
