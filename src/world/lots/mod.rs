//! Whole car parks and streets: the generator *away*.
//!
//! Methods learn in cells and in scenes of [`generate`](super::generate), *home* and *wide*, and are
//! chosen by *wide*; nothing is by these, so that they say how a method does in places it was not made for. They are
//! laid out by other principles: not one spot with its neighbours, but lanes with rows on both
//! sides, then one free spot among them. Spots and cars have the sizes that they have in reality.
//!
//! Everything is laid out along a `road`, straight or a gentle bend: stations along it, offsets
//! across it (`row` fills rows, `park` composes them). The finished scene lies anywhere in the
//! world, mirrored or not; in some, all is given as points, as far as it is visible from the lane
//! (`scan`).
//!
//! A scene depends on its arguments alone. That it has a solution is made likely, not certain: no
//! planner is asked.

mod draw;
mod furniture;
mod park;
mod road;
mod row;
mod scan;
mod things;

use std::ops::RangeInclusive;

use self::draw::Draw;
use self::park::Park;
use super::{ParkingType, Scene};
use crate::geometry::{Aabb, Pose, Vec2};
use crate::rng::{Stream, rng};
use crate::vehicle::Vehicle;

/// Share of scenes that are given wholly as points.
const SCANNED: f64 = 0.25;
/// Share of scenes with bounds.
const BOUNDED: f64 = 0.3;

/// The scene number `index` of a type and seed, named `lot-TYPE-INDEX`. For a vehicle far smaller or
/// larger than cars are, everything is as much smaller or larger.
pub fn lot(vehicle: &Vehicle, kind: ParkingType, seed: u64, index: u64) -> Scene {
    let stream = index.wrapping_mul(8).wrapping_add(number(kind));
    let mut draw = Draw::new(rng(seed, Stream::Lot, stream));
    let unit = unit(vehicle);
    let car = resized(vehicle, 1.0 / unit);
    let park = loop {
        // Now and then no spot or start is left.
        if let Some(park) = Park::new(&car, kind, &mut draw) {
            break park;
        }
    };
    let things = if draw.chance(SCANNED) {
        scan::scanned(&park.things, &park.eyes, &mut draw)
    } else {
        park.things
    };
    let frame = draw.somewhere();
    let sized = |p: Pose| Pose::new(p.x * unit, p.y * unit, p.heading);
    let point = |&p: &Vec2| -> [f64; 2] { frame.world_from_local_point(p * unit).into() };
    let solids = things.solids.iter().map(|p| p.vertices().iter().map(point).collect());
    let lines = things.lines.iter().map(|line| line.iter().map(point).collect());
    let scene = Scene {
        name: format!("lot-{kind}-{index:04}"),
        source: format!("generated: car park, type {kind}, seed {seed}, index {index}"),
        vehicle: *vehicle,
        start: frame.world_from_local(sized(park.start)),
        goal: frame.world_from_local(sized(park.goal)),
        parking_type: Some(kind),
        obstacles: solids.chain(lines).collect(),
        points: things.points.iter().map(point).collect(),
        ..Scene::default()
    };
    let bounds = draw.chance(BOUNDED).then(|| bounds(&scene, unit));
    Scene { bounds, ..scene }
}

/// The number of a type, 0 to 7, which picks the random stream of its scenes. Written out and part
/// of the data format, like [`Stream`]: whoever changes it changes every scene.
fn number(kind: ParkingType) -> u64 {
    match kind {
        ParkingType::Forward => 0,
        ParkingType::Reverse => 1,
        ParkingType::Parallel => 2,
        ParkingType::Angled => 3,
    }
}

/// How many times as large as for cars everything is.
fn unit(vehicle: &Vehicle) -> f64 {
    /// Within it a vehicle is a car, which has to do with the spots there are.
    const CARS: RangeInclusive<f64> = 0.7..=1.12;
    let usual = Vehicle::default();
    let reach = |v: &Vehicle| (v.turning_radius() + v.width / 2.0).hypot(v.front_extent());
    let ratio = (vehicle.length / usual.length)
        .max(vehicle.width / usual.width)
        .max(reach(vehicle) / reach(&usual));
    if CARS.contains(&ratio) { 1.0 } else { ratio }
}

/// The same vehicle, `factor` times as large.
fn resized(vehicle: &Vehicle, factor: f64) -> Vehicle {
    Vehicle {
        length: vehicle.length * factor,
        width: vehicle.width * factor,
        wheelbase: vehicle.wheelbase * factor,
        rear_overhang: vehicle.rear_overhang * factor,
        ..*vehicle
    }
}

/// Around everything in the scene.
fn bounds(scene: &Scene, unit: f64) -> [f64; 4] {
    let vec = |&[x, y]: &[f64; 2]| Vec2::new(x, y);
    let points = scene.obstacles.iter().flatten().chain(&scene.points).map(vec);
    let ends = [scene.start.position(), scene.goal.position()];
    let Aabb { min, max } = Aabb::around(points.chain(ends)).inflated(unit);
    [min.x, min.y, max.x, max.y]
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::geometry::signed_angle;
    use crate::world::clutter::VEHICLES;
    use crate::world::collision::CollisionWorld;

    fn each(count: u64) -> impl Iterator<Item = (ParkingType, Scene)> {
        let of = move |kind| (0..count).map(move |i| (kind, lot(&Vehicle::default(), kind, 7, i)));
        ParkingType::ALL.into_iter().flat_map(of)
    }

    #[test]
    fn the_same_numbers_give_the_same_scene() {
        let car = Vehicle::default();
        for kind in ParkingType::ALL {
            for index in (0..10).rev() {
                let scene = lot(&car, kind, 5, index);
                assert_eq!(scene, lot(&car, kind, 5, index));
                assert_ne!(scene.start, lot(&car, kind, 6, index).start, "{}", scene.name);
                assert_ne!(scene.start, lot(&car, kind, 5, index + 1).start, "{}", scene.name);
            }
        }
        let numbers = ParkingType::ALL.map(number);
        assert_eq!(numbers, [0, 2, 1, 3], "{:?}", ParkingType::ALL);
    }

    /// By the planner's own check, which the generator does not use.
    fn assert_free(scene: &Scene, start: f64, goal: f64) {
        scene.validate(Path::new("lot")).unwrap();
        let obstacles = scene.geometry().unwrap();
        for (pose, margin) in [(scene.start, start), (scene.goal, goal)] {
            let bounds = scene.bounds.map(|[x0, y0, x1, y1]| Aabb::new(x0, y0, x1, y1).corners());
            let world = CollisionWorld::new(&obstacles, bounds, &scene.vehicle, margin);
            assert!(world.pose_is_free(pose), "{}: {pose:?}", scene.name);
        }
    }

    #[test]
    fn starts_and_goals_are_free() {
        for (_, scene) in each(200) {
            // Rounding in turned frames aside.
            assert_free(&scene, 0.2 - 1e-6, 0.1 - 1e-6);
        }
    }

    #[test]
    fn other_vehicles_get_car_parks_of_their_size() {
        for (name, vehicle) in VEHICLES {
            for kind in ParkingType::ALL {
                let scene = lot(&vehicle, kind, 3, 0);
                let margin = 0.09 * unit(&vehicle);
                assert_free(&scene, margin, margin);
                let apart = scene.start.distance(scene.goal) / unit(&vehicle);
                assert!(apart < 30.0, "{name} {kind}: {apart}");
            }
        }
    }

    #[test]
    fn starts_are_anywhere_along_the_lane() {
        let (mut before, mut near, mut count) = (0, 0, 0);
        for (kind, scene) in each(200) {
            let (start, goal) = (scene.start, scene.vehicle.body_center(scene.goal));
            let apart = goal.relative(scene.vehicle.body_center(start));
            let along = if kind.is_bay() { apart.y } else { apart.x };
            assert!(along.abs() < 22.0, "{}: {along}", scene.name);
            let turn = signed_angle(scene.goal.heading, start.heading).abs().to_degrees();
            // A bend of 18 m, and the goal's own error.
            let most = 31.0 + (18.0_f64 / 35.0).to_degrees();
            assert!(kind.is_bay() || turn < most, "{}: {turn}", scene.name);
            before += usize::from(along < 0.0);
            near += usize::from(along.abs() < 6.0);
            count += 1;
        }
        assert!((count / 4..count * 3 / 4).contains(&before), "{before} of {count}");
        assert!((count / 8..count / 2).contains(&near), "{near} of {count}");
    }

    /// Of what the generator promises every sort has its share.
    #[test]
    fn scenes_differ_as_reality_does() {
        let (mut scanned, mut bounded, mut lined, mut full, mut sizes) = (0, 0, 0, 0, Vec::new());
        for (_, scene) in each(100) {
            scanned += usize::from(scene.obstacles.is_empty());
            bounded += usize::from(scene.bounds.is_some());
            lined += usize::from(scene.obstacles.iter().any(|o| o.len() == 2));
            full += usize::from(scene.obstacles.len() > 30 || scene.points.len() > 600);
            let cars = scene.obstacles.iter().filter(|o| o.len() == 4).map(|o| {
                let edge = |i: usize| (o[i][0] - o[i + 1][0]).hypot(o[i][1] - o[i + 1][1]);
                edge(0).max(edge(1))
            });
            sizes.extend(cars.filter(|length| (2.5..6.0).contains(length)));
        }
        for (name, share) in
            [("scanned", scanned), ("bounded", bounded), ("lined", lined), ("full", full)]
        {
            assert!((30..270).contains(&share), "{name}: {share}");
        }
        sizes.sort_unstable_by(f64::total_cmp);
        assert!(sizes[sizes.len() / 10] < 4.0 && sizes[sizes.len() * 9 / 10] > 4.8);
    }
}
