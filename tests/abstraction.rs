//! The abstraction is an inner approximation: no obstacle reaches into it, ever.

#![cfg(feature = "lab")]

use n3p::geometry::{Aabb, Polygon, Pose, Vec2};
use n3p::planners::{Budget, HybridAStar, HybridAStarConfig, Planner, Problem};
use n3p::rng::{Stream, rng};
use n3p::vehicle::Vehicle;
use n3p::world::abstraction::abstractions;
use n3p::world::cell::Grid;
use n3p::world::collision::CollisionWorld;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, Obstacles, ParkingType};
use parry2d_f64::math::{Pose as ParryPose, Vector};
use parry2d_f64::query;
use parry2d_f64::shape::{ConvexPolygon, Cuboid};
use rand::{Rng, RngExt};

/// Regions are tested this much smaller: obstacles may touch their border.
const SHRINK: f64 = 1e-4;

fn region_is_free(region: &Aabb, obstacles: &Obstacles) -> bool {
    let half = (region.max - region.min) / 2.0;
    let center = (region.max + region.min) / 2.0;
    let cuboid = Cuboid::new(Vector::new(half.x - SHRINK, half.y - SHRINK));
    let at = ParryPose::new(Vector::new(center.x, center.y), 0.0);
    let hit = |p: &Polygon| {
        let points: Vec<_> = p.vertices().iter().map(|v| Vector::new(v.x, v.y)).collect();
        let hull = ConvexPolygon::from_convex_hull(&points).expect("a convex obstacle");
        query::intersection_test(&at, &cuboid, &ParryPose::default(), &hull).unwrap().intersecting
    };
    let inside = |p: &Vec2| region.inflated(-SHRINK).contains(*p);
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
    let mut found = [0; 3];
    for i in 0..30_000 {
        let kind = ParkingType::ALL[i % 3];
        let obstacles = clutter(&mut rng, &vehicle, grid.goal(kind, &vehicle));
        for a in abstractions(&obstacles, kind, &grid) {
            found[i % 3] += 1;
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
        for a in abstractions(&problem.obstacles, kind, &grid) {
            for region in a.regions(&grid) {
                assert!(region_is_free(&region, &problem.obstacles), "{} {a:?}", scene.name);
            }
            let Ok(in_cell) = Problem::in_cell(&grid, &a.cell, vehicle, Pose::new(-4.0, 5.0, 0.0))
            else {
                continue;
            };
            let budget = Budget::new(5_000);
            let Ok(mut path) = planner.plan(&in_cell, budget).outcome else { continue };
            path.start.y += a.shift;
            let world = CollisionWorld::new(&problem.obstacles, None, &vehicle, 0.0);
            assert!(world.path_is_free(&path), "{} {a:?}", scene.name);
            compared += 1;
        }
    }
    assert!(compared > 150, "only {compared} paths compared");
}
