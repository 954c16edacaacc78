//! Unusual bays: deep ones, with pillars or kerbs at the mouth, the last of a row beside a wall,
//! and oblique ones.
//!
//! For tests and measurements of how spots are recognised. Everything is laid out in the **lane
//! frame**: origin at the middle of the spot's mouth, +x along the lane, +y across it; the car comes
//! from either side. The finished scene lies anywhere in the world, mirrored or not.
//!
//! A scene depends on its arguments alone.

use std::f64::consts::PI;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::generate::{in_world, is_clear};
use super::{ParkingType, Scene};
use crate::geometry::{Aabb, Frame, Polygon, Pose, Vec2};
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;

/// What is unusual.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unusual {
    /// A bay 5.5 to 9 m deep, the car anywhere in it, between cars, vans or walls.
    Deep,
    /// Pillars at the mouth of a bay, reaching into the lane.
    Pillars,
    /// Kerbs extended into the lane on both sides of the spot.
    Kerbs,
    /// A neighbour on one side, on the other a wall that reaches into the lane or across it.
    Last,
    /// Bays at 45°.
    At45,
    /// Bays at 60°.
    At60,
}

impl Unusual {
    /// All of them.
    pub const ALL: [Unusual; 6] =
        [Self::Deep, Self::Pillars, Self::Kerbs, Self::Last, Self::At45, Self::At60];

    /// The name used in scenes' names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deep => "deep",
            Self::Pillars => "pillars",
            Self::Kerbs => "kerbs",
            Self::Last => "last",
            Self::At45 => "at45",
            Self::At60 => "at60",
        }
    }

    /// The types such a spot can be of; for an oblique bay they say whether the car stands nose in or
    /// tail in, and its own type is [`ParkingType::Angled`].
    pub fn kinds(self) -> &'static [ParkingType] {
        match self {
            Self::Kerbs | Self::Last => &ParkingType::SQUARE,
            _ => &[ParkingType::Forward, ParkingType::Reverse],
        }
    }

    /// From the lane to the bays' axis, radians, where it is not square.
    pub fn slant(self) -> Option<f64> {
        match self {
            Self::At45 => Some(PI / 4.0),
            Self::At60 => Some(PI / 3.0),
            _ => None,
        }
    }
}

/// How far scenes reach along the lane, metres to either side of the spot.
const EXTENT: f64 = 22.0;
/// Thickness of walls, metres.
const WALL: f64 = 0.3;
/// Room that the parked car has at least on every side, metres, and the starting one.
const ROOM: f64 = 0.15;

/// The scene number `index` of a seed, for the default vehicle, named `UNUSUAL-TYPE-INDEX`. Its
/// parking type is that of `kind`, but for oblique bays, which have none.
///
/// # Panics
///
/// For angled bays: none of these is.
pub fn bay(unusual: Unusual, kind: ParkingType, seed: u64, index: u64) -> Scene {
    let place = |among: usize, of: u64| among as u64 + of;
    let number = Unusual::ALL.iter().position(|&u| u == unusual).expect("one of all");
    let kind_number = ParkingType::ALL.iter().position(|&k| k == kind).expect("one of all");
    let stream = place(number, 6 * place(kind_number, 3 * index));
    let mut draw = Draw { rng: rng(seed, Stream::Bay, stream), vehicle: Vehicle::default() };
    loop {
        // Now and then nothing is left to stand on.
        if let Some(scene) = draw.scene(unusual, kind) {
            let name = format!("{}-{kind}-{index:04}", unusual.name());
            let source = format!("unusual bay: {}, {kind}, seed {seed}, {index}", unusual.name());
            return Scene { name, source, ..scene };
        }
    }
}

struct Draw {
    rng: ChaCha8Rng,
    vehicle: Vehicle,
}

impl Draw {
    fn between(&mut self, min: f64, max: f64) -> f64 {
        if min < max { self.rng.random_range(min..=max) } else { min }
    }

    fn scene(&mut self, unusual: Unusual, kind: ParkingType) -> Option<Scene> {
        let lane = match unusual {
            Unusual::Last => self.between(6.0, 9.0),
            _ => self.between(5.0, 9.0),
        };
        let mut walls = vec![box_of(-EXTENT, lane, EXTENT, lane + WALL)];
        let (goal, blocked) = match unusual.slant() {
            Some(slant) => (self.oblique(slant, kind, &mut walls), None),
            None => self.square(unusual, kind, lane, &mut walls)?,
        };
        let start = self.start(lane, blocked, &walls)?;
        if !walls.iter().all(|p| is_clear(&self.vehicle, goal, p, 0.05)) {
            return None;
        }
        let frame = Frame {
            origin_in_world: Pose::new(
                self.between(-100.0, 100.0),
                self.between(-100.0, 100.0),
                self.between(-PI, PI),
            ),
            mirrored: self.rng.random_bool(0.5),
        };
        let in_world = |p: &Polygon| in_world(p, &frame);
        Some(Scene {
            vehicle: self.vehicle,
            start: frame.world_from_local(start),
            goal: frame.world_from_local(goal),
            parking_type: unusual.slant().is_none().then_some(kind),
            obstacles: walls.iter().map(in_world).collect(),
            ..Scene::default()
        })
    }

    /// A spot square to the lane, and its row. Returns the goal, and the side on which the lane is
    /// closed, if one is.
    fn square(
        &mut self,
        unusual: Unusual,
        kind: ParkingType,
        lane: f64,
        walls: &mut Vec<Polygon>,
    ) -> Option<(Pose, Option<f64>)> {
        let Vehicle { length, width, .. } = self.vehicle;
        let bays = kind.is_bay();
        let (along, across) = if bays { (width, length) } else { (length, width) };
        let depth = match (unusual, bays) {
            (Unusual::Deep, _) => self.between(5.5, 9.0),
            (_, true) => self.between(5.2, 6.5),
            (_, false) => self.between(2.2, 3.0),
        };
        let spot = if bays { self.between(2.5, 3.6) } else { self.between(6.4, 8.2) };
        let half = spot / 2.0;
        let beside = (half - along / 2.0 - ROOM).max(0.0);
        let from = across / 2.0 + ROOM.min((depth - across) / 2.0);
        let to = depth - from;
        let x = self.between(-beside, beside) * 0.7;
        let y = -self.between(from, to);
        let heading = kind.goal_heading().expect("square to the lane or along it");
        let goal = self.vehicle.rear_axle(Pose::new(x, y, heading));
        walls.push(box_of(-EXTENT, -depth - WALL, EXTENT, -depth));
        let mut blocked = None;
        let wall_side = if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        for side in [-1.0, 1.0] {
            if unusual == Unusual::Last && side == wall_side {
                let reach =
                    if self.rng.random_bool(0.4) { lane } else { self.between(0.3, lane - 4.5) };
                if reach > lane - 3.0 {
                    blocked = Some(side);
                }
                let x = half + self.between(0.0, 0.3);
                walls.push(box_of(side * x, -depth, side * (x + WALL), reach));
                continue;
            }
            let mut next = half;
            if unusual == Unusual::Pillars {
                let (thick, reach) = (self.between(0.3, 0.6), self.between(-0.2, 1.2));
                let low = reach - self.between(0.4, 1.0);
                walls.push(box_of(side * half, low, side * (half + thick), reach));
                next += thick;
            } else if unusual == Unusual::Kerbs {
                let (long, reach) = (self.between(1.5, 5.0), self.between(0.2, 1.5));
                // Square or tapered where the row goes on.
                let taper = self.between(0.0, 1.0).min(reach);
                let corners = [(0.0, -depth), (long, -depth), (long, reach - taper), (0.0, reach)];
                let points = corners.map(|(x, y)| Vec2::new(side * (half + x), y));
                walls.push(outline(points.to_vec()));
                next += long;
            } else if unusual == Unusual::Deep && self.rng.random_bool(0.3) {
                walls.push(box_of(side * half, -depth, side * (half + 0.15), 0.0));
                next += 0.15;
            }
            self.row(side, next, depth, bays, walls);
        }
        Some((goal, blocked))
    }

    /// Cars from `x` on toward `side`, in bays `depth` deep or along the lane.
    fn row(&mut self, side: f64, x: f64, depth: f64, bays: bool, walls: &mut Vec<Polygon>) {
        let mut next = x + self.between(0.0, 0.4);
        let mut first = true;
        while next < EXTENT - 6.0 {
            let long = self.between(4.2, if bays { depth.min(5.3) - 0.2 } else { 5.1 });
            let long = if bays && self.rng.random_bool(0.4) { depth - 0.2 } else { long };
            let wide = self.between(1.75, 2.0);
            let (along, across) = if bays { (wide, long) } else { (long, wide) };
            let y = -self.between(across / 2.0, depth - across / 2.0);
            if first || self.rng.random_bool(0.8) {
                let (a, b) = (side * next, side * (next + along));
                walls.push(box_of(a, y - across / 2.0, b, y + across / 2.0));
            }
            first = false;
            next += along + if bays { self.between(0.5, 0.9) } else { self.between(0.6, 1.4) };
        }
    }

    /// A row of bays whose axis is `slant` from +x, and the goal in one.
    fn oblique(&mut self, slant: f64, kind: ParkingType, walls: &mut Vec<Polygon>) -> Pose {
        let (pitch, depth) = (self.between(2.6, 3.2) / slant.sin(), 5.4);
        let out = Vec2::new(slant.cos(), slant.sin());
        let low = -depth * slant.sin() - 1.6;
        walls.push(box_of(-EXTENT, low - WALL, EXTENT, low));
        let centre = |n: i32| Vec2::new(f64::from(n) * pitch, 0.0) - out * (depth / 2.0 + 0.3);
        let at = |c: Vec2, heading| Pose::new(c.x, c.y, heading);
        for n in (-6_i32..=6).filter(|&n| n != 0) {
            if n.abs() == 1 || self.rng.random_bool(0.8) {
                let (long, wide) = (self.between(4.2, 5.0), self.between(1.75, 1.95));
                let car = Aabb::new(-long / 2.0, -wide / 2.0, long / 2.0, wide / 2.0);
                walls.push(Polygon::rectangle(at(centre(n), slant), car));
            }
        }
        let heading = if kind == ParkingType::Forward { slant + PI } else { slant };
        self.vehicle.rear_axle(at(centre(0), heading))
    }

    /// A free pose in the lane, not on the side that is `blocked`.
    fn start(&mut self, lane: f64, blocked: Option<f64>, walls: &[Polygon]) -> Option<Pose> {
        for _ in 0..200 {
            let from = if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
            let side = blocked.map_or(from, |closed| -closed);
            let x = side * self.between(7.0, 14.0);
            let y = self.between(1.2, lane - 1.2);
            let along = if side < 0.0 { 0.0 } else { PI };
            let pose = Pose::new(x, y, along + self.between(-0.25, 0.25));
            if walls.iter().all(|p| is_clear(&self.vehicle, pose, p, ROOM)) {
                return Some(pose);
            }
        }
        None
    }
}

fn outline(mut points: Vec<Vec2>) -> Polygon {
    let twice: f64 =
        points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| a.x * b.y - a.y * b.x).sum();
    if twice < 0.0 {
        points.reverse();
    }
    Polygon::new(points).expect("a quadrilateral")
}

/// The box between two corners, in any order of x.
fn box_of(x0: f64, y0: f64, x1: f64, y1: f64) -> Polygon {
    Polygon::rectangle(Pose::default(), Aabb::new(x0.min(x1), y0, x0.max(x1), y1))
}
