//! Rings of vertices: polygons without their holes, and the rectangles of parking spaces.

use super::Spot;
use crate::geometry::{Aabb, Pose, Vec2};

/// A polygon with holes as one ring that leads to each hole and back over a cut without width: it encloses exactly what the
/// polygon does.
pub(super) fn without_holes(mut rings: Vec<Vec<[f64; 2]>>) -> Vec<[f64; 2]> {
    let mut holes = rings.split_off(1);
    let mut ring = rings.swap_remove(0);
    let rightmost = |hole: &Vec<[f64; 2]>| {
        let best = (0..hole.len()).max_by(|&a, &b| hole[a][0].total_cmp(&hole[b][0]));
        best.unwrap_or(0)
    };
    // From the right on: so a cut to the right never meets a hole that is not yet part of the ring.
    holes.sort_by(|a, b| b[rightmost(b)][0].total_cmp(&a[rightmost(a)][0]));
    for hole in holes {
        let from = rightmost(&hole);
        let [x, y] = hole[from];
        // The nearest edge to the right.
        let mut nearest: Option<(usize, f64)> = None;
        for i in 0..ring.len() {
            let ([ax, ay], [bx, by]) = (ring[i], ring[(i + 1) % ring.len()]);
            if (ay > y) == (by > y) {
                continue;
            }
            let at = ax + (y - ay) / (by - ay) * (bx - ax);
            if at >= x && nearest.is_none_or(|(_, best)| at < best) {
                nearest = Some((i, at));
            }
        }
        // A hole that is not inside cuts nothing out.
        let Some((i, at)) = nearest else { continue };
        let there = [at, y];
        let around = hole[from..].iter().chain(&hole[..=from]).copied();
        ring.splice(i + 1..i + 1, std::iter::once(there).chain(around).chain([there]));
    }
    ring
}

impl Spot {
    /// The smallest rectangle around `corners` along their longest edge.
    pub(super) fn around(name: &str, corners: &[[f64; 2]]) -> Spot {
        let next = corners.iter().cycle().skip(1);
        let edges = corners.iter().zip(next).map(|(a, b)| [b[0] - a[0], b[1] - a[1]]);
        let longest = edges.max_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
        let [ex, ey] = longest.unwrap_or([1.0, 0.0]);
        let turned = Pose::new(0.0, 0.0, ey.atan2(ex));
        let local = corners.iter().map(|&[x, y]| turned.point_to_local(Vec2::new(x, y)));
        let around = Aabb::around(local);
        let middle = turned.point_to_parent((around.min + around.max) / 2.0);
        let (length, width) = (around.max.x - around.min.x, around.max.y - around.min.y);
        let middle = Pose::new(middle.x, middle.y, turned.heading);
        Spot { name: name.to_owned(), middle, length, width }
    }

    /// Its corners, counter-clockwise.
    pub fn corners(&self) -> Vec<[f64; 2]> {
        let (x, y) = (self.length / 2.0, self.width / 2.0);
        let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
        corners.map(|[x, y]| self.middle.point_to_parent(Vec2::new(x, y)).into()).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Polygon;

    proptest! {
        #[test]
        fn what_a_hole_leaves_out_is_outside(x in 0.0..10.0_f64, y in 0.0..10.0_f64) {
            let square = |x: f64, y: f64, side: f64| {
                vec![[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
            };
            let holes = [(1.0, 1.0, 2.0), (4.0, 1.5, 3.0), (2.0, 6.0, 1.0), (7.0, 7.0, 2.5)];
            let mut rings = vec![square(0.0, 0.0, 10.0)];
            rings.extend(holes.map(|(x, y, side)| square(x, y, side)));
            let ring = without_holes(rings);
            let polygon = Polygon::new(ring.iter().map(|&[x, y]| Vec2::new(x, y)).collect()).unwrap();
            let inside = |from: f64, side: f64, v: f64| (from..from + side).contains(&v);
            let is_out = holes.iter().any(|&(hx, hy, s)| inside(hx, s, x) && inside(hy, s, y));
            prop_assert_eq!(polygon.contains(Vec2::new(x, y)), !is_out);
        }
    }
}
