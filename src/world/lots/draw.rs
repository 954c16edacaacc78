//! Random draws, and the sizes of cars.

use std::f64::consts::PI;
use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::geometry::{Frame, Pose};

/// A source of random values.
pub(super) struct Draw {
    rng: ChaCha8Rng,
}

impl Draw {
    pub fn new(rng: ChaCha8Rng) -> Self {
        Self { rng }
    }

    /// Evenly between two numbers; the first where they do not ascend.
    pub fn between(&mut self, min: f64, max: f64) -> f64 {
        if min < max { self.rng.random_range(min..=max) } else { min }
    }

    /// Evenly within ± `most`.
    pub fn about(&mut self, most: f64) -> f64 {
        self.between(-most, most)
    }

    /// One of these numbers.
    pub fn number(&mut self, among: Range<u32>) -> u32 {
        self.rng.random_range(among)
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.rng.random_bool(probability)
    }

    /// +1 or −1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// Length and width of some car, metres, from city cars to vans.
    pub fn car(&mut self) -> [f64; 2] {
        let (length, width) = match self.number(0..20) {
            0..3 => ((2.7, 3.7), (1.55, 1.68)),
            3..8 => ((3.8, 4.3), (1.7, 1.8)),
            8..15 => ((4.3, 4.9), (1.78, 1.88)),
            15..18 => ((4.4, 5.0), (1.85, 2.0)),
            _ => ((4.9, 5.9), (1.9, 2.05)),
        };
        [self.between(length.0, length.1), self.between(width.0, width.1)]
    }

    /// A frame anywhere in the world, ±200 m, mirrored or not.
    pub fn somewhere(&mut self) -> Frame {
        let origin_in_world = Pose::new(self.about(200.0), self.about(200.0), self.about(PI));
        Frame { origin_in_world, mirrored: self.chance(0.5) }
    }
}
