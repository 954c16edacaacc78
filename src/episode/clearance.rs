//! How near a path comes to the obstacles of its scene.

use crate::geometry::{Aabb, Pose, Vec2};
use crate::output::PathFile;
use crate::world::Scene;

/// Smallest distance between footprint and obstacles over the poses of `path`, metres; infinite
/// without obstacles.
pub fn of(scene: &Scene, path: &PathFile) -> f64 {
    let body = scene.vehicle.footprint(0.0);
    let corner = |p: &[f64; 2]| Vec2::new(p[0], p[1]);
    let mut edges: Vec<[Vec2; 2]> = scene.points.iter().map(|p| [corner(p); 2]).collect();
    for polygon in &scene.obstacles {
        let next = polygon.iter().cycle().skip(1);
        edges.extend(polygon.iter().zip(next).map(|(a, b)| [corner(a), corner(b)]));
    }
    let mut least = f64::INFINITY;
    for &[x, y, heading] in &path.poses {
        let pose = Pose::new(x, y, heading);
        let to_body = |p: Vec2| pose.point_to_local(p);
        for edge in &edges {
            least = least.min(distance(&body, edge.map(to_body)));
        }
    }
    least
}

/// Distance between a box and a segment.
fn distance(body: &Aabb, [a, b]: [Vec2; 2]) -> f64 {
    let outside = |p: Vec2| {
        let nearest =
            Vec2::new(p.x.clamp(body.min.x, body.max.x), p.y.clamp(body.min.y, body.max.y));
        (p - nearest).norm()
    };
    if meets(body, a, b - a) {
        return 0.0;
    }
    let corners =
        [body.min, Vec2::new(body.max.x, body.min.y), body.max, Vec2::new(body.min.x, body.max.y)];
    let along = |c: Vec2| {
        let (d, to) = (b - a, c - a);
        let t = (to.dot(&d) / d.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (to - d * t).norm()
    };
    corners.into_iter().map(along).fold(outside(a).min(outside(b)), f64::min)
}

/// Whether the segment from `a` by `d` has a point in the box.
fn meets(body: &Aabb, a: Vec2, d: Vec2) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (low, high, a, d) in
        [(body.min.x, body.max.x, a.x, d.x), (body.min.y, body.max.y, a.y, d.y)]
    {
        if d == 0.0 {
            if a < low || a > high {
                return false;
            }
            continue;
        }
        let (enter, leave) = ((low - a) / d, (high - a) / d);
        from = from.max(enter.min(leave));
        to = to.min(enter.max(leave));
    }
    from <= to
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_box_are_those_of_a_ruler() {
        let body = Aabb { min: Vec2::new(-1.0, -0.5), max: Vec2::new(3.0, 0.5) };
        let to = |ax, ay, bx, by| distance(&body, [Vec2::new(ax, ay), Vec2::new(bx, by)]);
        assert_eq!(to(0.0, 2.0, 5.0, 2.0), 1.5, "beside an edge");
        assert_eq!(to(4.0, -9.0, 4.0, 9.0), 1.0, "ahead of the nose");
        assert_eq!(to(6.0, 4.5, 6.0, 4.5), 5.0, "a point off a corner");
        assert_eq!(to(-2.0, -2.0, 4.0, 2.0), 0.0, "across");
        assert_eq!(to(0.0, 0.0, 0.1, 0.1), 0.0, "inside");
        let slanting = to(3.0, 1.5, 4.0, 0.5);
        assert!((slanting - 0.5_f64.sqrt()).abs() < 1e-12, "past a corner: {slanting}");
    }
}
