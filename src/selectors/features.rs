//! The inputs of selectors.

use crate::geometry::{Pose, wrap_angle};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;
use crate::world::cell::{Cell, Grid};

/// What a selector sees (paper, eq. 6): the start in the spot frame and the cell.
///
/// Defined once: Parquet columns, and normaliser and tensors of the models for one vehicle, all
/// follow [`Features::NAMES`], networks for angled bays [`Features::SLANTED_NAMES`]; those for any vehicle follow
/// [`UNIT_NAMES`].
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
    pub const NAMES: [&'static str; Self::COUNT] = {
        let [x, y, heading, lane_width, spot_width, dead_end, ..] = Self::SLANTED_NAMES;
        [x, y, heading, lane_width, spot_width, dead_end]
    };

    /// Number of features of angled bays.
    pub const SLANTED_COUNT: usize = Self::COUNT + 2;
    /// Their names, in order: of angled bays it matters how the parked car stands, too.
    pub const SLANTED_NAMES: [&'static str; Self::SLANTED_COUNT] = [
        "start_x_m",
        "start_y_m",
        "start_heading_rad",
        "lane_width_m",
        "spot_width_m",
        "dead_end_m",
        "parked_heading_cos",
        "parked_heading_sin",
    ];

    /// The names for a parking type, in order.
    pub fn names(kind: ParkingType) -> &'static [&'static str] {
        if kind == ParkingType::Angled { &Self::SLANTED_NAMES } else { &Self::NAMES }
    }

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

    /// The values in the order of [`Features::SLANTED_NAMES`].
    pub fn slanted_values(&self) -> [f32; Self::SLANTED_COUNT] {
        let (sin, cos) = self.cell.stance.heading().sin_cos();
        let [x, y, heading, lane_width, spot_width, dead_end] = self.values();
        [x, y, heading, lane_width, spot_width, dead_end, cos as f32, sin as f32]
    }

    /// The values in the order of [`UNIT_NAMES`], for a model that serves any vehicle.
    pub fn unit_values(&self, grid: &Grid, vehicle: &Vehicle) -> [f32; UNIT_COUNT] {
        let Features { start, cell } = self;
        let of_radius = |metres: f64| metres / vehicle.turning_radius();
        [
            of_radius(start.x),
            of_radius(start.y),
            start.heading,
            of_radius(cell.lane_width),
            of_radius(cell.spot_width),
            of_radius(cell.dead_end),
            of_radius(grid.lane_boundary(cell.stance)),
            of_radius(vehicle.length),
            of_radius(vehicle.width),
            of_radius(vehicle.rear_overhang),
        ]
        .map(|v| v as f32)
    }
}

/// Number of the features that a model for any vehicle sees.
pub const UNIT_COUNT: usize = 10;
/// Their names, in order; all lengths in turning radii. With the turning radius as the unit the
/// footprint says all that decides where a car can drive.
pub const UNIT_NAMES: [&str; UNIT_COUNT] = [
    "start_x",
    "start_y",
    "start_heading_rad",
    "lane_width",
    "spot_width",
    "dead_end",
    "lane_boundary",
    "vehicle_length",
    "vehicle_width",
    "vehicle_rear_overhang",
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{ParkingType, Stance};

    #[test]
    fn a_model_for_any_vehicle_sees_a_larger_car_in_a_larger_world_the_same() {
        let (grid, car) = (Grid::default(), Vehicle::default());
        let stance = Stance::new(ParkingType::Reverse, 0.0);
        let cell = Cell { stance, lane_width: 5.0, spot_width: 2.5, dead_end: 6.0 };
        let small = Features::new(Pose::new(-3.0, 5.0, 0.2), cell);
        let larger = Vehicle {
            length: 2.0 * car.length,
            width: 2.0 * car.width,
            wheelbase: 2.0 * car.wheelbase,
            rear_overhang: 2.0 * car.rear_overhang,
            ..car
        };
        let cell = Cell { stance, lane_width: 10.0, spot_width: 5.0, dead_end: 12.0 };
        let large = Features::new(Pose::new(-6.0, 10.0, 0.2), cell);
        let [a, b] = [small.unit_values(&grid, &car), large.unit_values(&grid, &larger)];
        for ((name, a), b) in UNIT_NAMES.into_iter().zip(a).zip(b) {
            // A bay is as deep as before.
            let expected = if name == "lane_boundary" { 0.5 * a } else { a };
            assert!((b - expected).abs() < 1e-6, "{name}: {a}, {b}");
        }
    }
}
