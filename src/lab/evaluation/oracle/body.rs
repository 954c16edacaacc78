//! Geometry of the oracle's own: poses that are driven, obstacles and footprints for parry2d.

use std::f64::consts::TAU;

use parry2d_f64::math::{Pose2, Vector2};
use parry2d_f64::query::{self, PointQuery};
use parry2d_f64::shape::{Cuboid, Segment};
use parry2d_f64::transformation::convex_polygons_intersection_points;
use parry2d_f64::utils::point_in_poly2d;

use super::PENETRATION_TOL;
use crate::vehicle::Vehicle;
use crate::world::Shape;

/// A motion whose curvature changes steadily from one value to another, 1/m, over a signed length, metres.
#[derive(Clone, Copy)]
pub(super) struct Motion {
    pub from: f64,
    pub to: f64,
    pub length: f64,
}

/// A rear-axle pose in local coordinates.
#[derive(Clone, Copy)]
pub(super) struct State {
    pub position: Vector2,
    pub heading: f64,
}

impl State {
    /// After the signed arc length `s` of `motion`.
    pub fn driven(self, motion: Motion, s: f64) -> State {
        if motion.from == motion.to { self.on_arc(motion.from, s) } else { self.steered(motion, s) }
    }

    /// The bicycle, integrated by the method of Runge and Kutta.
    fn steered(self, motion: Motion, s: f64) -> State {
        const STEPS: usize = 4;
        let slope = (motion.to - motion.from) / motion.length;
        let h = s / STEPS as f64;
        let way = |heading: f64| Vector2::new(heading.cos(), heading.sin());
        let mut state = self;
        for i in 0..STEPS {
            // The heading is known at every moment; its rate is the curvature.
            let begin = motion.from + slope * h * i as f64;
            let turned = |part: f64| state.heading + part * h * (begin + slope * part * h / 2.0);
            let [a, b, c] = [0.0, 0.5, 1.0].map(|part| way(turned(part)));
            let heading = turned(1.0);
            state = State { position: state.position + (a + b * 4.0 + c) * (h / 6.0), heading };
        }
        state
    }

    /// After the signed arc length `s` at `curvature`: the chord of the arc, at the
    /// mean heading.
    fn on_arc(self, curvature: f64, s: f64) -> State {
        let turn = curvature * s;
        let half = turn / 2.0;
        let chord = if half.abs() < 1e-8 { s } else { s * half.sin() / half };
        let (sin, cos) = (self.heading + half).sin_cos();
        State {
            position: self.position + Vector2::new(cos, sin) * chord,
            heading: self.heading + turn,
        }
    }

    /// Distance and difference of heading, both ≥ 0.
    pub fn apart(self, other: State) -> (f64, f64) {
        let turn = self.heading - other.heading;
        ((self.position - other.position).length(), (turn - TAU * (turn / TAU).round()).abs())
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub min: Vector2,
    pub max: Vector2,
}

impl Extent {
    pub fn around(points: &[Vector2]) -> Self {
        let start = Self { min: Vector2::INFINITY, max: Vector2::NEG_INFINITY };
        points.iter().fold(start, |e, &p| Self { min: e.min.min(p), max: e.max.max(p) })
    }

    /// Distance between the boxes; 0 where they overlap.
    pub fn gap(&self, other: &Extent) -> f64 {
        (self.min - other.max).max(other.min - self.max).max(Vector2::ZERO).length()
    }
}

/// A polygon or a chain of walls, with its edges.
pub(super) struct Solid {
    /// What it is called in the scene.
    pub name: String,
    pub is_low: bool,
    /// Those of what it fills; none where it fills nothing.
    pub filled: Vec<Vector2>,
    pub extent: Extent,
    pub edges: Vec<(Segment, Extent)>,
}

impl Solid {
    pub fn new(name: String, is_low: bool, shape: Shape, vertices: Vec<Vector2>) -> Self {
        let closing = usize::from(shape != Shape::Chain);
        let next = vertices.iter().cycle().skip(1);
        let edges = vertices.iter().zip(next).take(vertices.len() - 1 + closing);
        Self {
            name,
            is_low,
            extent: Extent::around(&vertices),
            edges: edges.map(|(&a, &b)| (Segment::new(a, b), Extent::around(&[a, b]))).collect(),
            filled: if shape == Shape::Solid { vertices } else { Vec::new() },
        }
    }
}

/// The footprint at one pose, or the rectangle around its wheels.
pub(super) struct Body {
    pub pose: Pose2,
    pub half: Vector2,
    pub extent: Extent,
    /// The rear axle.
    axle: Vector2,
    /// The outline within the rectangle, where it is not all of it: counter-clockwise.
    outline: Vec<Vector2>,
}

impl Body {
    pub fn new(vehicle: &Vehicle, at: State) -> Self {
        Self::between(at, [-vehicle.rear_overhang, vehicle.length - vehicle.rear_overhang], vehicle)
    }

    /// The car with an outline given in its own frame.
    pub fn outlined(vehicle: &Vehicle, outline: &[Vector2], at: State) -> Self {
        let turned = Pose2::new(at.position, at.heading);
        let outline = outline.iter().map(|&v| turned * v).collect();
        Self { outline, ..Self::new(vehicle, at) }
    }

    /// The rectangle around the wheels, which reach 0.12 wheelbases ahead of and behind their axles.
    pub fn wheels(vehicle: &Vehicle, at: State) -> Self {
        let radius = 0.12 * vehicle.wheelbase;
        let front = (vehicle.wheelbase + radius).min(vehicle.length - vehicle.rear_overhang);
        Self::between(at, [-radius.min(vehicle.rear_overhang), front], vehicle)
    }

    /// The rectangle from one x in the vehicle's frame to another, as wide as the vehicle.
    fn between(at: State, [rear, front]: [f64; 2], vehicle: &Vehicle) -> Self {
        let (sin, cos) = at.heading.sin_cos();
        let center = at.position + Vector2::new(cos, sin) * ((rear + front) / 2.0);
        let half = Vector2::new(front - rear, vehicle.width) / 2.0;
        let (sin, cos) = (sin.abs(), cos.abs());
        let reach = Vector2::new(cos * half.x + sin * half.y, sin * half.x + cos * half.y);
        let extent = Extent { min: center - reach, max: center + reach };
        let pose = Pose2::new(center, at.heading);
        Self { pose, half, extent, axle: at.position, outline: Vec::new() }
    }

    /// A point that lies within it in any case.
    pub fn inside(&self) -> Vector2 {
        if self.outline.is_empty() { self.pose.translation } else { self.axle }
    }

    /// The outline, smaller by `margin` metres along the bisector at each corner.
    fn shrunk_outline(&self, margin: f64) -> Vec<Vector2> {
        let n = self.outline.len();
        let corner = |i: usize| {
            let [a, b, c] = [i + n - 1, i, i + 1].map(|k| self.outline[k % n]);
            let inward = |v: Vector2| Vector2::new(-v.y, v.x).normalize();
            let (before, after) = (inward(b - a), inward(c - b));
            let between = before + after;
            b + between * (2.0 * margin / between.length_squared().max(0.1))
        };
        (0..n).map(corner).collect()
    }

    fn outline_edges(outline: &[Vector2]) -> impl Iterator<Item = Segment> {
        let next = outline.iter().cycle().skip(1);
        outline.iter().zip(next).map(|(&a, &b)| Segment::new(a, b))
    }

    /// Share of the footprint that `other`, of the same vehicle, covers.
    pub fn covered_by(&self, other: &Body) -> f64 {
        let corners = |body: &Body| {
            let Vector2 { x, y } = body.half;
            let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            signs.map(|(i, j)| body.pose * Vector2::new(i * x, j * y))
        };
        let mut common = Vec::new();
        convex_polygons_intersection_points(&corners(self), &corners(other), &mut common);
        let next = common.iter().cycle().skip(1);
        let twice: f64 = common.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
        twice.abs() / 2.0 / (4.0 * self.half.x * self.half.y)
    }

    /// The rectangle, smaller by `margin` metres on every side.
    pub fn shrunk(&self, margin: f64) -> Cuboid {
        Cuboid::new((self.half - Vector2::splat(margin)).max(Vector2::splat(1e-9)))
    }

    /// Distance from an edge; where it is no less than `nearest`, some number that is no less either.
    pub fn distance_to_edge(&self, edge: &Segment, nearest: f64) -> f64 {
        let distance = query::distance(&self.pose, &self.shrunk(0.0), &Pose2::IDENTITY, edge)
            .expect("parry measures boxes and segments")
            .distance;
        self.refined(distance, nearest, edge)
    }

    /// The outline's distance, where there is one and the rectangle's is less than `nearest`.
    fn refined(&self, distance: f64, nearest: f64, edge: &Segment) -> f64 {
        match distance < nearest {
            true => self.outline_distance(edge).unwrap_or(distance),
            false => distance,
        }
    }

    /// Distance of the outline, where it has one, from an edge.
    fn outline_distance(&self, edge: &Segment) -> Option<f64> {
        if self.outline.is_empty() {
            return None;
        }
        if point_in_poly2d(edge.a, &self.outline) {
            return Some(0.0);
        }
        let to = |own: Segment| {
            query::distance(&Pose2::IDENTITY, &own, &Pose2::IDENTITY, edge)
                .expect("parry measures segments")
                .distance
        };
        Some(Self::outline_edges(&self.outline).map(to).fold(f64::INFINITY, f64::min))
    }

    fn outline_touches(&self, edge: &Segment, margin: f64) -> bool {
        let outline = self.shrunk_outline(margin);
        let meets = |own: Segment| {
            query::intersection_test(&Pose2::IDENTITY, &own, &Pose2::IDENTITY, edge)
                .expect("parry intersects segments")
                .intersecting
        };
        point_in_poly2d(edge.a, &outline) || Self::outline_edges(&outline).any(meets)
    }

    /// [`Body::distance_to_edge`] for a point.
    pub fn distance_to_point(&self, point: Vector2, nearest: f64) -> f64 {
        let distance = self.shrunk(0.0).distance_to_point(&self.pose, point, true);
        self.refined(distance, nearest, &Segment::new(point, point))
    }

    pub fn touches_edge(&self, edge: &Segment, margin: f64) -> bool {
        // How deep it lies in the rectangle says enough; whether it does at all the outline says.
        if !self.outline.is_empty() && !self.outline_touches(edge, PENETRATION_TOL) {
            return false;
        }
        query::intersection_test(&self.pose, &self.shrunk(margin), &Pose2::IDENTITY, edge)
            .expect("parry intersects boxes and segments")
            .intersecting
    }

    pub fn touches_point(&self, point: Vector2, margin: f64) -> bool {
        let touches = || self.outline_touches(&Segment::new(point, point), PENETRATION_TOL);
        (self.outline.is_empty() || touches())
            && self.shrunk(margin).contains_point(&self.pose, point)
    }

    /// How deep something reaches in, millimetres: the shrinking that frees the
    /// footprint of it. `None` within [`PENETRATION_TOL`].
    pub fn depth_mm(&self, touches: impl Fn(f64) -> bool) -> Option<f64> {
        if !touches(PENETRATION_TOL) {
            return None;
        }
        let (mut touching, mut free) = (PENETRATION_TOL, self.half.x.min(self.half.y));
        while free - touching > 1e-5 {
            let middle = (touching + free) / 2.0;
            if touches(middle) {
                touching = middle;
            } else {
                free = middle;
            }
        }
        Some(touching * 1e3)
    }
}
