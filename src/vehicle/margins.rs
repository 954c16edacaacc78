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
    /// On the left.
    pub left: f64,
    /// On the right.
    pub right: f64,
    /// Around the mirrors: what of a contour stands out farther to either side than the body does at the rear axle. As
    /// the sides' where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mirrors: Option<f64>,
}

impl Margins {
    /// The names of the sides, in the order of [`Margins::sides`], and of what stands out of them.
    pub const NAMES: [&str; 5] = ["front", "rear", "left", "right", "mirrors"];

    /// All four sides.
    pub fn sides(&self) -> [f64; 4] {
        [self.front, self.rear, self.left, self.right]
    }

    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let [front, rear, left, right] = self.sides().map(&f);
        Self { front, rear, left, right, mirrors: self.mirrors.map(f) }
    }

    /// All that are given.
    fn given(&self) -> impl Iterator<Item = f64> {
        self.sides().into_iter().chain(self.mirrors)
    }

    /// Of the whole car with its mirrors: no part of it is kept farther off.
    pub fn of_everything(self) -> Self {
        self.mirrors.map_or(self, |most| Self { mirrors: None, ..self }.at_least(most))
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
        self.given().fold(f64::NEG_INFINITY, f64::max)
    }

    /// The smallest.
    pub fn least(self) -> f64 {
        self.given().fold(f64::INFINITY, f64::min)
    }

    /// The margins of the car's mirror image.
    pub fn mirrored(self) -> Self {
        Self { left: self.right, right: self.left, ..self }
    }
}

impl From<f64> for Margins {
    /// The same on every side.
    fn from(margin: f64) -> Self {
        Self { front: margin, rear: margin, left: margin, right: margin, mirrors: None }
    }
}
