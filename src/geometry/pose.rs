//! A pose of the plane: position and heading.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::Vec2;

/// Position and heading. For a vehicle it is always the **rear-axle centre**.
///
/// Serialised as `[x, y, heading]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct Pose {
    /// Metres along the frame's +x.
    pub x: f64,
    /// Metres along the frame's +y.
    pub y: f64,
    /// Radians from +x, counter-clockwise; any representative of the angle.
    pub heading: f64,
}

impl Pose {
    /// The pose at `(x, y)` metres with `heading` radians.
    pub const fn new(x: f64, y: f64, heading: f64) -> Self {
        Self { x, y, heading }
    }

    /// The position alone.
    pub fn position(self) -> Vec2 {
        Vec2::new(self.x, self.y)
    }

    /// `(sin, cos)` of the heading.
    pub fn sin_cos(self) -> (f64, f64) {
        self.heading.sin_cos()
    }

    /// `other`, given in this pose's frame, expressed in the frame this pose is given in.
    pub fn compose(self, other: Pose) -> Pose {
        let p = self.point_to_parent(other.position());
        Pose::new(p.x, p.y, wrap_angle(self.heading + other.heading))
    }

    /// `other`, given in the same frame as this pose, seen from this pose.
    pub fn relative(self, other: Pose) -> Pose {
        let p = self.point_to_local(other.position());
        Pose::new(p.x, p.y, wrap_angle(other.heading - self.heading))
    }

    /// A point given in this pose's frame, expressed in the parent frame.
    pub fn point_to_parent(self, p: Vec2) -> Vec2 {
        let (s, c) = self.sin_cos();
        Vec2::new(self.x + c * p.x - s * p.y, self.y + s * p.x + c * p.y)
    }

    /// A point of the parent frame, seen from this pose.
    pub fn point_to_local(self, p: Vec2) -> Vec2 {
        let (s, c) = self.sin_cos();
        let (dx, dy) = (p.x - self.x, p.y - self.y);
        Vec2::new(c * dx + s * dy, -s * dx + c * dy)
    }

    /// This pose moved `distance` metres along its own heading (backwards when negative).
    pub fn shifted(self, distance: f64) -> Pose {
        let (s, c) = self.sin_cos();
        Pose::new(self.x + distance * c, self.y + distance * s, self.heading)
    }

    /// Whether every component is a finite number.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.heading.is_finite()
    }

    /// How finely `f64` resolves the position, metres: from the larger coordinate to the next number.
    pub fn resolution(self) -> f64 {
        let largest = self.x.abs().max(self.y.abs());
        largest.next_up() - largest
    }

    /// Straight-line distance between the positions, metres.
    pub fn distance(self, other: Pose) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

impl From<[f64; 3]> for Pose {
    fn from([x, y, heading]: [f64; 3]) -> Self {
        Self { x, y, heading }
    }
}

impl From<Pose> for [f64; 3] {
    fn from(p: Pose) -> Self {
        [p.x, p.y, p.heading]
    }
}

/// The representative of `angle` in (−π, π].
pub fn wrap_angle(angle: f64) -> f64 {
    if angle > -PI && angle <= PI {
        return angle;
    }
    let a = angle - TAU * (angle / TAU).round();
    if a <= -PI { a + TAU } else { a }
}

/// The signed turn from `from` to `to`, in (−π, π].
pub fn signed_angle(from: f64, to: f64) -> f64 {
    wrap_angle(to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_at_both_ends() {
        assert_eq!(wrap_angle(PI), PI);
        assert_eq!(wrap_angle(-PI), PI);
        assert!((wrap_angle(3.0 * PI + 0.1) - (-PI + 0.1)).abs() < 1e-12);
        assert!((signed_angle(PI - 0.1, -PI + 0.1) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn coordinates_lose_digits_far_away() {
        assert_eq!(Pose::new(0.0, -(2_f64.powi(39)), 0.0).resolution(), 2_f64.powi(-13));
        assert!(Pose::new(5e5, 1.0, 0.0).resolution() < 1e-10);
    }

    #[test]
    fn relative_undoes_compose() {
        let a = Pose::new(3.0, -2.0, 2.5);
        let b = Pose::new(-1.0, 4.0, -2.9);
        let back = a.relative(a.compose(b));
        assert!(back.distance(b) < 1e-12 && signed_angle(back.heading, b.heading).abs() < 1e-12);
    }
}
