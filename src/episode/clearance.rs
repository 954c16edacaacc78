//! How near a path comes to the obstacles of its scene.

use crate::geometry::{Aabb, Pose, Vec2, distance_to_segment, segment_in_box};
use crate::output::PathFile;
use crate::world::Scene;

/// The part of a path that is not on the way: so far after the start and before the goal, metres for
/// the default vehicle. There the distances are given.
pub const WAY_ENDS: f64 = 1.0;

/// Smallest distances between footprint and obstacles, metres: infinite without obstacles, 0 on
/// contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Along the whole path.
    pub least: f64,
    /// Without the [`WAY_ENDS`]; `None` where nothing is left of the path.
    pub on_the_way: Option<f64>,
}

/// How near `path` comes to the obstacles of its scene, over its poses.
pub fn of(scene: &Scene, path: &PathFile) -> Clearance {
    let body = scene.vehicle.footprint(0.0);
    let corner = |p: &[f64; 2]| Vec2::new(p[0], p[1]);
    let mut edges: Vec<[Vec2; 2]> = scene.points.iter().map(|p| [corner(p); 2]).collect();
    for outline in &scene.obstacles {
        let next = outline.iter().cycle().skip(1);
        edges.extend(outline.iter().zip(next).map(|(a, b)| [corner(a), corner(b)]));
    }
    let poses: Vec<Pose> = path.poses.iter().map(|&p| p.into()).collect();
    let mut driven = vec![0.0];
    for pair in poses.windows(2) {
        driven.push(driven[driven.len() - 1] + pair[0].distance(pair[1]));
    }
    let ends = WAY_ENDS * scene.vehicle.scale();
    let way = ends..=driven[driven.len() - 1] - ends;
    let (mut least, mut on_the_way) = (f64::INFINITY, f64::INFINITY);
    for (pose, driven) in poses.into_iter().zip(driven) {
        let to_body = |p: Vec2| pose.point_to_local(p);
        let here =
            edges.iter().map(|e| distance(&body, e.map(to_body))).fold(f64::INFINITY, f64::min);
        least = least.min(here);
        if way.contains(&driven) {
            on_the_way = on_the_way.min(here);
        }
    }
    Clearance { least, on_the_way: (!way.is_empty()).then_some(on_the_way) }
}

/// Distance between a box and a segment.
fn distance(body: &Aabb, [a, b]: [Vec2; 2]) -> f64 {
    let outside = |p: Vec2| {
        let nearest =
            Vec2::new(p.x.clamp(body.min.x, body.max.x), p.y.clamp(body.min.y, body.max.y));
        (p - nearest).norm()
    };
    if segment_in_box(a, b, body) {
        return 0.0;
    }
    let corners =
        [body.min, Vec2::new(body.max.x, body.min.y), body.max, Vec2::new(body.min.x, body.max.y)];
    let along = |c: Vec2| distance_to_segment(c, a, b);
    corners.into_iter().map(along).fold(outside(a).min(outside(b)), f64::min)
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
