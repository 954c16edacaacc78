//! A check of paths by other means than the planner's: footprints every centimetre against every edge.

use std::f64::consts::TAU;

use n3p::Vehicle;
use n3p::curves::{Clothoid, SmoothPath};
use n3p::geometry::{Frame, Pose};
use n3p::output::PathFile;
use n3p::world::Scene;

/// How deep a footprint may reach into an obstacle, metres.
const DEPTH: f64 = 1e-4;

/// Panics where `path`, planned in `frame`, is no path of `scene`: ends, steering, motions, bounds, and
/// obstacles, into which nothing may reach deeper than `contact` metres.
pub fn path(scene: &Scene, frame: &Frame, path: &SmoothPath, contact: f64) {
    let file = PathFile::of_smooth(scene, frame, path, "fuzz");
    let vehicle = &scene.vehicle;
    let rounding = 8.0 * scene.start.resolution().max(scene.goal.resolution());
    let first = Pose::from(file.poses[0]);
    assert!(first.distance(scene.start) <= 1e-6 + rounding, "begins elsewhere: {first:?}");
    let shapes = Shapes::new(scene);
    let limit = vehicle.max_steer.tan() / vehicle.wheelbase * (1.0 + 2e-6);
    for i in 0..file.poses.len() - 1 {
        let [here, next] = [i, i + 1].map(|i| near(file.poses[i], scene));
        let to_curvature = |steer: f64| steer.tan() / vehicle.wheelbase;
        let from = to_curvature(file.steer_from.as_ref().map_or(file.steer[i], |s| s[i]));
        let to = to_curvature(file.steer_to.as_ref().map_or(file.steer[i], |s| s[i]));
        assert!(
            from.abs() <= limit && to.abs() <= limit,
            "pose {i}: {from} or {to} beyond {limit}"
        );
        let length = f64::from(file.gears[i]) * chord_to_arc(here, next, f64::midpoint(from, to));
        let motion = Clothoid { from, to, length };
        let steps = (length.abs() / (0.01 * vehicle.scale().min(1.0))).ceil().max(1.0);
        let mut pose = here;
        for step in 1..=steps as u32 {
            pose = drive(here, &motion, f64::from(step) / steps);
            shapes.check(vehicle, pose, i, rounding, contact);
        }
        let turn = turn_between(pose.heading, next.heading);
        let apart = pose.distance(next);
        assert!(
            apart <= 2e-5 + rounding && turn <= 2e-5,
            "pose {i}: leads {apart} m, {turn} rad aside"
        );
    }
}

/// Relative to the start, where numbers are fine.
fn near([x, y, heading]: [f64; 3], scene: &Scene) -> Pose {
    Pose::new(x - scene.start.x, y - scene.start.y, heading)
}

fn turn_between(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(TAU);
    turn.min(TAU - turn)
}

fn chord_to_arc(a: Pose, b: Pose, curvature: f64) -> f64 {
    let chord = a.distance(b);
    let half = curvature.abs() * chord / 2.0;
    if half < 1e-8 { chord } else { 2.0 / curvature.abs() * half.min(1.0).asin() }
}

/// Where a share of a motion leads, by the midpoint rule over short steps.
fn drive(from: Pose, motion: &Clothoid, share: f64) -> Pose {
    let (mut pose, n) = (from, 16);
    let ds = motion.length * share / f64::from(n);
    for i in 0..n {
        let at = |k: f64| {
            motion.from + (motion.to - motion.from) * share * (f64::from(i) + k) / f64::from(n)
        };
        let middle = pose.heading + ds * f64::midpoint(at(0.0), at(0.5)) / 2.0;
        // A chord of an arc is shorter than the arc.
        let half = ds * at(0.5) / 2.0;
        let chord = if half.abs() < 1e-6 { ds } else { ds * half.sin() / half };
        pose.x += chord * middle.cos();
        pose.y += chord * middle.sin();
        pose.heading += ds * f64::midpoint(at(0.0), at(1.0));
    }
    pose
}

/// The obstacles relative to the start.
struct Shapes {
    polygons: Vec<Vec<[f64; 2]>>,
    points: Vec<[f64; 2]>,
    bounds: Option<[f64; 4]>,
}

impl Shapes {
    fn new(scene: &Scene) -> Self {
        let Pose { x, y, .. } = scene.start;
        let moved = |v: &[f64; 2]| [v[0] - x, v[1] - y];
        Self {
            polygons: scene.obstacles.iter().map(|o| o.iter().map(moved).collect()).collect(),
            points: scene.points.iter().map(moved).collect(),
            bounds: scene.bounds.map(|[a, b, c, d]| [a - x, b - y, c - x, d - y]),
        }
    }

    fn check(&self, vehicle: &Vehicle, pose: Pose, i: usize, rounding: f64, contact: f64) {
        if let Some([xmin, ymin, xmax, ymax]) = self.bounds {
            let out = (xmin - pose.x).max(pose.x - xmax).max(ymin - pose.y).max(pose.y - ymax);
            assert!(out <= 1e-6 + rounding, "pose {i}: {out} m out of bounds");
        }
        // The footprint, shrunk, about the rear axle.
        let less = DEPTH + rounding + contact;
        let rear = -vehicle.rear_overhang + less;
        let front = vehicle.length - vehicle.rear_overhang - less;
        let side = vehicle.width / 2.0 - less;
        if rear >= front || side <= 0.0 {
            return;
        }
        let (sin, cos) = pose.heading.sin_cos();
        let local = |v: &[f64; 2]| {
            let (x, y) = (v[0] - pose.x, v[1] - pose.y);
            [x * cos + y * sin, y * cos - x * sin]
        };
        let inside = |[x, y]: [f64; 2]| x > rear && x < front && y.abs() < side;
        for point in &self.points {
            assert!(!inside(local(point)), "pose {i}: covers the point {point:?}");
        }
        for (number, polygon) in self.polygons.iter().enumerate() {
            let corners: Vec<_> = polygon.iter().map(local).collect();
            let mut parity = false;
            let centre = [f64::midpoint(rear, front), 0.0];
            for (k, &a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                assert!(
                    !clips(a, b, [rear, front], side),
                    "pose {i}: obstacle {number} reaches in by its edge {k}"
                );
                if (a[1] > centre[1]) != (b[1] > centre[1]) {
                    let x = a[0] + (centre[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                    parity ^= x > centre[0];
                }
            }
            assert!(!parity || corners.len() < 3, "pose {i}: within obstacle {number}");
        }
    }
}

/// Whether a segment passes through the open rectangle (Liang and Barsky).
fn clips(a: [f64; 2], b: [f64; 2], x: [f64; 2], side: f64) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (p, d, [low, high]) in [(a[0], b[0] - a[0], x), (a[1], b[1] - a[1], [-side, side])] {
        if d == 0.0 {
            if p <= low || p >= high {
                return false;
            }
            continue;
        }
        let (t, u) = ((low - p) / d, (high - p) / d);
        from = from.max(t.min(u));
        to = to.min(t.max(u));
    }
    from < to
}
