//! The exact swept check against parry2d: distances along the motion, stepped so that no
//! contact can hide between two steps.

#![cfg(feature = "lab")]

use n3p::curves::Segment;
use n3p::geometry::{Polygon, Pose, Vec2};
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use n3p::world::Obstacles;
use n3p::world::collision::CollisionWorld;
use parry2d_f64::math::{Pose as ParryPose, Vector};
use parry2d_f64::query;
use parry2d_f64::shape::{Ball, ConvexPolygon, Cuboid, Shape};
use rand::{Rng, RngExt};

/// Closer than this to contact, either verdict is accepted.
const CONTACT: f64 = 1e-3;

#[derive(Debug, PartialEq)]
enum Verdict {
    Free,
    Hit,
    Grazing,
}

/// The verdict of the oracle, written apart from the crate's own motion code.
fn oracle(shapes: &[Box<dyn Shape>], v: &Vehicle, start: Pose, segment: Segment) -> Verdict {
    let half = Vector::new(v.length / 2.0, v.width / 2.0);
    let (body, small) = (Cuboid::new(half), Cuboid::new(half - Vector::splat(CONTACT)));
    let reach = v.length.hypot(v.width);
    let speed = 1.0 + segment.curvature.abs() * reach;
    let mut verdict = Verdict::Free;
    let mut s = 0.0;
    let total = segment.length.abs();
    loop {
        // Rear axle after the signed length: chord of the circle, written with the half turn.
        let len = s * segment.length.signum();
        let half_turn = segment.curvature * len / 2.0;
        let chord = if half_turn.abs() < 1e-9 { len } else { len * half_turn.sin() / half_turn };
        let (x, y) = (
            start.x + chord * (start.heading + half_turn).cos(),
            start.y + chord * (start.heading + half_turn).sin(),
        );
        let heading = start.heading + 2.0 * half_turn;
        let offset = v.length / 2.0 - v.rear_overhang;
        let center = Vector::new(x + offset * heading.cos(), y + offset * heading.sin());
        let pose = ParryPose::new(center, heading);
        let mut gap = f64::INFINITY;
        for shape in shapes {
            let world = ParryPose::default();
            let d = query::distance(&pose, &body, &world, shape.as_ref()).unwrap().distance;
            gap = gap.min(d);
            if d == 0.0
                && query::intersection_test(&pose, &small, &world, shape.as_ref())
                    .unwrap()
                    .intersecting
            {
                return Verdict::Hit;
            }
        }
        if gap < CONTACT {
            verdict = Verdict::Grazing;
        }
        if s >= total {
            return verdict;
        }
        s = (s + (gap - CONTACT / 2.0).max(CONTACT / 4.0) / speed).min(total);
    }
}

fn random_shape(rng: &mut impl Rng) -> (Obstacles, Box<dyn Shape>) {
    let at = Vec2::new(rng.random_range(-4.0..7.0), rng.random_range(-3.5..3.5));
    let mut draw = |n: usize| -> Vec<Vec2> {
        (0..n)
            .map(|_| at + Vec2::new(rng.random_range(-2.0..2.0), rng.random_range(-2.0..2.0)))
            .collect()
    };
    let choice = (at.x * 1e6).abs() as usize % 4;
    if choice == 0 {
        let ball = Ball::new(1e-9);
        let moved = parry2d_f64::shape::Compound::new(vec![(
            ParryPose::new(Vector::new(at.x, at.y), 0.0),
            parry2d_f64::shape::SharedShape::new(ball),
        )]);
        return (Obstacles::new(vec![], vec![], vec![at]).unwrap(), Box::new(moved));
    }
    loop {
        let points: Vec<Vector> = draw(2 + choice).iter().map(|p| Vector::new(p.x, p.y)).collect();
        let Some(hull) = ConvexPolygon::from_convex_hull(&points) else { continue };
        let vertices = hull.points().iter().map(|p| Vec2::new(p.x, p.y)).collect();
        let Ok(polygon) = Polygon::new(vertices) else { continue };
        return (Obstacles::new(vec![polygon], vec![], vec![]).unwrap(), Box::new(hull));
    }
}

#[test]
fn swept_check_agrees_with_dense_distances_on_200_000_motions() {
    let vehicle = Vehicle::default();
    let mut rng = rng(11, Stream::Scene, 0);
    let (mut free, mut hit, mut grazing, mut blocked) = (0, 0, 0, 0);
    while free + hit + grazing < 200_000 {
        let (obstacles, shape) = random_shape(&mut rng);
        let world = CollisionWorld::new(&obstacles, None, &vehicle, 0.0);
        let start = Pose::new(
            rng.random_range(-0.5..0.5),
            rng.random_range(-0.5..0.5),
            rng.random_range(-4.0..4.0),
        );
        let shapes = [shape];
        for _ in 0..3 {
            let length: f64 = rng.random_range(-6.0..6.0);
            let curvature = match rng.random_range(0..4) {
                0 => 0.0,
                1 => vehicle.max_curvature() * if rng.random_bool(0.5) { 1.0 } else { -1.0 },
                _ => rng.random_range(-0.35..0.35),
            };
            let segment = Segment { curvature, length };
            match oracle(&shapes, &vehicle, start, Segment::straight(0.0)) {
                Verdict::Free => assert!(world.pose_is_free(start), "{obstacles:?} {start:?}"),
                Verdict::Hit => {
                    assert!(!world.pose_is_free(start), "{obstacles:?} {start:?}");
                    blocked += 1;
                    break;
                }
                Verdict::Grazing => break,
            }
            let ours = world.segment_is_free(start, segment);
            let seen = oracle(&shapes, &vehicle, start, segment);
            match seen {
                Verdict::Free => free += 1,
                Verdict::Hit => hit += 1,
                Verdict::Grazing => grazing += 1,
            }
            let agrees = match seen {
                Verdict::Free => ours,
                Verdict::Hit => !ours,
                Verdict::Grazing => true,
            };
            assert!(agrees, "{seen:?} {obstacles:?} {start:?} {segment:?}");
        }
    }
    let counts = format!("free {free}, hit {hit}, grazing {grazing}, blocked starts {blocked}");
    println!("{counts}");
    assert!(free > 30_000 && hit > 15_000 && blocked > 10_000 && grazing < 1_000, "{counts}");
}

#[test]
fn a_car_inside_a_big_polygon_is_not_free() {
    let square = [(-50., -50.), (50., -50.), (50., 50.), (-50., 50.)];
    let polygon = Polygon::new(square.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap();
    let obstacles = Obstacles::new(vec![polygon], vec![], vec![]).unwrap();
    let world = CollisionWorld::new(&obstacles, None, &Vehicle::default(), 0.0);
    assert!(!world.pose_is_free(Pose::default()));
    assert!(world.pose_is_free(Pose::new(60.0, 0.0, 0.0)));
}

#[test]
fn nothing_tunnels_through_a_thin_wall() {
    let wall = [(3.0, -9.0), (3.001, -9.0), (3.001, 9.0), (3.0, 9.0)];
    let polygon = Polygon::new(wall.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap();
    let obstacles = Obstacles::new(vec![polygon], vec![], vec![]).unwrap();
    let world = CollisionWorld::new(&obstacles, None, &Vehicle::default(), 0.0);
    let start = Pose::new(-5.0, 0.0, 0.0);
    assert!(world.pose_is_free(start));
    for curvature in [0.0, 0.01, -0.05] {
        assert!(!world.segment_is_free(start, Segment { curvature, length: 30.0 }));
    }
    assert!(world.segment_is_free(start, Segment::straight(4.0)));
    assert!(world.segment_is_free(start, Segment::straight(-30.0)));
}
