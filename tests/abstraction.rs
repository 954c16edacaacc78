//! The abstraction is an inner approximation: no obstacle reaches into it, ever.

#![cfg(feature = "lab")]

use std::f64::consts::PI;

use n3p::geometry::{Aabb, Polygon, Pose, Vec2, signed_angle};
use n3p::planners::{Budget, HybridAStar, HybridAStarConfig, Planner, Problem};
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use n3p::world::abstraction::abstractions;
use n3p::world::cell::Grid;
use n3p::world::collision::CollisionWorld;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, Obstacles, ParkingType, Stance};
use parry2d_f64::math::{Pose as ParryPose, Vector};
use parry2d_f64::query;
use parry2d_f64::shape::ConvexPolygon;
use rand::{Rng, RngExt};

/// Regions are tested this much smaller: obstacles may touch their border.
const SHRINK: f64 = 1e-4;

fn region_is_free(region: &Polygon, obstacles: &Obstacles) -> bool {
    let corners = region.vertices();
    let center = corners.iter().sum::<Vec2>() / corners.len() as f64;
    let toward = |v: &Vec2| v + (center - v) * (SHRINK / (center - v).norm());
    let smaller = region.map(|v| toward(&v));
    let hull = |p: &Polygon| {
        let points: Vec<_> = p.vertices().iter().map(|v| Vector::new(v.x, v.y)).collect();
        ConvexPolygon::from_convex_hull(&points).expect("a convex polygon")
    };
    let (at, region) = (ParryPose::default(), hull(&smaller));
    let hit =
        |p: &Polygon| query::intersection_test(&at, &region, &at, &hull(p)).unwrap().intersecting;
    let inside = |p: &Vec2| smaller.contains(*p);
    !obstacles.polygons().iter().any(hit) && !obstacles.points().iter().any(inside)
}

/// Boxes at any angle and points, anywhere but on the parked car.
fn clutter(rng: &mut impl Rng, vehicle: &Vehicle, goal: Pose) -> Obstacles {
    let (mut polygons, mut points) = (Vec::new(), Vec::new());
    for _ in 0..rng.random_range(0..12) {
        let (x, y) = (rng.random_range(-14.0..14.0), rng.random_range(-5.0..12.0));
        let at = Pose::new(x, y, rng.random_range(-3.2..3.2));
        let (a, b) = (rng.random_range(0.05..3.0), rng.random_range(0.05..1.5));
        if rng.random_bool(0.3) {
            points.push(at.position());
        } else {
            polygons.push(Polygon::rectangle(at, Aabb::new(-a, -b, a, b)));
        }
    }
    let alone = |polygons, points| {
        let alone = Obstacles::new(polygons, vec![], points).unwrap();
        CollisionWorld::new(&alone, None, vehicle, 0.0).pose_is_free(goal)
    };
    polygons.retain(|p| alone(vec![p.clone()], vec![]));
    points.retain(|p| alone(vec![], vec![*p]));
    Obstacles::new(polygons, vec![], points).unwrap()
}

#[test]
fn no_obstacle_enters_any_abstraction() {
    let (grid, vehicle) = (Grid::default(), Vehicle::default());
    let mut rng = rng(21, Stream::Scene, 0);
    let mut found = [0; 4];
    for i in 0..40_000 {
        let kind = ParkingType::ALL[i % 4];
        // Any slant: what is none of the grid's is seen in a frame turned to one that is.
        let slant = rng.random_range(30.0..150.0_f64).to_radians();
        let heading = if rng.random_bool(0.5) { slant } else { slant - PI };
        let stance = Stance::new(kind, heading);
        let obstacles = clutter(&mut rng, &vehicle, grid.goal(stance, &vehicle));
        for a in abstractions(&obstacles, stance, &grid) {
            found[i % 4] += 1;
            let parked = a.in_cell(grid.goal(stance, &vehicle));
            let in_cell = grid.goal(a.cell.stance, &vehicle);
            let out = a.cell.stance.out() * a.shift;
            let deeper = Pose { x: in_cell.x - out.x, y: in_cell.y - out.y, ..in_cell };
            assert!(parked.distance(deeper) < 1e-9, "{a:?}: {parked:?} {deeper:?}");
            assert!(signed_angle(parked.heading, deeper.heading).abs() < 1e-9, "{a:?}");
            assert_eq!(grid.cell(kind, a.index), a.cell);
            assert!(a.measured.lane_width >= a.cell.lane_width - 1e-9, "{a:?}");
            assert!(a.measured.spot_width >= a.cell.spot_width - 1e-9, "{a:?}");
            assert!(a.measured.dead_end >= a.cell.dead_end - 1e-9, "{a:?}");
            for region in a.regions(&grid) {
                assert!(region_is_free(&region, &obstacles), "{a:?} {region:?} {obstacles:?}");
            }
        }
    }
    assert!(found.iter().all(|&n| n > 2_000), "too few abstractions to mean anything: {found:?}");
}

#[test]
fn a_path_of_the_cell_is_free_in_the_scene() {
    let (grid, vehicle) = (Grid::default(), Vehicle::default());
    let mut planner = HybridAStar::new(HybridAStarConfig::default());
    let mut compared = 0;
    for (i, kind) in (0..120).flat_map(|i| ParkingType::ALL.map(|k| (i, k))) {
        let level = Level::ALL[i as usize % 3];
        let scene = generate(&GeneratorConfig::default(), &vehicle, kind, level, 5, i);
        let problem = Problem::new(&scene).unwrap();
        for a in abstractions(&problem.obstacles, problem.stance().unwrap(), &grid) {
            for region in a.regions(&grid) {
                assert!(region_is_free(&region, &problem.obstacles), "{} {a:?}", scene.name);
            }
            let start = Pose::new(grid.lane(&a.cell).min.x + 3.0, 5.0, 0.0);
            let Ok(in_cell) = Problem::in_cell(&grid, &a.cell, vehicle, start) else {
                continue;
            };
            let budget = Budget::new(5_000);
            let Ok(mut path) = planner.plan(&in_cell, budget).outcome else { continue };
            path.start = a.from_cell(path.start);
            let world = CollisionWorld::new(&problem.obstacles, None, &vehicle, 0.0);
            assert!(world.path_is_free(&path), "{} {a:?}", scene.name);
            compared += 1;
        }
    }
    assert!(compared > 150, "only {compared} paths compared");
}
