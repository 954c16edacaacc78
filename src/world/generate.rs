//! Random parking scenes as in the paper (section V-B): parked cars beside the spot and
//! across the lane, slanted and offset; cars standing in the lane; dead-end walls, some of
//! them inclined; three levels of difficulty; never a fully blocked way.
//!
//! Everything is laid out in the **spot frame**: origin at the spot's centre, +x along the
//! lane in the direction of travel, +y from the spot toward the lane. The ego car stands anywhere in
//! the lane, before the spot or beyond it, and heads along +x. Angled bays (`angled`) are ours: the paper has none.
//! With [`GeneratorConfig::world_frame`] the finished scene is put anywhere in
//! the world, mirrored or not.
//!
//! A scene depends on its arguments alone: the same `(config, vehicle, kind, level, seed,
//! index)` gives the same bytes on every thread and in any order.

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{Level, ParkingType, Scene};
use crate::geometry::{Aabb, Frame, Polygon, Pose, Vec2, segment_in_box};
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;

mod angled;
mod config;
mod wide;

pub use config::{GeneratorConfig, GeneratorError, LevelConfig};
pub use wide::{some_wide, wide};

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
    let (stream, settings, setting) = setting(kind, level);
    let mut lot = Lot {
        config,
        vehicle,
        rng: rng(seed, stream, index.wrapping_mul(settings).wrapping_add(setting)),
        boundary: config.depth(kind) / 2.0,
        mouth: 0.0,
        polygons: Vec::new(),
    };
    let (heading, dead_end) = match kind.goal_heading() {
        Some(heading) => (heading, lot.lay_out(kind, config.level(level))),
        None => lot.lay_out_angled(config.level(level)),
    };
    let start = lot.start(dead_end);
    let goal = vehicle.rear_axle(Pose::new(0.0, 0.0, heading));
    // A slanted bay may reach farther than its lane.
    let end = dead_end.filter(|_| kind != ParkingType::Angled).unwrap_or(EXTENT);
    let bounds = Aabb::new(-EXTENT, -lot.boundary, end, lot.top()).inflated(2.0 * WALL);
    let frame = if config.world_frame { lot.somewhere() } else { Frame::WORLD };
    Scene {
        name: format!("{level}-{kind}-{index:04}"),
        source: format!("generated: level {level}, type {kind}, seed {seed}, index {index}"),
        vehicle: *vehicle,
        start: frame.world_from_local(start),
        goal: frame.world_from_local(goal),
        parking_type: Some(kind),
        obstacles: lot.polygons.iter().map(|p| in_world(p, &frame)).collect(),
        bounds: Some(box_in_world(bounds, &frame)),
        ..Scene::default()
    }
}

/// What picks the random stream of the scenes of a type and level: its name, the number of settings
/// there, and that of this one. Written out and part of the data format, like [`Stream`]: whoever
/// changes it changes every scene.
fn setting(kind: ParkingType, level: Level) -> (Stream, u64, u64) {
    let (stream, settings, kind) = match kind {
        ParkingType::Forward => (Stream::Scene, 9, 0),
        ParkingType::Reverse => (Stream::Scene, 9, 3),
        ParkingType::Parallel => (Stream::Scene, 9, 6),
        ParkingType::Angled => (Stream::Angled, 3, 0),
    };
    let level = match level {
        Level::Easy => 0,
        Level::Complex => 1,
        Level::Extreme => 2,
    };
    (stream, settings, kind + level)
}

/// A parking lot in the making, in the spot frame.
struct Lot<'a> {
    config: &'a GeneratorConfig,
    vehicle: &'a Vehicle,
    rng: ChaCha8Rng,
    /// y of the boundary between the spot's row and the lane.
    boundary: f64,
    /// x of the middle of the spot's mouth.
    mouth: f64,
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
        self.around_row(dead_end);
        dead_end
    }

    /// Places what lies around the spot's row, whose cars are placed: the far side, the wall across the
    /// lane at x = `dead_end`, the curbs, and a car in the lane.
    fn around_row(&mut self, dead_end: Option<f64>) {
        let row_end = dead_end.unwrap_or(EXTENT);
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
        self.polygons.push(moved(&car, Vec2::new(self.mouth + x, y)));
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
            (ParkingType::Forward, Stream::Scene, 9, [0, 1, 2]),
            (ParkingType::Reverse, Stream::Scene, 9, [3, 4, 5]),
            (ParkingType::Parallel, Stream::Scene, 9, [6, 7, 8]),
            (ParkingType::Angled, Stream::Angled, 3, [0, 1, 2]),
        ];
        for (kind, stream, settings, numbers) in numbers {
            let expected = numbers.map(|number| (stream, settings, number));
            assert_eq!(Level::ALL.map(|level| setting(kind, level)), expected, "{kind}");
        }
    }
}
