//! A motion of constant curvature.

use crate::geometry::Pose;
use crate::vehicle::Gear;

/// A motion of the rear axle along a circular arc or a straight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// Signed curvature, 1/m; positive turns left when driving forward.
    pub curvature: f64,
    /// Signed length, metres; negative drives backward.
    pub length: f64,
}

impl Segment {
    /// A straight of signed `length` metres.
    pub const fn straight(length: f64) -> Self {
        Self { curvature: 0.0, length }
    }

    /// The direction of motion.
    pub fn gear(self) -> Gear {
        Gear::of(self.length)
    }

    /// Change of heading over the whole segment, radians.
    pub fn turn(self) -> f64 {
        self.curvature * self.length
    }

    /// The pose after driving the whole segment from `start`. The heading is not wrapped.
    pub fn end(self, start: Pose) -> Pose {
        self.at(start, self.length)
    }

    /// The pose after the signed arc length `s` of this segment.
    pub fn at(self, start: Pose, s: f64) -> Pose {
        let turn = self.curvature * s;
        let (sin, cos) = start.sin_cos();
        let [forward, left] = self.way(s, turn.sin_cos());
        Pose::new(
            start.x + forward * cos - left * sin,
            start.y + forward * sin + left * cos,
            start.heading + turn,
        )
    }

    /// Where the signed arc length `s` leads, seen from the start: metres ahead and to the left.
    /// `turned`: sine and cosine of the turn on the way.
    pub(crate) fn way(self, s: f64, turned: (f64, f64)) -> [f64; 2] {
        let turn = self.curvature * s;
        if turn.abs() > 1e-6 {
            let (sin, cos) = turned;
            [sin / self.curvature, (1.0 - cos) / self.curvature]
        } else {
            // Series of sin(κs)/κ and (1 − cos κs)/κ: exact to 1e-12 here.
            [s * (1.0 - turn * turn / 6.0), s * turn / 2.0]
        }
    }

    /// The same motion driven in the opposite direction.
    pub fn reversed(self) -> Self {
        Self { curvature: self.curvature, length: -self.length }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn a_quarter_circle_and_back() {
        let s = Segment { curvature: 0.5, length: PI };
        let end = s.end(Pose::default());
        assert!(end.distance(Pose::new(2.0, 2.0, 0.0)) < 1e-12);
        assert!((end.heading - FRAC_PI_2).abs() < 1e-12);
        assert!(s.reversed().end(end).distance(Pose::default()) < 1e-12);
    }

    #[test]
    fn the_series_meets_the_formula() {
        let start = Pose::new(1.0, 2.0, 0.7);
        let near = |k| Segment { curvature: k, length: 1.0 }.end(start);
        assert!(near(0.999e-6).distance(near(1.001e-6)) < 1e-8);
    }
}
