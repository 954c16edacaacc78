//! The input of every selector.

use crate::geometry::{Pose, wrap_angle};
use crate::world::cell::Cell;

/// What a selector sees (paper, eq. 6): the start in the spot frame and the cell.
///
/// Defined once: Parquet columns, normaliser and tensors all follow [`Features::NAMES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// Rear-axle start, spot frame; heading in (−π, π].
    pub start: Pose,
    /// The grid cell, already rounded down.
    pub cell: Cell,
}

impl Features {
    /// Number of features.
    pub const COUNT: usize = 6;
    /// Their names, in order.
    pub const NAMES: [&'static str; Self::COUNT] = [
        "start_x_m",
        "start_y_m",
        "start_heading_rad",
        "lane_width_m",
        "spot_width_m",
        "dead_end_m",
    ];

    /// Features of a start and a grid cell.
    pub fn new(start: Pose, cell: Cell) -> Self {
        Self { start: Pose { heading: wrap_angle(start.heading), ..start }, cell }
    }

    /// The values in the order of [`Features::NAMES`], in single precision: the one place
    /// where features become tensor elements.
    pub fn values(&self) -> [f32; Self::COUNT] {
        let Features { start, cell } = self;
        [start.x, start.y, start.heading, cell.lane_width, cell.spot_width, cell.dead_end]
            .map(|v| v as f32)
    }
}
