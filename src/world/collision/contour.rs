//! The outline of a car within its rectangle, and what it sweeps.
//!
//! A car is no rectangle: its corners are cut, and behind its mirrors there is room. What touches the rectangle is
//! looked at once more, exactly, against the outline as convex pieces. For a convex piece the first contact of a motion
//! is between a corner of one and the other, as in [`super::sweep`].

use std::f64::consts::TAU;

use crate::curves::Segment;
use crate::geometry::{Aabb, Vec2, is_within, part_within};
use crate::vehicle::Margins;

/// An outline as convex pieces, counter-clockwise, in the vehicle's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    pieces: Vec<Vec<Vec2>>,
}

impl Contour {
    /// Most vertices of an outline.
    pub const MOST: usize = 64;

    /// The pieces of a simple polygon around the rear axle's centre; what is wrong with it otherwise.
    pub fn new(outline: &[[f64; 2]]) -> Result<Self, String> {
        let mut vertices: Vec<Vec2> = outline.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
        let count = vertices.len();
        if !(3..=Self::MOST).contains(&count) {
            let most = Self::MOST;
            return Err(format!("has {count} vertices; expected 3 to {most}"));
        }
        if !vertices.iter().all(|v| v.x.is_finite() && v.y.is_finite()) {
            return Err("has a vertex that is not finite".to_owned());
        }
        let next = |i: usize| (i + 1) % count;
        let cross = |a: Vec2, b: Vec2| a.x * b.y - a.y * b.x;
        let area: f64 = (0..count).map(|i| cross(vertices[i], vertices[next(i)])).sum();
        if area < 0.0 {
            vertices.reverse();
        }
        for i in 0..count {
            for j in i + 2..count {
                let apart = (next(j)) != i;
                let edge = |k: usize| (vertices[k], vertices[next(k)]);
                if apart && cross_each_other(edge(i), edge(j)) {
                    return Err("crosses itself; expected a simple polygon".to_owned());
                }
            }
        }
        let edges = (0..count).map(|i| (vertices[i], vertices[next(i)]));
        if !is_within(Vec2::zeros(), edges) {
            return Err("does not contain the rear axle's centre, [0, 0]".to_owned());
        }
        let is_convex = (0..count).all(|i| turns_left(&vertices, i));
        let pieces = if is_convex { Some(vec![vertices]) } else { triangles(vertices) };
        match pieces {
            Some(pieces) => Ok(Self { pieces }),
            None => Err("encloses nothing; expected a simple polygon".to_owned()),
        }
    }

    /// The same, larger by a margin on each side, and the mirrors by theirs.
    pub fn grown(&self, margins: Margins) -> Self {
        let grown = |piece: &Vec<Vec2>, margins: Margins| {
            let [front, rear, left, right] = margins.sides();
            let shifts = [(front, left), (front, -right), (-rear, left), (-rear, -right)];
            let corners = piece.iter().flat_map(|v| shifts.map(|(x, y)| v + Vec2::new(x, y)));
            hull(corners.collect())
        };
        let Some(beside_mirrors) = margins.mirrors else {
            return Self { pieces: self.pieces.iter().map(|p| grown(p, margins)).collect() };
        };
        /// What stands out by less is no mirror.
        const SLIVER: f64 = 1e-6;
        let far = f64::INFINITY;
        let [right, left] = self.sides_at_rear_axle();
        let part = |[min, max]: [f64; 2], margins: Margins| {
            let strip = Aabb::new(-far, min, far, max);
            let parts = self.pieces.iter().map(move |piece| part_within(piece.clone(), &strip));
            parts.filter(|part| part.len() > 2).map(move |part| grown(&part, margins))
        };
        let body = part([right, left], margins);
        let mirrors = [[-far, right - SLIVER], [left + SLIVER, far]];
        let mirrors = mirrors.into_iter().flat_map(|side| part(side, beside_mirrors.into()));
        Self { pieces: body.chain(mirrors).collect() }
    }

    /// The least and the greatest y of the outline abreast of the rear axle.
    fn sides_at_rear_axle(&self) -> [f64; 2] {
        let mut sides = [0.0, 0.0];
        for piece in &self.pieces {
            for (i, &a) in piece.iter().enumerate() {
                let b = piece[(i + 1) % piece.len()];
                if a.x * b.x <= 0.0 && a.x != b.x {
                    let y = a.y + (b.y - a.y) * a.x / (a.x - b.x);
                    sides = [f64::min(sides[0], y), f64::max(sides[1], y)];
                }
            }
        }
        sides
    }

    /// The outline of the car's mirror image.
    pub fn mirrored(&self) -> Self {
        let flip = |piece: &Vec<Vec2>| piece.iter().rev().map(|v| Vec2::new(v.x, -v.y)).collect();
        Self { pieces: self.pieces.iter().map(flip).collect() }
    }

    /// Whether it touches the segment `a`–`b` (a point when equal), in the vehicle's frame.
    pub fn touches(&self, a: Vec2, b: Vec2) -> bool {
        self.pieces.iter().any(|piece| meets_convex(piece, a, b))
    }

    /// Whether it meets the segment `a`–`b` while it drives `segment`; it must be free of it at the start.
    ///
    /// Of the two ends only `a` is tested as a corner of its own, as in [`Sweep::hits`](super::Sweep::hits).
    pub fn sweeps(&self, segment: Segment, a: Vec2, b: Vec2) -> bool {
        let turn = segment.turn();
        if turn.abs() < super::sweep::STRAIGHT_TURN {
            let ahead = Vec2::new(segment.length, 0.0);
            return self.pieces.iter().any(|piece| {
                let ends = piece.iter().flat_map(|&v| [v, v + ahead]);
                meets_convex(&hull(ends.collect()), a, b)
            });
        }
        let center = Vec2::new(0.0, 1.0 / segment.curvature);
        let (a, b) = (a - center, b - center);
        self.pieces.iter().any(|piece| {
            let local = |i: usize| piece[i % piece.len()] - center;
            (0..piece.len()).any(|i| {
                let (p, q) = (local(i), local(i + 1));
                // The corner turns with the car; the end of the segment the other way, as seen from it.
                arc_meets(p, turn, a, b) || arc_meets(a, -turn, p, q)
            })
        })
    }
}

/// Whether `p`, turned about the origin by `turn` radians, meets the segment `a`–`b` on its way.
fn arc_meets(p: Vec2, turn: f64, a: Vec2, b: Vec2) -> bool {
    let rho_sq = p.norm_squared();
    let (sin, cos) = (turn / 2.0).sin_cos();
    let middle = Vec2::new(p.x * cos - p.y * sin, p.x * sin + p.y * cos);
    let least = if turn.abs() >= TAU { -2.0 } else { cos } * rho_sq;
    let d = b - a;
    let (dd, ad) = (d.norm_squared(), a.dot(&d));
    if dd == 0.0 {
        return false;
    }
    let discriminant = ad * ad - dd * (a.norm_squared() - rho_sq);
    if discriminant < 0.0 {
        return false;
    }
    let root = discriminant.sqrt();
    let on_arc = |t: f64| (0.0..=1.0).contains(&t) && (a + d * t).dot(&middle) >= least;
    on_arc((-ad - root) / dd) || on_arc((-ad + root) / dd)
}

/// Whether the segment `a`–`b` shares a point with a convex counter-clockwise polygon (Cyrus & Beck 1978).
fn meets_convex(polygon: &[Vec2], a: Vec2, b: Vec2) -> bool {
    let d = b - a;
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    let next = polygon.iter().cycle().skip(1);
    for (p, q) in polygon.iter().zip(next) {
        let outward = Vec2::new(q.y - p.y, p.x - q.x);
        // The part of the segment with outward · (a + t·d − p) ≤ 0.
        let (distance, slope) = (outward.dot(&(a - p)), outward.dot(&d));
        if slope == 0.0 {
            if distance > 0.0 {
                return false;
            }
        } else if slope > 0.0 {
            to = to.min(-distance / slope);
        } else {
            from = from.max(-distance / slope);
        }
    }
    from <= to
}

fn side(a: Vec2, b: Vec2, p: Vec2) -> f64 {
    (b - a).perp(&(p - a))
}

fn cross_each_other((a, b): (Vec2, Vec2), (c, d): (Vec2, Vec2)) -> bool {
    let apart = |p: f64, q: f64| (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0);
    apart(side(a, b, c), side(a, b, d)) && apart(side(c, d, a), side(c, d, b))
}

/// Whether the polygon turns left, or goes straight on, at its vertex `i`.
fn turns_left(polygon: &[Vec2], i: usize) -> bool {
    let n = polygon.len();
    side(polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]) >= 0.0
}

/// A simple counter-clockwise polygon as triangles (by cutting ears); `None` where there are none.
fn triangles(mut polygon: Vec<Vec2>) -> Option<Vec<Vec<Vec2>>> {
    let mut pieces = Vec::new();
    while polygon.len() > 3 {
        let n = polygon.len();
        let is_ear = |&i: &usize| {
            let ear = [polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]];
            let within = |p: &Vec2| !ear.contains(p) && meets_convex(&ear, *p, *p);
            side(ear[0], ear[1], ear[2]) >= 0.0 && !polygon.iter().any(within)
        };
        let i = (0..n).find(is_ear)?;
        pieces.push(vec![polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]]);
        polygon.remove(i);
    }
    pieces.push(polygon);
    // Three in a line enclose nothing.
    pieces.retain(|p| side(p[0], p[1], p[2]) > 0.0);
    (!pieces.is_empty()).then_some(pieces)
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut chain: Vec<Vec2> = Vec::with_capacity(2 * points.len());
    let mut half = |points: &mut dyn Iterator<Item = Vec2>| {
        let least = chain.len() + 1;
        for p in points {
            while chain.len() > least
                && side(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
    };
    half(&mut points.iter().copied());
    half(&mut points.iter().rev().copied());
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A car with cut corners and mirrors, 1.8 m without them.
    const CAR: [[f64; 2]; 16] = [
        [-1.0, -0.6],
        [-0.7, -0.9],
        [2.0, -0.9],
        [2.0, -1.1],
        [2.2, -1.1],
        [2.3, -0.9],
        [3.3, -0.9],
        [3.7, -0.5],
        [3.7, 0.5],
        [3.3, 0.9],
        [2.3, 0.9],
        [2.2, 1.1],
        [2.0, 1.1],
        [2.0, 0.9],
        [-0.7, 0.9],
        [-1.0, 0.6],
    ];

    #[test]
    fn corners_are_cut_and_mirrors_stand_out() {
        let car = Contour::new(&CAR).unwrap();
        let at = |x, y| car.touches(Vec2::new(x, y), Vec2::new(x, y));
        assert!(at(2.1, 1.05) && at(-0.95, 0.0) && at(3.69, 0.0) && at(2.0, 0.0));
        assert!(!at(1.9, 1.0) && !at(2.4, -1.0) && !at(3.65, 0.85) && !at(-0.95, -0.85));
        let (mirrored, front) = (car.mirrored(), Margins { front: 0.2, ..Margins::default() });
        assert!(mirrored.touches(Vec2::new(2.1, -1.05), Vec2::new(2.1, -1.05)));
        let grown = car.grown(front);
        let at = |x, y| grown.touches(Vec2::new(x, y), Vec2::new(x, y));
        assert!(at(3.89, 0.0) && !at(3.91, 0.0) && !at(-1.01, 0.0) && at(2.35, 1.05));
    }

    #[test]
    fn mirrors_have_a_margin_of_their_own() {
        let car = Contour::new(&CAR).unwrap();
        let margins = Margins { left: 0.3, mirrors: Some(0.05), ..Margins::default() };
        for (car, side) in
            [(car.grown(margins), 1.0), (car.mirrored().grown(margins.mirrored()), -1.0)]
        {
            let at = |x: f64, y: f64| car.touches(Vec2::new(x, y * side), Vec2::new(x, y * side));
            // The body to the left, the mirrors on both sides, and nothing between a mirror and its margin.
            assert!(at(0.0, 1.19) && !at(0.0, 1.21) && !at(0.0, -0.91));
            assert!(at(2.1, 1.149) && at(2.1, 1.19) && !at(2.1, 1.21), "the body's is wider");
            assert!(at(2.1, -1.149) && !at(2.1, -1.151) && at(2.24, -1.1) && !at(2.6, -0.95));
        }
        // As wide as the sides' where it is not given.
        let alike = car.grown(Margins { left: 0.3, ..Margins::default() });
        assert!(alike.touches(Vec2::new(2.1, 1.39), Vec2::new(2.1, 1.39)));
    }

    #[test]
    fn says_what_is_wrong() {
        for (outline, wrong) in [
            (&[[0.0, 0.0], [1.0, 0.0]][..], "vertices"),
            (&[[-1., -1.], [1., 1.], [1., -1.], [-1., 1.]], "crosses itself"),
            (&[[1., 1.], [2., 1.], [2., 2.]], "rear axle"),
            (&[[f64::NAN, 1.], [2., 1.], [2., 2.]], "finite"),
        ] {
            assert!(Contour::new(outline).unwrap_err().contains(wrong), "{wrong}");
        }
    }
}
