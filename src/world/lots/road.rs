//! The way between two rows, straight or a gentle bend, as coordinates.

use crate::geometry::{Polygon, Pose, Vec2};

/// Stations `s` run along the edge of the target's row, offsets `d` across the road to its left:
/// that row lies at `d < 0`, the lane from 0 to its width. The target's mouth is at `s = 0`.
#[derive(Clone, Copy)]
pub(super) struct Road {
    /// Of the edge, 1/m; positive bends away from the target's row.
    pub curvature: f64,
}

impl Road {
    /// Longest chord of a bend, metres.
    const CHORD: f64 = 2.0;

    /// The pose at `(s, d)`, `turn` radians from the road's direction there.
    pub fn at(&self, s: f64, d: f64, turn: f64) -> Pose {
        let bend = self.curvature * s;
        // The chord of an arc: sin(x)/x where the arc vanishes, too.
        let chord = if bend.abs() < 1e-9 { s } else { s * (bend / 2.0).sin() / (bend / 2.0) };
        let edge = Pose::new(chord * (bend / 2.0).cos(), chord * (bend / 2.0).sin(), bend);
        edge.compose(Pose::new(0.0, d, turn))
    }

    /// The point at `(s, d)`.
    pub fn point(&self, s: f64, d: f64) -> Vec2 {
        self.at(s, d, 0.0).position()
    }

    /// Points along the road from one station to another, at the offset `d`.
    pub fn along(&self, from: f64, to: f64, d: f64) -> Vec<Vec2> {
        let straight = self.curvature == 0.0;
        let n = if straight { 1 } else { ((to - from).abs() / Self::CHORD).ceil().max(1.0) as u32 };
        let station = |i| from + (to - from) * f64::from(i) / f64::from(n);
        (0..=n).map(|i| self.point(station(i), d)).collect()
    }

    /// What lies between two stations and two offsets.
    pub fn strip(&self, s: [f64; 2], d: [f64; 2]) -> Polygon {
        let mut outline = self.along(s[0], s[1], d[0]);
        outline.extend(self.along(s[1], s[0], d[1]));
        Polygon::new(outline).expect("four or more vertices")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_keeps_its_distance_from_the_centre() {
        let road = Road { curvature: 0.02 };
        for (s, d) in [(-20.0, -3.0), (0.0, 1.0), (7.0, 4.0)] {
            let pose = road.at(s, d, 0.0);
            let from_centre = (pose.position() - Vec2::new(0.0, 50.0)).norm();
            assert!((from_centre - (50.0 - d)).abs() < 1e-9, "{s} {d}");
            assert!((pose.heading - 0.02 * s).abs() < 1e-9, "{s} {d}");
        }
        let straight = Road { curvature: 0.0 }.at(-3.0, 2.0, 0.5);
        assert_eq!(straight, Pose::new(-3.0, 2.0, 0.5));
    }
}
