//! The region a rectangle sweeps while it drives a segment, tested exactly.
//!
//! Seen from the vehicle at the segment's start. A straight sweeps a longer rectangle. On
//! an arc the rectangle turns about the centre `(0, 1/κ)`. When a convex shape turns into
//! a segment, the first contact is between a corner of one and the other. So, from a free
//! start, there is a contact iff
//! - the arc of one of the rectangle's four corners meets the segment, or
//! - an end of the segment, which turns the other way as seen from the vehicle, meets one
//!   of the rectangle's sides.
//!
//! Both are circle–line intersections; whether an intersection lies within the turned
//! angle Δ is one dot product with the arc's middle direction: `p·m ≥ ρ² cos(Δ/2)`. That holds
//! up to a whole turn, beyond which nothing new is swept.

use std::f64::consts::TAU;

use crate::curves::Segment;
use crate::geometry::{Aabb, Vec2, segment_in_box};

/// Turns below this (radians) are straights: over the longest segment they bend by less than a nanometre.
pub(super) const STRAIGHT_TURN: f64 = 1e-11;

/// A segment and a footprint, prepared for many tests.
#[derive(Clone, Debug)]
pub struct Sweep {
    segment: Segment,
    aabb: Aabb,
    shape: Shape,
}

#[derive(Clone, Debug)]
enum Shape {
    /// The swept rectangle is the bounding box itself.
    Straight,
    Arc(ArcSweep),
}

#[derive(Clone, Debug)]
struct ArcSweep {
    footprint: Aabb,
    /// y of the turning centre; its x is 0.
    center_y: f64,
    /// Cosine and sine of half the turned angle.
    cos_half: f64,
    sin_half: f64,
    /// What lies on an arc has at least this cosine to its middle: that of half the turned angle;
    /// for a whole turn less than any cosine.
    least_cos: f64,
    /// Each corner's arc: middle direction scaled by its radius, and radius squared.
    corners: [(Vec2, f64); 4],
    /// Smallest and largest swept radius, squared.
    inner_sq: f64,
    outer_sq: f64,
}

impl Sweep {
    /// The sweep of `footprint` (vehicle frame) along `segment`.
    pub fn new(footprint: &Aabb, segment: Segment) -> Self {
        let turn = segment.turn();
        if turn.abs() < STRAIGHT_TURN {
            let mut aabb = *footprint;
            aabb.min.x += segment.length.min(0.0);
            aabb.max.x += segment.length.max(0.0);
            return Self { segment, aabb, shape: Shape::Straight };
        }
        let center_y = 1.0 / segment.curvature;
        let is_whole = turn.abs() >= TAU;
        let (sin_half, cos_half) = (turn / 2.0).sin_cos();
        let least_cos = if is_whole { -2.0 } else { cos_half };
        let (sin, cos) = (2.0 * sin_half * cos_half, cos_half * cos_half - sin_half * sin_half);
        let mut aabb = Aabb::EMPTY;
        let (mut outer_sq, mut inner_sq) = (0.0_f64, f64::INFINITY);
        let corners = footprint.corners().map(|c| {
            let q = Vec2::new(c.x, c.y - center_y);
            let radius_sq = q.norm_squared();
            outer_sq = outer_sq.max(radius_sq);
            inner_sq = inner_sq.min(radius_sq);
            let middle =
                Vec2::new(q.x * cos_half - q.y * sin_half, q.x * sin_half + q.y * cos_half);
            let end = Vec2::new(q.x * cos - q.y * sin, q.x * sin + q.y * cos + center_y);
            aabb = aabb.include(c).include(end);
            // An axis direction within the arc is where it bulges furthest.
            let radius = radius_sq.sqrt();
            for axis in [Vec2::x(), -Vec2::x(), Vec2::y(), -Vec2::y()] {
                if axis.dot(&middle) >= radius * least_cos {
                    aabb = aabb.include(axis * radius + Vec2::new(0.0, center_y));
                }
            }
            (middle, radius_sq)
        });
        // The side next to the centre comes closest beside the centre, not at a corner.
        if footprint.min.x <= 0.0 && footprint.max.x >= 0.0 {
            let gap = (center_y - footprint.max.y).max(footprint.min.y - center_y).max(0.0);
            inner_sq = inner_sq.min(gap * gap);
        }
        let arc = ArcSweep {
            footprint: *footprint,
            center_y,
            cos_half,
            sin_half,
            least_cos,
            corners,
            inner_sq,
            outer_sq,
        };
        Self { segment, aabb, shape: Shape::Arc(arc) }
    }

    /// The segment swept along.
    pub fn segment(&self) -> Segment {
        self.segment
    }

    /// A box around the swept region, in the frame of the vehicle at the start.
    pub fn aabb(&self) -> &Aabb {
        &self.aabb
    }

    /// Whether the segment `a`–`b` is not wholly on one side of the box around the swept region.
    #[inline]
    pub fn is_near(&self, a: Vec2, b: Vec2) -> bool {
        let Aabb { min, max } = &self.aabb;
        !((a.x < min.x && b.x < min.x)
            || (a.x > max.x && b.x > max.x)
            || (a.y < min.y && b.y < min.y)
            || (a.y > max.y && b.y > max.y))
    }

    /// Whether the sweep meets the obstacle segment `a`–`b` (a point when equal), given in
    /// the frame of the vehicle at the start, where the footprint must be free of it.
    ///
    /// Of the two ends only `a` is tested as a corner of its own: in a polygon's boundary
    /// every vertex is the `a` of one edge.
    pub fn hits(&self, a: Vec2, b: Vec2) -> bool {
        if !self.is_near(a, b) {
            return false;
        }
        match &self.shape {
            Shape::Straight => segment_in_box(a, b, &self.aabb),
            Shape::Arc(arc) => {
                let center = Vec2::new(0.0, arc.center_y);
                let a = a - center;
                arc.point_hits(a) || arc.corners_hit(a, b - center)
            }
        }
    }
}

impl ArcSweep {
    /// Whether the point `q`, relative to the turning centre, is swept over.
    fn point_hits(&self, q: Vec2) -> bool {
        let rho_sq = q.norm_squared();
        if rho_sq < self.inner_sq || rho_sq > self.outer_sq {
            return false;
        }
        // Seen from the vehicle the point turns by −Δ; this is the middle of its arc.
        let (c, s) = (self.cos_half, self.sin_half);
        let middle = Vec2::new(q.x * c + q.y * s, q.y * c - q.x * s);
        let threshold = rho_sq * self.least_cos;
        let f = &self.footprint;
        let (y_min, y_max) = (f.min.y - self.center_y, f.max.y - self.center_y);
        for x in [f.min.x, f.max.x] {
            let rest = rho_sq - x * x;
            if rest >= 0.0 {
                let root = rest.sqrt();
                for y in [root, -root] {
                    if y >= y_min && y <= y_max && x * middle.x + y * middle.y >= threshold {
                        return true;
                    }
                }
            }
        }
        for y in [y_min, y_max] {
            let rest = rho_sq - y * y;
            if rest >= 0.0 {
                let root = rest.sqrt();
                for x in [root, -root] {
                    if x >= f.min.x && x <= f.max.x && x * middle.x + y * middle.y >= threshold {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Whether a corner's arc meets the segment `a`–`b`, relative to the turning centre.
    fn corners_hit(&self, a: Vec2, b: Vec2) -> bool {
        let d = b - a;
        let (dd, ad, aa) = (d.norm_squared(), a.dot(&d), a.norm_squared());
        if dd == 0.0 || (aa < self.inner_sq && b.norm_squared() < self.inner_sq) {
            return false;
        }
        let base = ad * ad - dd * aa;
        for &(middle, rho_sq) in &self.corners {
            let discriminant = base + dd * rho_sq;
            if discriminant < 0.0 {
                continue;
            }
            let root = discriminant.sqrt();
            for t in [(-ad - root) / dd, (-ad + root) / dd] {
                if (0.0..=1.0).contains(&t) && (a + d * t).dot(&middle) >= rho_sq * self.least_cos {
                    return true;
                }
            }
        }
        false
    }
}
