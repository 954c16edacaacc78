//! Axis-aligned boxes.

use super::Vec2;

/// An axis-aligned box; empty when a minimum exceeds its maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower-left corner.
    pub min: Vec2,
    /// Upper-right corner.
    pub max: Vec2,
}

impl Aabb {
    /// Contains nothing; the neutral element of [`Aabb::include`].
    pub const EMPTY: Aabb = Aabb {
        min: Vec2::new(f64::INFINITY, f64::INFINITY),
        max: Vec2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The box of two opposite corners, given as minimum and maximum.
    pub const fn new(min_x: f64, min_y: f64, max_x: f64, max_y: f64) -> Self {
        Self { min: Vec2::new(min_x, min_y), max: Vec2::new(max_x, max_y) }
    }

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Vec2>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::include)
    }

    /// The smallest box that also contains `p`.
    pub fn include(self, p: Vec2) -> Self {
        // `f64::min` takes care of NaN, which takes longer than the rest.
        let least = |a: f64, b: f64| if b < a { b } else { a };
        let most = |a: f64, b: f64| if b > a { b } else { a };
        Self {
            min: Vec2::new(least(self.min.x, p.x), least(self.min.y, p.y)),
            max: Vec2::new(most(self.max.x, p.x), most(self.max.y, p.y)),
        }
    }

    /// This box grown by `margin` metres on every side.
    pub fn inflated(self, margin: f64) -> Self {
        let m = Vec2::new(margin, margin);
        Self { min: self.min - m, max: self.max + m }
    }

    /// Whether the boxes share a point (touching counts).
    pub fn intersects(&self, other: &Aabb) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
    }

    /// Whether `p` lies in the box (its border counts).
    pub fn contains(&self, p: Vec2) -> bool {
        self.min.x <= p.x && p.x <= self.max.x && self.min.y <= p.y && p.y <= self.max.y
    }

    /// The corners, counter-clockwise from the lower left.
    pub fn corners(&self) -> [Vec2; 4] {
        [self.min, Vec2::new(self.max.x, self.min.y), self.max, Vec2::new(self.min.x, self.max.y)]
    }
}
