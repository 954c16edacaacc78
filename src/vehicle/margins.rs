//! How far a car keeps from obstacles, side by side.

use serde::{Deserialize, Serialize};

/// Clearance on each side of a car, metres; its corners keep both of theirs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Margins {
    /// Ahead of the front bumper.
    pub front: f64,
    /// Behind the rear bumper.
    pub rear: f64,
    /// On the left, mirrors included.
    pub left: f64,
    /// On the right.
    pub right: f64,
}

impl Margins {
    /// The names of the sides, in the order of [`Margins::sides`].
    pub const NAMES: [&str; 4] = ["front", "rear", "left", "right"];

    /// All four.
    pub fn sides(&self) -> [f64; 4] {
        [self.front, self.rear, self.left, self.right]
    }

    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let [front, rear, left, right] = self.sides().map(f);
        Self { front, rear, left, right }
    }

    /// The same, nowhere less than `margin`.
    pub fn at_least(self, margin: f64) -> Self {
        self.map(|side| side.max(margin))
    }

    /// The same, nowhere more than `margin`.
    pub fn at_most(self, margin: f64) -> Self {
        self.map(|side| side.min(margin))
    }

    /// The largest.
    pub fn most(self) -> f64 {
        self.sides().into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// The smallest.
    pub fn least(self) -> f64 {
        self.sides().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The margins of the car's mirror image.
    pub fn mirrored(self) -> Self {
        Self { left: self.right, right: self.left, ..self }
    }
}

impl From<f64> for Margins {
    /// The same on every side.
    fn from(margin: f64) -> Self {
        Self { front: margin, rear: margin, left: margin, right: margin }
    }
}
