//! Geometry of the oracle's own: poses that are driven, obstacles and footprints for parry2d.

use std::f64::consts::TAU;

use parry2d_f64::math::{Pose2, Vector2};
use parry2d_f64::query::{self, PointQuery};
use parry2d_f64::shape::{Cuboid, Segment};
use parry2d_f64::transformation::convex_polygons_intersection_points;

use super::PENETRATION_TOL;
use crate::vehicle::Vehicle;

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

/// A solid polygon with its edges.
pub(super) struct Solid {
    pub vertices: Vec<Vector2>,
    pub extent: Extent,
    pub edges: Vec<(Segment, Extent)>,
}

impl Solid {
    pub fn new(vertices: Vec<Vector2>) -> Self {
        let next = vertices.iter().cycle().skip(1);
        let edges = vertices.iter().zip(next);
        Self {
            extent: Extent::around(&vertices),
            edges: edges.map(|(&a, &b)| (Segment::new(a, b), Extent::around(&[a, b]))).collect(),
            vertices,
        }
    }
}

/// The footprint at one pose.
pub(super) struct Body {
    pub pose: Pose2,
    pub half: Vector2,
    pub extent: Extent,
}

impl Body {
    pub fn new(vehicle: &Vehicle, at: State) -> Self {
        let (sin, cos) = at.heading.sin_cos();
        let offset = vehicle.length / 2.0 - vehicle.rear_overhang;
        let center = at.position + Vector2::new(cos, sin) * offset;
        let half = Vector2::new(vehicle.length, vehicle.width) / 2.0;
        let (sin, cos) = (sin.abs(), cos.abs());
        let reach = Vector2::new(cos * half.x + sin * half.y, sin * half.x + cos * half.y);
        let extent = Extent { min: center - reach, max: center + reach };
        Self { pose: Pose2::new(center, at.heading), half, extent }
    }

    pub fn center(&self) -> Vector2 {
        self.pose.translation
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

    pub fn distance_to_edge(&self, edge: &Segment) -> f64 {
        query::distance(&self.pose, &self.shrunk(0.0), &Pose2::IDENTITY, edge)
            .expect("parry measures boxes and segments")
            .distance
    }

    pub fn distance_to_point(&self, point: Vector2) -> f64 {
        self.shrunk(0.0).distance_to_point(&self.pose, point, true)
    }

    pub fn touches_edge(&self, edge: &Segment, margin: f64) -> bool {
        query::intersection_test(&self.pose, &self.shrunk(margin), &Pose2::IDENTITY, edge)
            .expect("parry intersects boxes and segments")
            .intersecting
    }

    pub fn touches_point(&self, point: Vector2, margin: f64) -> bool {
        self.shrunk(margin).contains_point(&self.pose, point)
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
