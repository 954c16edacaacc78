//! The same car park as a range sensor sees it: points on what is visible from the lane.

use super::draw::Draw;
use super::things::Things;
use crate::geometry::{Aabb, Vec2};

/// Largest distance that is seen, metres.
const RANGE: f64 = 25.0;
/// A point hides nothing that is nearer behind it than this, metres.
const DEPTH: f64 = 0.01;

/// Points every 0.1 to 0.2 m on the outlines that are visible from one of the `eyes`.
pub(super) fn scanned(things: &Things, eyes: &[Vec2], draw: &mut Draw) -> Things {
    let edges: Vec<([Vec2; 2], Aabb)> =
        things.edges().map(|edge| (edge, Aabb::around(edge))).collect();
    let is_hidden = |p: Vec2, eye: Vec2| {
        let distance = (p - eye).norm();
        let before = eye + (p - eye) * (1.0 - DEPTH / distance.max(2.0 * DEPTH));
        let ray = Aabb::around([eye, before]);
        distance > RANGE
            || edges
                .iter()
                .any(|(edge, extent)| ray.intersects(extent) && cross([eye, before], edge))
    };
    let is_seen = |p: Vec2| eyes.iter().any(|&eye| !is_hidden(p, eye));
    let step = draw.between(0.1, 0.2);
    let mut points: Vec<Vec2> = things.points.iter().copied().filter(|&p| is_seen(p)).collect();
    for ([a, b], _) in &edges {
        let n = ((b - a).norm() / step).ceil().max(1.0) as u32;
        let on_edge = (0..n).map(|i| a + (b - a) * (f64::from(i) / f64::from(n)));
        points.extend(on_edge.chain([*b]).filter(|&p| is_seen(p)));
    }
    // Where two edges meet both have seen the same.
    let mut seen = std::collections::HashSet::new();
    points.retain(|p| seen.insert([p.x.to_bits(), p.y.to_bits()]));
    Things { points, ..Things::default() }
}

/// Whether two segments cross.
fn cross([a, b]: [Vec2; 2], [c, d]: &[Vec2; 2]) -> bool {
    let side = |a: Vec2, b: Vec2, p: Vec2| (b - a).perp(&(p - a)) > 0.0;
    side(a, b, *c) != side(a, b, *d) && side(*c, *d, a) != side(*c, *d, b)
}

#[cfg(test)]
mod tests {
    use super::super::things::around;
    use super::*;
    use crate::geometry::{Polygon, Pose};
    use crate::rng::{Stream, rng};

    #[test]
    fn the_far_side_of_a_box_is_not_seen() {
        let box_at = |x| Polygon::rectangle(Pose::new(x, 0.0, 0.0), around(2.0, 2.0));
        let things = Things { solids: vec![box_at(5.0), box_at(9.0)], ..Things::default() };
        let seen = scanned(&things, &[Vec2::zeros()], &mut Draw::new(rng(1, Stream::Lot, 0)));
        let points = &seen.points;
        assert!(points.iter().all(|p| (p.x - 4.0).abs() < 1e-9), "{points:?}");
        assert!((11..=23).contains(&points.len()), "{}", points.len());
    }
}
