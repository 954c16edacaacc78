//! The region the rear axle stays in.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::curves::{Clothoid, Segment};
use crate::geometry::{Aabb, Pose, Vec2};

/// A convex quadrilateral as half-planes `normal · p ≤ offset`, normals of length one.
#[derive(Clone, Debug)]
pub(super) struct ConvexBounds {
    sides: [(Vec2, f64); 4],
    aabb: Aabb,
}

impl ConvexBounds {
    /// From corners in counter-clockwise order.
    pub fn new(corners: [Vec2; 4]) -> Self {
        let side = |i: usize| {
            let d = (corners[(i + 1) % 4] - corners[i]).normalize();
            let normal = Vec2::new(d.y, -d.x);
            (normal, normal.dot(&corners[i]) + 1e-9)
        };
        Self { sides: [side(0), side(1), side(2), side(3)], aabb: Aabb::around(corners) }
    }

    pub fn aabb(&self) -> Aabb {
        self.aabb
    }

    pub fn contains(&self, p: Vec2) -> bool {
        self.sides.iter().all(|(n, offset)| n.dot(&p) <= *offset)
    }

    /// Whether the rear axle stays inside all along `segment`.
    pub fn contains_motion(&self, start: Pose, segment: Segment) -> bool {
        // Within the length of the motion no side is ever reached.
        let reach = segment.length.abs();
        let far = |(n, offset): &(Vec2, f64)| n.dot(&start.position()) + reach <= *offset;
        if self.sides.iter().all(far) {
            return true;
        }
        let end = segment.end(start).position();
        if !(self.contains(start.position()) && self.contains(end)) {
            return false;
        }
        let turn = segment.turn();
        if turn.abs() < 1e-9 {
            return true;
        }
        let (sin, cos) = start.sin_cos();
        let radius = 1.0 / segment.curvature;
        let to_start = Vec2::new(sin, -cos) * radius;
        let center = start.position() - to_start;
        let (sh, ch) = (turn / 2.0).sin_cos();
        let middle =
            Vec2::new(to_start.x * ch - to_start.y * sh, to_start.x * sh + to_start.y * ch);
        let radius = radius.abs();
        // The arc's farthest point along a normal is an end, unless the normal's own
        // direction from the centre lies within the arc; in a whole turn every direction does.
        let least = if turn.abs() >= TAU { -2.0 * radius } else { radius * ch };
        self.sides
            .iter()
            .all(|(n, offset)| n.dot(&middle) < least || n.dot(&center) + radius <= *offset)
    }

    /// Whether the rear axle stays inside all along a clothoid.
    pub fn contains_clothoid(&self, start: Pose, motion: Clothoid) -> bool {
        let Clothoid { from, to, length } = motion;
        // Within the length of the motion no side is ever reached.
        let reach = length.abs();
        let far = |(n, offset): &(Vec2, f64)| n.dot(&start.position()) + reach <= *offset;
        if self.sides.iter().all(far) {
            return true;
        }
        let inside = |s: f64| self.contains(motion.at(start, s).position());
        // Farthest along a normal it is at an end, or where it heads across that normal.
        inside(0.0)
            && inside(length)
            && self.sides.iter().all(|(normal, _)| {
                let across = normal.y.atan2(normal.x) + FRAC_PI_2;
                let half_slope = if from == to { 0.0 } else { (to - from) / (2.0 * length) };
                let most = (from.abs().max(to.abs()) * length.abs() / PI).ceil() as i32 + 2;
                let first = ((start.heading - across) / PI).round();
                (-most..=most).all(|k| {
                    // s·(from + half_slope·s) = the turn to there.
                    let turn = across + PI * (first + f64::from(k)) - start.heading;
                    let root = (from * from + 4.0 * half_slope * turn).sqrt();
                    // In this form neither root is lost where the slope is none.
                    let lengths = [2.0 * turn / (from + root), 2.0 * turn / (from - root)];
                    let is_met = |s: &f64| s.is_finite() && (0.0..=1.0).contains(&(s / length));
                    lengths.iter().filter(|s| is_met(s)).all(|&s| inside(s))
                })
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_that_bulges_out_is_seen() {
        let square = [(-5., -1.), (5., -1.), (5., 1.), (-5., 1.)].map(|(x, y)| Vec2::new(x, y));
        let b = ConvexBounds::new(square);
        let start = Pose::new(0.0, 0.0, 0.0);
        let half_turn = |k: f64| Segment { curvature: k, length: std::f64::consts::PI / k.abs() };
        assert!(!b.contains_motion(start, half_turn(1.0)));
        // From y = −1 heading back and forth within two metres of width.
        let low = Pose::new(-1.0, -0.5, std::f64::consts::FRAC_PI_2);
        assert!(b.contains_motion(low, half_turn(-1.0)));
        assert!(!b.contains_motion(Pose { y: 0.1, ..low }, half_turn(-1.0)));
    }
}
