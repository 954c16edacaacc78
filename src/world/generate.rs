//! Random parking scenes as in the paper (section V-B): parked cars beside the spot and
//! across the lane, slanted and offset; cars standing in the lane; dead-end walls, some of
//! them inclined; three levels of difficulty; never a fully blocked way.
//!
//! Everything is laid out in the **spot frame**: origin at the spot's centre, +x along the
//! lane in the direction of travel, +y from the spot toward the lane. The ego car stands anywhere in
//! the lane, before the spot or beyond it, and heads along +x. With [`GeneratorConfig::world_frame`] the finished scene is put anywhere in
//! the world, mirrored or not.
//!
//! A scene depends on its arguments alone: the same `(config, vehicle, kind, level, seed,
//! index)` gives the same bytes on every thread and in any order.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{Level, ParkingType, Scene};
use crate::geometry::{Aabb, Frame, Polygon, Pose, Vec2, segment_in_box};
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;

/// What one level of difficulty draws from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelConfig {
    /// W_spot of a bay, `[min, max]` metres.
    pub bay_spot_width: [f64; 2],
    /// W_spot of a parallel spot, `[min, max]` metres.
    pub parallel_spot_width: [f64; 2],
    /// Share of scenes with a wall across the lane.
    pub dead_end_probability: f64,
    /// D_deadend: from the spot's centre to the nearest point of that wall, `[min, max]`
    /// metres.
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
    /// No car stands in the lane for x in `[-lane_clear.0, lane_clear.1]`, metres.
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

/// How far scenes reach along the lane, metres to either side of the spot.
const EXTENT: f64 = 20.0;
/// Thickness of walls and curbs, metres.
const WALL: f64 = 0.3;
/// Parked cars stay this far inside their row, metres.
const INSET: f64 = 0.05;

/// The scene of `(kind, level, seed, index)`; `config` has passed
/// [`GeneratorConfig::validate`] for `vehicle`.
pub fn generate(
    config: &GeneratorConfig,
    vehicle: &Vehicle,
    kind: ParkingType,
    level: Level,
    seed: u64,
    index: u64,
) -> Scene {
    let stream = index.wrapping_mul(9).wrapping_add(setting(kind, level));
    let mut lot = Lot {
        config,
        vehicle,
        rng: rng(seed, Stream::Scene, stream),
        boundary: config.depth(kind) / 2.0,
        polygons: Vec::new(),
    };
    let dead_end = lot.lay_out(kind, config.level(level));
    let start = lot.start(dead_end);
    let goal = vehicle.rear_axle(Pose::new(0.0, 0.0, kind.goal_heading()));
    let bounds = Aabb::new(-EXTENT, -lot.boundary, dead_end.unwrap_or(EXTENT), lot.top())
        .inflated(2.0 * WALL);
    let frame = if config.world_frame { lot.somewhere() } else { Frame::WORLD };
    Scene {
        name: format!("{level}-{kind}-{index:04}"),
        source: format!("generated: level {level}, type {kind}, seed {seed}, index {index}"),
        vehicle: *vehicle,
        start: frame.world_from_local(start),
        goal: frame.world_from_local(goal),
        goals: Vec::new(),
        goal_tolerance: None,
        parking_type: Some(kind),
        obstacles: lot.polygons.iter().map(|p| in_world(p, &frame)).collect(),
        points: Vec::new(),
        bounds: Some(box_in_world(bounds, &frame)),
    }
}

/// The number of a type and level, 0 to 8, which picks the random stream of their scenes. Written
/// out and part of the data format, like [`Stream`]: whoever changes it changes every scene.
fn setting(kind: ParkingType, level: Level) -> u64 {
    let kind = match kind {
        ParkingType::Forward => 0,
        ParkingType::Reverse => 3,
        ParkingType::Parallel => 6,
    };
    let level = match level {
        Level::Easy => 0,
        Level::Complex => 1,
        Level::Extreme => 2,
    };
    kind + level
}

/// A parking lot in the making, in the spot frame.
struct Lot<'a> {
    config: &'a GeneratorConfig,
    vehicle: &'a Vehicle,
    rng: ChaCha8Rng,
    /// y of the boundary between the spot's row and the lane.
    boundary: f64,
    polygons: Vec<Polygon>,
}

/// One row of parked cars.
#[derive(Clone, Copy)]
struct Row {
    /// y of its borders.
    strip: [f64; 2],
    /// Whether its cars stand across the lane (else along it).
    bays: bool,
    occupancy: f64,
}

impl Lot<'_> {
    /// y of the far border of the lane.
    fn top(&self) -> f64 {
        self.boundary + self.config.lane_width
    }

    fn between(&mut self, [min, max]: [f64; 2]) -> f64 {
        if min < max { self.rng.random_range(min..=max) } else { min }
    }

    /// Places every obstacle; returns D_deadend when there is a dead end.
    fn lay_out(&mut self, kind: ParkingType, level: &LevelConfig) -> Option<f64> {
        let bays = kind.is_bay();
        let widths = if bays { level.bay_spot_width } else { level.parallel_spot_width };
        let half = self.between(widths) / 2.0;
        let dead_end = self
            .rng
            .random_bool(level.dead_end_probability)
            .then_some(level.dead_end)
            .map(|range| self.between(range));
        let row_end = dead_end.unwrap_or(EXTENT);

        let occupancy = self.between(self.config.occupancy);
        let row = Row { strip: [-self.boundary, self.boundary], bays, occupancy };
        for (side, end) in [(-1.0, EXTENT), (1.0, row_end)] {
            // Mostly the neighbour touches the spot; now and then it leaves some room.
            let room = if self.rng.random_bool(0.85) { 0.0 } else { self.between([0.05, 0.3]) };
            let car = self.parked_car(&row);
            let neighbour = beside(&car, side * (half + room), side);
            let next = far_edge(&neighbour, side);
            self.polygons.push(neighbour);
            self.fill(&row, next, side, side * end);
        }
        let neighbour_end = self.polygons.iter().map(|p| p.aabb().max.x).fold(0.0, f64::max);

        let behind = -self.boundary - self.between([0.0, 0.1]);
        let far_side = self.far_side(row_end);
        // The curbs end where the wall across the lane meets them.
        let (mut right, mut far_right) = (row_end, row_end);
        if let Some(d) = dead_end {
            // A neighbour that reaches beyond the wall closes the row itself.
            let low = if neighbour_end > d - INSET { self.boundary } else { behind };
            [right, far_right] = self.dead_end_wall(d, low, far_side);
        }
        right = right.max(neighbour_end) + WALL;
        self.wall(Aabb::new(-EXTENT - 1.0, behind - WALL, right, behind));
        self.wall(Aabb::new(-EXTENT - 1.0, far_side, far_right + WALL, far_side + WALL));
        if self.rng.random_bool(self.config.lane_car_probability) {
            self.lane_car(dead_end.is_none());
        }
        dead_end
    }

    /// What lies across the lane, up to x = `end`: bays, parallel spots or nothing.
    /// Returns where it ends in y.
    fn far_side(&mut self, end: f64) -> f64 {
        let top = self.top();
        let (bays, depth) = match self.rng.random_range(0..10) {
            0..5 => (true, self.config.bay_depth),
            5..8 => (false, self.config.parallel_depth),
            _ => return top,
        };
        let occupancy = self.between(self.config.occupancy);
        let from = -EXTENT + self.between([0.0, 2.5]);
        self.fill(&Row { strip: [top, top + depth], bays, occupancy }, from, 1.0, end);
        top + depth
    }

    /// Cars along `row` from x = `from` toward `side` (±1), none beyond `end`.
    fn fill(&mut self, row: &Row, from: f64, side: f64, end: f64) {
        let gaps = if row.bays { [0.45, 0.9] } else { [0.6, 1.4] };
        let mut next = from;
        loop {
            let car = self.parked_car(row);
            let car = beside(&car, next + side * self.between(gaps), side);
            next = far_edge(&car, side);
            if (next - end) * side > -INSET {
                return;
            }
            if self.rng.random_bool(row.occupancy) {
                self.polygons.push(car);
            }
        }
    }

    /// A car somewhere near x = 0 in `row`, slanted and offset, wholly inside the strip.
    fn parked_car(&mut self, row: &Row) -> Polygon {
        let [low, high] = [row.strip[0] + INSET, row.strip[1] - INSET];
        let slant = self.between([-self.config.max_slant, self.config.max_slant]);
        let across = if row.bays { FRAC_PI_2 } else { 0.0 };
        let [mut length, mut width] = self.car_size();
        let (sin, cos) = slant.abs().sin_cos();
        if row.bays {
            length = length.min((high - low - width * sin) / cos);
        } else {
            width = width.min((high - low - length * sin) / cos);
        }
        let car = rectangle(Pose::new(0.0, 0.0, across + slant), length, width);
        let extent = car.aabb();
        let y = self.between([low - extent.min.y, high - extent.max.y]);
        moved(&car, Vec2::new(0.0, y))
    }

    /// Length and width of some car, metres: around the ego car's.
    fn car_size(&mut self) -> [f64; 2] {
        let (length, width) = (self.vehicle.length, self.vehicle.width);
        [length * self.between([0.86, 1.03]), width * self.between([0.94, 1.05])]
    }

    fn wall(&mut self, area: Aabb) {
        self.polygons.push(Polygon::rectangle(Pose::default(), area));
    }

    /// A wall across the lane, square or inclined within the lane; from y = `low` to `high`.
    /// Its nearest point over the lane is at x = `d`. Returns x of its two ends.
    fn dead_end_wall(&mut self, d: f64, low: f64, high: f64) -> [f64; 2] {
        let inclined = self.rng.random_bool(self.config.incline_probability);
        let incline = self.between([-self.config.max_incline, self.config.max_incline]);
        let slope = if inclined { incline.tan() } else { 0.0 };
        let (bottom, top) = (self.boundary, self.top());
        // The nearest end of the face is at the spot's side or at the far side.
        let pivot = if slope > 0.0 { bottom } else { top };
        let face = |y: f64| Vec2::new(d + (y.clamp(bottom, top) - pivot) * slope, y);
        let thick = Vec2::new(WALL, 0.0);
        let borders = if inclined { vec![low, bottom, top, high] } else { vec![low, high] };
        for w in borders.windows(2).filter(|w| w[1] > w[0]) {
            let (a, b) = (face(w[0]), face(w[1]));
            self.polygons.extend(Polygon::new(vec![a, a + thick, b + thick, b]));
        }
        [face(low).x, face(high).x]
    }

    /// A car standing in the lane, where it leaves room to pass and is away from the spot.
    fn lane_car(&mut self, open_end: bool) {
        let [length, width] = self.car_size();
        let slant = self.between([-self.config.max_slant, self.config.max_slant]);
        let car = rectangle(Pose::new(0.0, 0.0, slant), length, width);
        let extent = car.aabb();
        let y = self.top() - extent.max.y - self.between([0.05, 0.3]);
        let gap = y + extent.min.y - self.boundary;
        if gap < self.vehicle.width + self.config.passing_room {
            return;
        }
        let [behind, ahead] = self.config.lane_clear;
        let x = if open_end && self.rng.random_bool(0.5) {
            ahead - extent.min.x + self.between([0.0, 3.0])
        } else {
            -behind - extent.max.x - self.between([0.0, 6.0])
        };
        self.polygons.push(moved(&car, Vec2::new(x, y)));
    }

    /// A free start pose in the lane, on this side of the dead end.
    fn start(&mut self, dead_end: Option<f64>) -> Pose {
        let c = self.config;
        let [first, last] = c.start_x(self.vehicle);
        let last = dead_end.map_or(last, |d| last.min(d.max(first)));
        let lane = [self.boundary + c.start_lane_clearance, self.top() - c.start_lane_clearance];
        for _ in 0..1000 {
            let x = self.between([first, last]);
            let y = self.between(lane);
            let pose = Pose::new(x, y, self.between([-c.start_heading, c.start_heading]));
            let extent = self.vehicle.footprint_at(pose).aabb();
            let in_lane = lane[0] <= extent.min.y && extent.max.y <= lane[1];
            let clear = |p: &Polygon| is_clear(self.vehicle, pose, p, c.start_clearance);
            if in_lane && self.polygons.iter().all(clear) {
                return pose;
            }
        }
        // Along the spot's row: nothing ever stands there.
        Pose::new(first, lane[0] + self.vehicle.width / 2.0, 0.0)
    }

    fn somewhere(&mut self) -> Frame {
        let [x, y] = [self.between([-200.0, 200.0]), self.between([-200.0, 200.0])];
        let heading = self.between([-PI, PI]);
        Frame { origin_in_world: Pose::new(x, y, heading), mirrored: self.rng.random_bool(0.5) }
    }
}

/// A car centred on `pose`.
fn rectangle(pose: Pose, length: f64, width: f64) -> Polygon {
    let (l, w) = (length / 2.0, width / 2.0);
    Polygon::rectangle(pose, Aabb::new(-l, -w, l, w))
}

fn moved(polygon: &Polygon, by: Vec2) -> Polygon {
    polygon.map(|v| v + by)
}

/// `car` moved along x until its edge facing the spot is at `x`, on the side `side` (±1).
fn beside(car: &Polygon, x: f64, side: f64) -> Polygon {
    moved(car, Vec2::new(x - far_edge(car, -side), 0.0))
}

/// x of the edge toward `side` (±1).
fn far_edge(car: &Polygon, side: f64) -> f64 {
    let extent = car.aabb();
    if side > 0.0 { extent.max.x } else { extent.min.x }
}

/// Whether the footprint at `pose`, grown by `margin`, shares no point with `polygon`.
pub(super) fn is_clear(vehicle: &Vehicle, pose: Pose, polygon: &Polygon, margin: f64) -> bool {
    let footprint = vehicle.footprint(margin);
    let local = |p| pose.point_to_local(p);
    let touches = |(a, b)| segment_in_box(local(a), local(b), &footprint);
    !polygon.edges().any(touches) && !polygon.contains(pose.position())
}

/// The vertices in the world, counter-clockwise there too.
pub(super) fn in_world(polygon: &Polygon, frame: &Frame) -> Vec<[f64; 2]> {
    let world = |&v: &Vec2| <[f64; 2]>::from(frame.world_from_local_point(v));
    let vertices = polygon.vertices().iter();
    if frame.mirrored { vertices.rev().map(world).collect() } else { vertices.map(world).collect() }
}

/// The smallest world-aligned box around a box of `frame`.
fn box_in_world(area: Aabb, frame: &Frame) -> [f64; 4] {
    let corners = area.corners().map(|c| frame.world_from_local_point(c));
    let Aabb { min, max } = Aabb::around(corners);
    [min.x, min.y, max.x, max.y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_types_and_levels_stay_what_they_are() {
        let numbers = [
            (ParkingType::Forward, [0, 1, 2]),
            (ParkingType::Reverse, [3, 4, 5]),
            (ParkingType::Parallel, [6, 7, 8]),
        ];
        for (kind, expected) in numbers {
            assert_eq!(Level::ALL.map(|level| setting(kind, level)), expected, "{kind}");
        }
    }
}
