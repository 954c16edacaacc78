//! Line segments.

use super::{Aabb, Vec2};

/// Distance from `p` to the segment `a`–`b`, metres.
pub fn distance_to_segment(p: Vec2, a: Vec2, b: Vec2) -> f64 {
    let (ab, ap) = (b - a, p - a);
    let len_sq = ab.norm_squared();
    let t = if len_sq > 0.0 { (ap.dot(&ab) / len_sq).clamp(0.0, 1.0) } else { 0.0 };
    (ap - ab * t).norm()
}

/// Whether the segment `a`–`b` shares a point with the box (Liang–Barsky clipping).
pub fn segment_in_box(a: Vec2, b: Vec2, bx: &Aabb) -> bool {
    clip_to_box(a, b, bx).is_some()
}

/// The part `[t0, t1]` of `a + t·(b − a)` inside the box.
fn clip_to_box(a: Vec2, b: Vec2, bx: &Aabb) -> Option<(f64, f64)> {
    let d = b - a;
    let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
    for (p, dir, lo, hi) in [(a.x, d.x, bx.min.x, bx.max.x), (a.y, d.y, bx.min.y, bx.max.y)] {
        if dir == 0.0 {
            if p < lo || p > hi {
                return None;
            }
            continue;
        }
        let (u, v) = ((lo - p) / dir, (hi - p) / dir);
        t0 = t0.max(u.min(v));
        t1 = t1.min(u.max(v));
        if t0 > t1 {
            return None;
        }
    }
    Some((t0, t1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagonal_passes_a_box_corner() {
        let bx = Aabb::new(0.0, 0.0, 1.0, 1.0);
        assert!(segment_in_box(Vec2::new(-1.0, 1.5), Vec2::new(1.5, -1.0), &bx));
        assert!(!segment_in_box(Vec2::new(-1.0, 3.1), Vec2::new(3.1, -1.0), &bx));
        assert!(segment_in_box(Vec2::new(0.5, 0.5), Vec2::new(0.6, 0.5), &bx));
    }

    #[test]
    fn distance_to_a_degenerate_segment_is_to_its_point() {
        let p = Vec2::new(3.0, 4.0);
        assert_eq!(distance_to_segment(p, Vec2::zeros(), Vec2::zeros()), 5.0);
    }
}
