//! How much of one footprint another covers.

use crate::geometry::{Pose, Vec2, part_within};

use super::Vehicle;

impl Vehicle {
    /// Share of the footprint at `goal` that the footprint at `pose` covers, 0 to 1.
    pub fn overlap(&self, pose: Pose, goal: Pose) -> f64 {
        let body = self.footprint(0.0);
        let seen = goal.relative(pose);
        let corners = body.corners().map(|c| seen.point_to_parent(c));
        area(&part_within(corners.to_vec(), &body)) / area(&body.corners())
    }
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
