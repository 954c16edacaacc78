//! Rows of angled bays.
//!
//! A row is laid out in the **frame of the way out**: origin at the spot's centre, +x to the right of
//! the way out of the bay, +y along it. There the bays stand side by side as square ones do; along the
//! lane each lies farther out than the one before, as the lane has it.

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt;

use super::{EXTENT, INSET, LevelConfig, Lot, Row, beside, far_edge, moved};
use crate::geometry::{Polygon, Pose, Vec2};

/// Slants drawn from, degrees, where the way out leads against the direction of travel or with it.
const SLANTS: [[f64; 2]; 2] = [[105.0, 150.0], [30.0, 75.0]];

impl Lot<'_> {
    /// Places every obstacle; returns the parked car's heading, and the x of the wall across the lane
    /// when there is one.
    pub(super) fn lay_out_angled(&mut self, level: &LevelConfig) -> (f64, Option<f64>) {
        let slants = SLANTS[usize::from(self.rng.random_bool(0.5))];
        let slant = self.between(slants).to_radians();
        let heading = if self.rng.random_bool(0.5) { slant } else { slant - PI };
        let half = self.between(level.bay_spot_width) / 2.0;
        let half_depth = self.config.bay_depth / 2.0;
        let (sin, cos) = slant.sin_cos();
        self.boundary = half_depth * sin + half * cos.abs();
        self.mouth = self.boundary * cos / sin;
        let dead_end = self
            .rng
            .random_bool(level.dead_end_probability)
            .then_some(level.dead_end)
            .map(|range| self.mouth + self.between(range));

        let occupancy = self.between(self.config.occupancy);
        let row = Row { strip: [-half_depth, half_depth], bays: true, occupancy };
        for (side, end) in [(-1.0, EXTENT), (1.0, dead_end.unwrap_or(EXTENT))] {
            let room = if self.rng.random_bool(0.85) { 0.0 } else { self.between([0.05, 0.3]) };
            let mut next = half + room;
            let mut is_neighbour = true;
            loop {
                let car = self.parked_car(&row);
                let car = beside(&car, side * next, side);
                next = side * far_edge(&car, side) + self.between([0.45, 0.9]);
                let car = in_row(&car, slant);
                if !is_neighbour && side * far_edge(&car, side) > end - INSET {
                    break;
                }
                if is_neighbour || self.rng.random_bool(occupancy) {
                    self.polygons.push(car);
                }
                is_neighbour = false;
            }
        }
        self.around_row(dead_end);
        (heading, dead_end)
    }
}

/// A car given in the frame of the way out, as if its row were square to it, where it stands in its
/// row, spot frame.
fn in_row(car: &Polygon, slant: f64) -> Polygon {
    let extent = car.aabb();
    let beside = f64::midpoint(extent.min.x, extent.max.x);
    let along_lane = moved(car, Vec2::new(0.0, beside / slant.tan()));
    let frame = Pose::new(0.0, 0.0, slant - FRAC_PI_2);
    along_lane.map(|v| frame.point_to_parent(v))
}
