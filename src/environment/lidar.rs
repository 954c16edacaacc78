//! The simulated lidar: exact ray casting against obstacle edges.

use super::BEAMS;
use crate::geometry::{Aabb, Pose, Vec2, distance_to_segment};
use crate::vehicle::Vehicle;

/// Farthest distance a beam sees, metres from the rear axle.
pub const RANGE: f64 = 10.0;

/// Angle between neighbouring beams, radians.
const SPACING: f64 = std::f64::consts::TAU / BEAMS as f64;

/// [`BEAMS`] beams from the rear axle all around, beam 0 along the heading, counter-clockwise.
#[derive(Clone, Debug)]
pub struct Lidar {
    directions: [Vec2; BEAMS],
    /// Distance from the rear axle to the car's own outline along each beam, metres.
    outline: [f64; BEAMS],
}

impl Lidar {
    /// The lidar of `vehicle`.
    pub fn new(vehicle: &Vehicle) -> Self {
        let directions = std::array::from_fn(|i| {
            let (sin, cos) = (i as f64 * SPACING).sin_cos();
            Vec2::new(cos, sin)
        });
        let body = vehicle.footprint(0.0);
        Self { directions, outline: directions.map(|d| way_out(&body, d)) }
    }

    /// Free distance beyond the car's outline along each beam, metres: what is farther than
    /// [`RANGE`] from the rear axle is not seen. Never below 0.
    ///
    /// Single points have no width: the beam next to them in angle sees them.
    pub fn scan(&self, pose: Pose, edges: &[(Vec2, Vec2)]) -> [f32; BEAMS] {
        let hits = self.distances(pose, edges);
        std::array::from_fn(|i| (hits[i] - self.outline[i]).max(0.0) as f32)
    }

    /// Distance from the rear axle to the first edge along each beam, at most [`RANGE`].
    fn distances(&self, pose: Pose, edges: &[(Vec2, Vec2)]) -> [f64; BEAMS] {
        let mut nearest = [RANGE; BEAMS];
        let (sin, cos) = pose.sin_cos();
        let local = |p: Vec2| {
            let (dx, dy) = (p.x - pose.x, p.y - pose.y);
            Vec2::new(cos * dx + sin * dy, cos * dy - sin * dx)
        };
        for &(a, b) in edges {
            let (a, b) = (local(a), local(b));
            if distance_to_segment(Vec2::zeros(), a, b) < RANGE {
                self.see(a, b, &mut nearest);
            }
        }
        nearest
    }

    /// Shortens the beams that meet the edge `a`–`b`, seen from the rear axle.
    fn see(&self, a: Vec2, b: Vec2, nearest: &mut [f64; BEAMS]) {
        /// Beams that miss an end of the edge by rounding see it all the same.
        const SLACK: f64 = 1e-9;
        /// Below this sine between its ends, an edge is seen end-on: as a point.
        const THIN: f64 = 1e-12;
        let cross = a.perp(&b);
        if cross.abs() <= THIN * a.norm() * b.norm() {
            let end = if a.norm_squared() < b.norm_squared() { a } else { b };
            let beam = (end.y.atan2(end.x) / SPACING).round() as isize;
            let seen = &mut nearest[beam.rem_euclid(BEAMS as isize) as usize];
            *seen = seen.min(end.norm());
            return;
        }
        let (a, b) = if cross > 0.0 { (a, b) } else { (b, a) };
        let along = b - a;
        let from = a.y.atan2(a.x);
        let span = cross.abs().atan2(a.dot(&b));
        let first = ((from - SLACK) / SPACING).ceil() as isize;
        let last = ((from + span + SLACK) / SPACING).floor() as isize;
        for beam in first..=last {
            let beam = beam.rem_euclid(BEAMS as isize) as usize;
            let distance = a.perp(&along) / self.directions[beam].perp(&along);
            // Slack may ask a beam about the line beyond the edge's end.
            let farthest = a.norm().max(b.norm());
            if distance >= 0.0 && distance < nearest[beam] {
                nearest[beam] = distance.min(farthest);
            }
        }
    }
}

/// Distance from the origin, inside `body`, to its border in direction `d`.
fn way_out(body: &Aabb, d: Vec2) -> f64 {
    let side = |d: f64, min: f64, max: f64| match d {
        d if d > 0.0 => max / d,
        d if d < 0.0 => min / d,
        _ => f64::INFINITY,
    };
    side(d.x, body.min.x, body.max.x).min(side(d.y, body.min.y, body.max.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Polygon;
    use crate::rng::{Stream, rng};
    use parry2d_f64::math::Vector;
    use parry2d_f64::query::{Ray, RayCast};
    use parry2d_f64::shape::Segment;
    use rand::RngExt;

    #[test]
    fn sees_what_parrys_rays_hit() {
        let lidar = Lidar::new(&Vehicle::default());
        let mut rng = rng(1, Stream::Course, 0);
        let mut hits = 0;
        for _ in 0..2000 {
            let mut r = |a: f64| rng.random_range(-a..a);
            let pose = Pose::new(r(3.0), r(3.0), r(4.0));
            let edges: Vec<_> =
                (0..5).map(|_| (Vec2::new(r(9.0), r(9.0)), Vec2::new(r(9.0), r(9.0)))).collect();
            let seen = lidar.distances(pose, &edges);
            for (i, seen) in seen.into_iter().enumerate() {
                let (y, x) = (pose.heading + i as f64 * SPACING).sin_cos();
                let ray = Ray::new(Vector::new(pose.x, pose.y), Vector::new(x, y));
                let hit = |&(a, b): &(Vec2, Vec2)| {
                    let edge = Segment::new(Vector::new(a.x, a.y), Vector::new(b.x, b.y));
                    edge.cast_local_ray(&ray, RANGE, true)
                };
                let expected = edges.iter().filter_map(hit).fold(RANGE, f64::min);
                hits += usize::from(expected < RANGE);
                assert!((seen - expected).abs() < 1e-6, "{pose:?} {i}: {seen} {expected}");
            }
        }
        assert!(hits > 10_000);
    }

    #[test]
    fn measures_from_the_outline_and_not_beyond_the_range() {
        let vehicle = Vehicle::default();
        let lidar = Lidar::new(&vehicle);
        let free = lidar.scan(Pose::default(), &[]);
        assert!((f64::from(free[0]) - (RANGE - vehicle.front_extent())).abs() < 1e-6);
        assert!((f64::from(free[60]) - (RANGE - vehicle.rear_overhang)).abs() < 1e-6);
        // A wall half a metre to the left, and a point one metre behind.
        let left = vehicle.width / 2.0 + 0.5;
        let back = Vec2::new(-vehicle.rear_overhang - 1.0, 0.0);
        let wall = (Vec2::new(-20.0, left), Vec2::new(20.0, left));
        let seen = lidar.scan(Pose::default(), &[wall, (back, back)]);
        assert!((seen[30] - 0.5).abs() < 1e-6 && (seen[60] - 1.0).abs() < 1e-6);
        assert_eq!(seen[90], free[90]);
    }

    #[test]
    fn an_edge_seen_end_on_is_a_point() {
        let lidar = Lidar::new(&Vehicle::default());
        let edge = |x: f64, y: f64| (Vec2::new(x, 0.0), Vec2::new(y, 0.0));
        let seen = lidar.distances(Pose::default(), &[edge(5.0, 8.0), edge(-7.0, -6.0)]);
        assert_eq!((seen[0], seen[60], seen[1]), (5.0, 6.0, RANGE));
        let square = Polygon::rectangle(Pose::default(), Aabb::new(5.0, 0.0, 6.0, 1.0));
        let edges: Vec<_> = square.edges().collect();
        assert_eq!(lidar.distances(Pose::default(), &edges)[0], 5.0);
    }
}
