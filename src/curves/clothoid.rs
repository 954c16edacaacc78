//! A motion of steadily changing curvature.

use super::Segment;
use crate::geometry::Pose;
use crate::vehicle::Gear;

/// A motion of the rear axle whose curvature changes steadily along the way: a clothoid, and an arc or a
/// straight where it does not change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clothoid {
    /// Signed curvature where it begins, 1/m; positive turns left when driving forward.
    pub from: f64,
    /// Signed curvature where it ends, 1/m.
    pub to: f64,
    /// Signed length, metres; negative drives backward.
    pub length: f64,
}

/// Nodes and weights of Gauss-Legendre quadrature with five points on [−1, 1]: exact to 1e-15 of the
/// length where the heading turns by no more than [`Clothoid::PIECE`].
const NODES: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

impl Clothoid {
    /// How far the heading may turn in one step of the quadrature, radians.
    const PIECE: f64 = 0.5;

    /// The direction of motion.
    pub fn gear(self) -> Gear {
        Gear::of(self.length)
    }

    /// Whether the curvature stays the same: an arc or a straight.
    pub fn is_arc(self) -> bool {
        self.from == self.to
    }

    /// Change of heading over the whole motion, radians.
    pub fn turn(self) -> f64 {
        f64::midpoint(self.from, self.to) * self.length
    }

    /// |change of curvature| per metre, 1/m².
    pub fn sharpness(self) -> f64 {
        if self.is_arc() { 0.0 } else { (self.to - self.from).abs() / self.length.abs() }
    }

    /// The larger |curvature| of both ends, 1/m: nowhere it is larger.
    pub fn max_abs_curvature(self) -> f64 {
        self.from.abs().max(self.to.abs())
    }

    /// Curvature after the signed arc length `s`, 1/m.
    pub fn curvature(self, s: f64) -> f64 {
        if self.is_arc() {
            self.from
        } else {
            self.from + (self.to - self.from) * (s / self.length)
        }
    }

    /// The pose after driving the whole motion from `start`. The heading is not wrapped.
    pub fn end(self, start: Pose) -> Pose {
        self.at(start, self.length)
    }

    /// The pose after the signed arc length `s` of this motion.
    pub fn at(self, start: Pose, s: f64) -> Pose {
        if self.is_arc() {
            return Segment { curvature: self.from, length: self.length }.at(start, s);
        }
        let (sin, cos) = start.sin_cos();
        let [ahead, left, turn] = self.part(s).way();
        Pose::new(
            start.x + ahead * cos - left * sin,
            start.y + ahead * sin + left * cos,
            start.heading + turn,
        )
    }

    /// The first signed length `s` of it.
    pub fn part(self, s: f64) -> Self {
        Self { from: self.from, to: self.curvature(s), length: s }
    }

    /// Where it leads, seen from its start: metres ahead and to the left, and the turn in radians.
    pub(super) fn way(self) -> [f64; 3] {
        let Self { from, to, length } = self;
        if length == 0.0 {
            return [0.0; 3];
        }
        if self.is_arc() {
            let turn = self.turn();
            let [ahead, left] = Segment { curvature: from, length }.way(length, turn.sin_cos());
            return [ahead, left, turn];
        }
        let pieces = (self.max_abs_curvature() * length.abs() / Self::PIECE).ceil().max(1.0);
        let (h, slope) = (length / pieces, (to - from) / length);
        let (mut ahead, mut left) = (0.0, 0.0);
        for i in 0..pieces as u32 {
            let middle = h * (f64::from(i) + 0.5);
            for (node, weight) in NODES {
                let s = middle + 0.5 * h * node;
                let (sin, cos) = sin_cos(s * (from + 0.5 * slope * s));
                ahead += weight * cos;
                left += weight * sin;
            }
        }
        [0.5 * h * ahead, 0.5 * h * left, self.turn()]
    }
}

/// Sine and cosine; of the small angles that clothoids turn by their series, to the last digit.
#[inline]
fn sin_cos(x: f64) -> (f64, f64) {
    if x.abs() > Clothoid::PIECE {
        return x.sin_cos();
    }
    let y = x * x;
    let sin =
        1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0))));
    let cos = 1.0
        - y / 2.0
            * (1.0
                - y / 12.0
                    * (1.0 - y / 30.0 * (1.0 - y / 56.0 * (1.0 - y / 90.0 * (1.0 - y / 132.0)))));
    (x * sin, cos)
}

impl From<Segment> for Clothoid {
    fn from(s: Segment) -> Self {
        Self { from: s.curvature, to: s.curvature, length: s.length }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bicycle in many steps.
    fn integrated(c: Clothoid, start: Pose) -> Pose {
        let n = 200_000;
        let h = c.length / f64::from(n);
        (0..n).fold(start, |p, i| {
            let s = h * (f64::from(i) + 0.5);
            let (sin, cos) =
                (start.heading + c.from * s + (c.to - c.from) * s * s / (2.0 * c.length)).sin_cos();
            Pose::new(p.x + h * cos, p.y + h * sin, p.heading + h * c.curvature(s))
        })
    }

    #[test]
    fn it_leads_where_the_bicycle_goes() {
        let start = Pose::new(1.0, -2.0, 0.7);
        for (from, to, length) in
            [(0.0, 0.25, 1.2), (0.25, -0.25, -2.0), (-0.1, 0.4, 9.0), (5.0, 0.0, -0.3)]
        {
            let c = Clothoid { from, to, length };
            let (end, expected) = (c.end(start), integrated(c, start));
            assert!(end.distance(expected) < 1e-8, "{c:?} {end:?} {expected:?}");
            assert!((end.heading - expected.heading).abs() < 1e-9);
            let halfway = c.part(0.4 * length).end(start);
            assert!(c.at(start, 0.4 * length).distance(halfway) < 1e-12);
            let rest = Clothoid { from: c.curvature(0.4 * length), to, length: 0.6 * length };
            assert!(rest.end(halfway).distance(end) < 1e-9);
        }
    }

    #[test]
    fn the_series_are_sine_and_cosine() {
        for i in -50..=50 {
            let x = f64::from(i) / 100.0;
            let ((sin, cos), (s, c)) = (sin_cos(x), x.sin_cos());
            assert!((sin - s).abs() < 2e-14 && (cos - c).abs() < 2e-14, "{x}");
        }
    }

    #[test]
    fn an_arc_is_a_segment() {
        let s = Segment { curvature: 0.2, length: -3.0 };
        let start = Pose::new(1.0, 2.0, 0.3);
        assert_eq!(Clothoid::from(s).end(start), s.end(start));
    }
}
