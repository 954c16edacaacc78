//! How near a path comes to the obstacles of its scene.

use crate::geometry::{Aabb, Pose, Vec2, distance_to_segment, is_within, segment_in_box};
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

/// What `measure` finds for a scene, among what is near its path where there is very much else: the same, and sooner.
pub fn measured<E>(
    scene: &Scene,
    path: &PathFile,
    measure: impl Fn(&Scene) -> Result<Clearance, E>,
) -> Result<Clearance, E> {
    /// Vehicle lengths: what is farther than that is looked for among everything.
    const NEAR: f64 = 3.0;
    let reach = NEAR * scene.vehicle.length;
    let poses = path.poses.iter().map(|&[x, y, _]| Vec2::new(x, y));
    let area = Aabb::around(poses).inflated(reach + scene.vehicle.reach());
    if let Some(near) = scene.within(&area)
        && let Ok(found) = measure(&near)
        && found.least.max(found.on_the_way.unwrap_or(0.0)) <= reach
    {
        return Ok(found);
    }
    measure(scene)
}

/// How near `path` comes to the obstacles of its scene, over its poses.
pub fn of(scene: &Scene, path: &PathFile) -> Clearance {
    let measure = |scene: &Scene| Ok::<_, std::convert::Infallible>(among(scene, path));
    let Ok(found) = measured(scene, path, measure);
    found
}

fn among(scene: &Scene, path: &PathFile) -> Clearance {
    let body = scene.vehicle.footprint(0.0);
    let wheels = scene.vehicle.wheel_box(0.0);
    let contour: Vec<Vec2> = scene.contour.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
    let edges: Vec<(&Aabb, [Vec2; 2], bool)> = scene
        .outlines()
        .flat_map(|o| {
            let part = if o.is_low { &wheels } else { &body };
            o.edges().map(move |(a, b)| (part, [a, b], o.is_low)).collect::<Vec<_>>()
        })
        .collect();
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
        let mut here = f64::INFINITY;
        for &(part, edge, is_low) in &edges {
            let edge = edge.map(to_body);
            let box_distance = distance(part, edge);
            if box_distance < here {
                let is_refined = !is_low && !contour.is_empty();
                here = here.min(if is_refined { apart(&contour, edge) } else { box_distance });
            }
        }
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

/// Distance between a simple polygon and a segment.
fn apart(polygon: &[Vec2], [a, b]: [Vec2; 2]) -> f64 {
    let edges = || polygon.iter().copied().zip(polygon.iter().copied().cycle().skip(1));
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp(&(r - p));
    let crosses = |(p, q): (Vec2, Vec2)| {
        side(p, q, a) * side(p, q, b) <= 0.0 && side(a, b, p) * side(a, b, q) <= 0.0
    };
    if is_within(a, edges()) || (a != b && edges().any(crosses)) {
        return 0.0;
    }
    let to = |(p, q): (Vec2, Vec2)| {
        let ends = distance_to_segment(a, p, q).min(distance_to_segment(b, p, q));
        ends.min(distance_to_segment(p, a, b))
    };
    edges().map(to).fold(f64::INFINITY, f64::min)
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
