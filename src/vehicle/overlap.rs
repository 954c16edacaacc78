//! How much of one footprint another covers.

use crate::geometry::{Aabb, Pose, Vec2};

use super::Vehicle;

impl Vehicle {
    /// Share of the footprint at `goal` that the footprint at `pose` covers, 0 to 1.
    pub fn overlap(&self, pose: Pose, goal: Pose) -> f64 {
        let body = self.footprint(0.0);
        let seen = goal.relative(pose);
        let corners = body.corners().map(|c| seen.point_to_parent(c));
        area(&clip(corners.to_vec(), &body)) / area(&body.corners())
    }
}

/// The part of a convex polygon inside `bx` (Sutherland & Hodgman 1974).
fn clip(polygon: Vec<Vec2>, bx: &Aabb) -> Vec<Vec2> {
    // Each side as the signed distance to its inside.
    let sides: [&dyn Fn(Vec2) -> f64; 4] =
        [&|p| p.x - bx.min.x, &|p| bx.max.x - p.x, &|p| p.y - bx.min.y, &|p| bx.max.y - p.y];
    sides.iter().fold(polygon, |polygon, inside| {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &b) in polygon.iter().enumerate() {
            let a = polygon[(i + polygon.len() - 1) % polygon.len()];
            let (da, db) = (inside(a), inside(b));
            if (da < 0.0) != (db < 0.0) {
                kept.push(a + (b - a) * (da / (da - db)));
            }
            if db >= 0.0 {
                kept.push(b);
            }
        }
        kept
    })
}

/// Area of a counter-clockwise polygon (shoelace formula).
fn area(polygon: &[Vec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| a.perp(b)).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn known_overlaps() {
        let v = Vehicle::default();
        let goal = Pose::new(3.0, -2.0, 0.8);
        let at = |x, y, heading| {
            let center = v.body_center(goal).compose(Pose::new(x, y, heading));
            v.overlap(v.rear_axle(center), goal)
        };
        for (overlap, expected) in [
            (at(0.0, 0.0, 0.0), 1.0),
            (at(0.0, 0.0, PI), 1.0),
            (at(v.length / 2.0, 0.0, 0.0), 0.5),
            (at(0.0, -v.width / 4.0, 0.0), 0.75),
            (at(v.length, 0.0, 0.0), 0.0),
            (at(20.0, 3.0, 0.3), 0.0),
            (at(0.0, 0.0, FRAC_PI_2), v.width / v.length),
        ] {
            assert!((overlap - expected).abs() < 1e-9, "{overlap} {expected}");
        }
    }
}
