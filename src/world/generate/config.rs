//! What generated scenes are drawn from.

use std::f64::consts::{FRAC_PI_6, PI};

use serde::{Deserialize, Serialize};

use super::EXTENT;
use crate::vehicle::Vehicle;
use crate::world::{Level, ParkingType};

/// What one level of difficulty draws from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelConfig {
    /// W_spot of a bay, square or angled, `[min, max]` metres.
    pub bay_spot_width: [f64; 2],
    /// W_spot of a parallel spot, `[min, max]` metres.
    pub parallel_spot_width: [f64; 2],
    /// Share of scenes with a wall across the lane.
    pub dead_end_probability: f64,
    /// D_deadend: from the spot's centre (of an angled bay from its mouth) to the nearest point of that
    /// wall, `[min, max]` metres.
    pub dead_end: [f64; 2],
}

/// What scenes are drawn from. The default is the paper's evaluation environment; what the
/// paper leaves open is chosen here.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GeneratorConfig {
    /// The level `easy`.
    pub easy: LevelConfig,
    /// The level `complex`.
    pub complex: LevelConfig,
    /// The level `extreme`.
    pub extreme: LevelConfig,
    /// Width of the lane between the two rows, metres.
    pub lane_width: f64,
    /// Depth of a bay spot, metres.
    pub bay_depth: f64,
    /// Depth of a parallel spot, metres.
    pub parallel_depth: f64,
    /// Largest slant of a parked car, radians.
    pub max_slant: f64,
    /// Share of taken spots, drawn per row from `[min, max]`; the two neighbours of the
    /// spot are always there.
    pub occupancy: [f64; 2],
    /// Share of scenes with a car standing in the lane, along its far side.
    pub lane_car_probability: f64,
    /// No car stands in the lane for x in `[-lane_clear.0, lane_clear.1]`, metres; of an angled bay from
    /// its mouth.
    pub lane_clear: [f64; 2],
    /// Room left beside a car in the lane, on top of the ego car's width, metres.
    pub passing_room: f64,
    /// Share of dead-end walls that are inclined.
    pub incline_probability: f64,
    /// Largest incline of a dead-end wall, radians from square to the lane.
    pub max_incline: f64,
    /// x of the start, `[min, max]` vehicle lengths, never beyond the dead end: the paper's ±N·l_car.
    pub start_reach: [f64; 2],
    /// The start heading lies within ± this, radians.
    pub start_heading: f64,
    /// Clearance of the start footprint from the lane's borders, metres.
    pub start_lane_clearance: f64,
    /// Clearance of the start footprint from every obstacle, metres.
    pub start_clearance: f64,
    /// Whether scenes lie at a random pose in the world, mirrored at random.
    pub world_frame: bool,
}

impl Default for GeneratorConfig {
    fn default() -> Self {
        Self {
            easy: LevelConfig {
                bay_spot_width: [3.2, 4.2],
                parallel_spot_width: [7.0, 8.0],
                dead_end_probability: 0.5,
                dead_end: [8.0, 12.0],
            },
            complex: LevelConfig {
                bay_spot_width: [2.8, 3.7],
                parallel_spot_width: [6.5, 7.5],
                dead_end_probability: 1.0,
                dead_end: [8.0, 12.0],
            },
            extreme: LevelConfig {
                bay_spot_width: [2.3, 3.2],
                parallel_spot_width: [6.0, 7.0],
                dead_end_probability: 1.0,
                dead_end: [4.0, 8.0],
            },
            lane_width: 6.0,
            bay_depth: 5.5,
            parallel_depth: 2.4,
            max_slant: 3.0_f64.to_radians(),
            occupancy: [0.5, 1.0],
            lane_car_probability: 0.3,
            lane_clear: [7.0, 9.0],
            passing_room: 1.4,
            incline_probability: 0.4,
            max_incline: 15.0_f64.to_radians(),
            start_reach: [-3.0, 3.0],
            start_heading: FRAC_PI_6,
            start_lane_clearance: 0.25,
            start_clearance: 0.2,
            world_frame: false,
        }
    }
}

/// A generator setting outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("generator.{field} is {value}; expected {expected}")]
pub struct GeneratorError {
    /// Name of the field.
    pub field: String,
    /// Its value.
    pub value: String,
    /// What would be right.
    pub expected: String,
}

impl GeneratorConfig {
    /// What `level` draws from.
    pub fn level(&self, level: Level) -> &LevelConfig {
        match level {
            Level::Easy => &self.easy,
            Level::Complex => &self.complex,
            Level::Extreme => &self.extreme,
        }
    }

    /// Depth of a spot, metres.
    pub fn depth(&self, kind: ParkingType) -> f64 {
        if kind.is_bay() { self.bay_depth } else { self.parallel_depth }
    }

    /// x of the start, `[min, max]` metres.
    pub fn start_x(&self, vehicle: &Vehicle) -> [f64; 2] {
        self.start_reach.map(|lengths| lengths * vehicle.length)
    }

    /// Checks every field, and that `vehicle` fits into the spots and the lane.
    pub fn validate(&self, vehicle: &Vehicle) -> Result<(), GeneratorError> {
        let number = |field: &str, v: f64, min: f64, max: f64| {
            if (min..=max).contains(&v) {
                return Ok(());
            }
            Err(GeneratorError {
                field: field.to_owned(),
                value: v.to_string(),
                expected: format!("a number from {min:.4} to {max:.4}"),
            })
        };
        let range = |field: &str, v: [f64; 2], min: f64, max: f64| {
            if min <= v[0] && v[0] <= v[1] && v[1] <= max {
                return Ok(());
            }
            Err(GeneratorError {
                field: field.to_owned(),
                value: format!("{v:?}"),
                expected: format!("[low, high], both from {min:.4} to {max:.4}"),
            })
        };
        let (length, width) = (vehicle.length, vehicle.width);
        for level in Level::ALL {
            let (name, l) = (level.name(), self.level(level));
            let field = |f: &str| format!("{name}.{f}");
            range(&field("bay_spot_width"), l.bay_spot_width, width + 0.1, 20.0)?;
            range(&field("parallel_spot_width"), l.parallel_spot_width, length + 0.1, 40.0)?;
            range(&field("dead_end"), l.dead_end, 0.5, EXTENT)?;
            number(&field("dead_end_probability"), l.dead_end_probability, 0.0, 1.0)?;
        }
        let room = self.start_lane_clearance.max(0.0);
        number("lane_width", self.lane_width, width + 2.0 * room + 0.1, 50.0)?;
        number("bay_depth", self.bay_depth, length + 0.2, 50.0)?;
        number("parallel_depth", self.parallel_depth, width + 0.2, 50.0)?;
        number("max_slant", self.max_slant, 0.0, 0.2)?;
        range("occupancy", self.occupancy, 0.0, 1.0)?;
        number("lane_car_probability", self.lane_car_probability, 0.0, 1.0)?;
        range("lane_clear", self.lane_clear, 0.0, EXTENT)?;
        number("passing_room", self.passing_room, 2.0 * room, 50.0)?;
        number("incline_probability", self.incline_probability, 0.0, 1.0)?;
        number("max_incline", self.max_incline, 0.0, 0.8)?;
        let farthest = EXTENT / length;
        range("start_reach", self.start_reach, -farthest, farthest)?;
        // Some stand before the spot: ahead of it there may be no room.
        let nearest = -vehicle.front_extent() / length;
        number("start_reach[0]", self.start_reach[0], -farthest, nearest)?;
        number("start_heading", self.start_heading, 0.0, PI)?;
        number("start_lane_clearance", self.start_lane_clearance, 0.0, 5.0)?;
        number("start_clearance", self.start_clearance, 0.0, self.start_lane_clearance)
    }
}
