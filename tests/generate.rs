//! The laws of generated scenes, judged by parry2d instead of our own geometry.

#![cfg(feature = "lab")]

use std::f64::consts::PI;
use std::path::Path;

use n3p::geometry::{Aabb, Pose, Vec2, signed_angle};
use n3p::vehicle::Vehicle;
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::{Level, ParkingType, Scene};
use parry2d_f64::math::{Pose as Isometry, Vector};
use parry2d_f64::query;
use parry2d_f64::shape::ConvexPolygon;

const SEED: u64 = 11;
const COUNT: u64 = 300;
/// Room for parry's iterative distances, metres.
const TOL: f64 = 1e-6;

/// Every kind, level and index with its scene, under the default config.
fn for_each(mut check: impl FnMut(ParkingType, Level, &Scene, &str)) {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    config.validate(&vehicle).unwrap();
    for kind in ParkingType::SQUARE {
        for level in Level::ALL {
            for index in 0..COUNT {
                let scene = generate(&config, &vehicle, kind, level, SEED, index);
                let what = format!("seed {SEED}: {}", scene.name);
                check(kind, level, &scene, &what);
            }
        }
    }
}

fn solid(vertices: impl IntoIterator<Item = [f64; 2]>) -> ConvexPolygon {
    let points: Vec<Vector> = vertices.into_iter().map(|[x, y]| Vector::new(x, y)).collect();
    ConvexPolygon::from_convex_hull(&points).expect("a convex obstacle")
}

fn solids(scene: &Scene) -> Vec<ConvexPolygon> {
    scene.obstacles.iter().map(|o| solid(o.iter().copied())).collect()
}

fn footprint(scene: &Scene, pose: Pose) -> ConvexPolygon {
    solid(scene.vehicle.footprint_at(pose).vertices().iter().map(|&v| v.into()))
}

fn area(min_x: f64, min_y: f64, max_x: f64, max_y: f64) -> ConvexPolygon {
    solid(Aabb::new(min_x, min_y, max_x, max_y).corners().map(Into::into))
}

fn distance(a: &ConvexPolygon, b: &ConvexPolygon) -> f64 {
    query::distance(&Isometry::IDENTITY, a, &Isometry::IDENTITY, b).unwrap().distance
}

fn extent(obstacle: &[[f64; 2]]) -> Aabb {
    Aabb::around(obstacle.iter().map(|&[x, y]| Vec2::new(x, y)))
}

/// Cars have no short edge; walls have.
fn is_car(obstacle: &[[f64; 2]]) -> bool {
    let edges = obstacle.iter().zip(obstacle.iter().cycle().skip(1));
    edges.into_iter().all(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) > 1.2)
}

fn boundary(kind: ParkingType) -> f64 {
    GeneratorConfig::default().depth(kind) / 2.0
}

/// Free width between the neighbours, on either side of the spot's centre.
fn gap(kind: ParkingType, scene: &Scene) -> (f64, f64) {
    let y = boundary(kind);
    let in_row = |b: &&Aabb| b.min.y < y - 0.01 && b.max.y > -y + 0.01;
    let boxes: Vec<Aabb> = scene.obstacles.iter().map(|o| extent(o)).collect();
    let cars = || boxes.iter().filter(in_row);
    let left = cars().filter(|b| b.max.x < 0.0).map(|b| -b.max.x).fold(f64::INFINITY, f64::min);
    let right = cars().filter(|b| b.min.x > 0.0).map(|b| b.min.x).fold(f64::INFINITY, f64::min);
    (left, right)
}

/// x of the nearest point of a wall over the lane.
fn dead_end(kind: ParkingType, scene: &Scene) -> Option<f64> {
    let y = boundary(kind);
    let over_lane = |o: &&Vec<[f64; 2]>| {
        let b = extent(o);
        !is_car(o) && b.max.y > y + 0.01 && b.min.y < y + 5.99
    };
    scene.obstacles.iter().filter(over_lane).map(|o| extent(o).min.x).reduce(f64::min)
}

#[test]
fn the_same_arguments_give_the_same_scene() {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let make = |seed, index| {
        generate(&config, &vehicle, ParkingType::Reverse, Level::Complex, seed, index)
    };
    let scenes: Vec<Scene> = (0..20).map(|i| make(1, i)).collect();
    for (i, scene) in scenes.iter().enumerate().rev() {
        assert_eq!(&make(1, i as u64), scene);
        assert_ne!(make(2, i as u64).obstacles, scene.obstacles);
    }
    assert_eq!(scenes[7].name, "complex-reverse-0007");
    let mut starts: Vec<[f64; 3]> = Vec::new();
    for_each(|_, _, scene, what| {
        let start = scene.start.into();
        assert!(!starts.contains(&start), "{what}: its start occurred before");
        starts.push(start);
    });
}

#[test]
fn spots_and_dead_ends_lie_in_the_ranges_of_their_level() {
    let config = GeneratorConfig::default();
    let mut open = 0;
    for_each(|kind, level, scene, what| {
        let l = config.level(level);
        let [min, max] = if kind.is_bay() { l.bay_spot_width } else { l.parallel_spot_width };
        let (left, right) = gap(kind, scene);
        let narrower = 2.0 * left.min(right);
        assert!(narrower > min - 1e-9, "{what}: gap {left} + {right}");
        // A neighbour may leave up to 0.3 m more on its side.
        assert!(narrower < max + 0.6 + 1e-9, "{what}: gap {left} + {right}");
        match dead_end(kind, scene) {
            Some(d) => {
                let [min, max] = l.dead_end;
                assert!(min - 1e-9 <= d && d <= max + 1e-9, "{what}: dead end at {d}");
            }
            None => {
                assert_eq!(level, Level::Easy, "{what}: no dead end");
                open += 1;
            }
        }
    });
    // 900 easy scenes, half of them open: four standard deviations.
    assert!((390..=510).contains(&open), "{open} open scenes");
}

#[test]
fn most_spots_are_tight_on_both_sides() {
    let mut tight = 0;
    for_each(|kind, _, scene, _| {
        let (left, right) = gap(kind, scene);
        tight += u64::from((left - right).abs() < 1e-9);
    });
    assert!(tight > 9 * COUNT * 6 / 10, "{tight}");
}

#[test]
fn start_and_goal_are_free() {
    const WALL: f64 = 0.3;
    let mut places = [0, 0];
    for_each(|_, _, scene, what| {
        scene.validate(Path::new(&scene.name)).unwrap();
        let (start, goal) = (footprint(scene, scene.start), footprint(scene, scene.goal));
        for solid in solids(scene) {
            assert!(distance(&start, &solid) > 0.2 - TOL, "{what}: start");
            assert!(distance(&goal, &solid) > 0.05, "{what}: goal");
        }
        let [min_x, min_y, max_x, max_y] = scene.bounds.unwrap();
        let bounds = Aabb::new(min_x, min_y, max_x, max_y);
        for pose in [scene.start, scene.goal] {
            assert!(bounds.contains(pose.position()), "{what}: {pose:?} out of bounds");
        }
        // As the paper has it: within three lengths of the car, and before the dead end.
        let (start, reach) = (scene.start, 3.0 * Vehicle::default().length);
        let last = reach.min(max_x - 2.0 * WALL);
        assert!((-reach - TOL..=last + TOL).contains(&start.x), "{what}: {start:?}");
        places[usize::from(start.x > 0.0)] += 1;
        assert!(start.heading.abs() <= std::f64::consts::FRAC_PI_6, "{what}: {start:?}");
    });
    let [before, beyond] = places;
    assert!(beyond * 10 > before, "{before} start before the spot, {beyond} beyond it");
}

#[test]
fn the_lane_is_clear_around_the_spot_and_passable_elsewhere() {
    let width = Vehicle::default().width;
    let mut standing = 0;
    for_each(|kind, _, scene, what| {
        let (y, d) = (boundary(kind), dead_end(kind, scene).unwrap_or(9.0));
        let clear = area(-7.0, y, d.min(9.0), y + 6.0);
        let spot = gap(kind, scene);
        let spot = area(-spot.0, -y, spot.1, y);
        for (o, solid) in scene.obstacles.iter().zip(solids(scene)) {
            for region in [&clear, &spot] {
                let overlap =
                    query::contact(&Isometry::IDENTITY, region, &Isometry::IDENTITY, &solid, 0.0)
                        .unwrap()
                        .map_or(0.0, |c| -c.dist);
                assert!(overlap < TOL, "{what}: {o:?} reaches {overlap} into {region:?}");
            }
            let b = extent(o);
            if is_car(o) && b.max.y > y + 0.01 && b.min.y < y + 5.99 {
                standing += 1;
                assert!(b.min.y - y > width + 1.4 - 1e-9, "{what}: cannot pass {o:?}");
            }
        }
    });
    assert!((700..=920).contains(&standing), "{standing} of {} lanes hold a car", 9 * COUNT);
}

#[test]
fn cars_do_not_overlap() {
    for_each(|_, _, scene, what| {
        let cars: Vec<_> = scene.obstacles.iter().filter(|o| is_car(o)).collect();
        let solids: Vec<_> = cars.iter().map(|o| solid(o.iter().copied())).collect();
        for i in 0..solids.len() {
            for j in 0..i {
                let d = distance(&solids[i], &solids[j]);
                assert!(d > 0.04, "{what}: {:?} and {:?}", cars[i], cars[j]);
            }
        }
    });
}

/// Angled bays lean either way and are driven into either way; their rows are as square ones are, seen
/// along the way out.
#[test]
fn angled_bays_keep_the_laws_of_their_level() {
    let (config, vehicle) = (GeneratorConfig::default(), Vehicle::default());
    let (mut against, mut tail_in, mut open) = (0, 0, 0);
    for (level, index) in Level::ALL.into_iter().flat_map(|l| (0..COUNT).map(move |i| (l, i))) {
        let scene = generate(&config, &vehicle, ParkingType::Angled, level, SEED, index);
        let what = format!("seed {SEED}: {}", scene.name);
        scene.validate(Path::new(&scene.name)).unwrap();
        let heading = scene.goal.heading;
        let slant = if heading > 0.0 { heading } else { heading + PI };
        let degrees = slant.to_degrees();
        let is_slanted = (30.0..=75.0).contains(&degrees) || (105.0..=150.0).contains(&degrees);
        assert!(is_slanted, "{what}: {degrees}°");
        against += u64::from(degrees > 90.0);
        tail_in += u64::from(heading > 0.0);

        let (start, goal) = (footprint(&scene, scene.start), footprint(&scene, scene.goal));
        let all = solids(&scene);
        for solid in &all {
            assert!(distance(&start, solid) > 0.2 - TOL, "{what}: start");
            assert!(distance(&goal, solid) > 0.05, "{what}: goal");
        }
        let cars: Vec<_> = scene.obstacles.iter().zip(&all).filter(|(o, _)| is_car(o)).collect();
        for (i, (_, a)) in cars.iter().enumerate() {
            assert!(cars[..i].iter().all(|(_, b)| distance(a, b) > 0.04), "{what}: {i}");
        }
        // Across the way out, from the spot's centre to the row's nearest cars.
        let across = |v: &[f64; 2]| v[0] * slant.sin() - v[1] * slant.cos();
        let row = cars.iter().filter(|(o, _)| extent(o).max.y + extent(o).min.y < 2.0);
        let (mut left, mut right) = (f64::INFINITY, f64::INFINITY);
        for (o, _) in row {
            let low = o.iter().map(across).fold(f64::INFINITY, f64::min);
            let high = o.iter().map(across).fold(f64::NEG_INFINITY, f64::max);
            if low > 0.0 {
                right = right.min(low);
            } else {
                left = left.min(-high);
            }
        }
        let ([min, max], narrower) = (config.level(level).bay_spot_width, 2.0 * left.min(right));
        assert!(narrower > min - 1e-9 && narrower < max + 0.6 + 1e-9, "{what}: {left} {right}");

        let boundary = config.bay_depth / 2.0 * slant.sin() + narrower / 2.0 * slant.cos().abs();
        let walls = scene.obstacles.iter().filter(|o| !is_car(o)).map(|o| extent(o));
        let ends = walls.filter(|b| b.max.y > boundary + 0.01 && b.min.y < boundary + 5.0);
        open += u64::from(ends.count() == 0);
    }
    let share = |n: u64| n as f64 / (3 * COUNT) as f64;
    assert!((0.43..0.57).contains(&share(against)), "{against}");
    assert!((0.43..0.57).contains(&share(tail_in)), "{tail_in}");
    assert!((100..200).contains(&open), "{open} of {COUNT} easy scenes are open");
}

#[test]
fn a_scene_in_the_world_is_the_same_scene() {
    let plain = GeneratorConfig::default();
    let placed = GeneratorConfig { world_frame: true, ..plain };
    let vehicle = Vehicle::default();
    let mut mirrored = 0;
    for index in 0..50 {
        let make = |c| generate(c, &vehicle, ParkingType::Parallel, Level::Easy, SEED, index);
        let (a, b) = (make(&plain), make(&placed));
        let ranges = |s: &Scene, i: usize| -> Vec<f64> {
            let mut d: Vec<f64> =
                s.obstacles[i].iter().map(|v| (v[0] - s.start.x).hypot(v[1] - s.start.y)).collect();
            d.sort_by(f64::total_cmp);
            d
        };
        for i in 0..a.obstacles.len() {
            let pairs = ranges(&a, i).into_iter().zip(ranges(&b, i));
            assert!(pairs.into_iter().all(|(u, v)| (u - v).abs() < 1e-9), "index {index}");
            let o = &b.obstacles[i];
            let turn = (o[1][0] - o[0][0]) * (o[2][1] - o[0][1])
                - (o[2][0] - o[0][0]) * (o[1][1] - o[0][1]);
            assert!(turn > 0.0, "index {index}: obstacle {i} is clockwise");
        }
        let turn = |s: &Scene| signed_angle(s.start.heading, s.goal.heading);
        assert!((turn(&a).abs() - turn(&b).abs()).abs() < 1e-9);
        mirrored += u32::from(turn(&a) * turn(&b) < 0.0);
        b.validate(Path::new("b")).unwrap();
    }
    assert!((10..=40).contains(&mirrored), "{mirrored}");
}

/// The scenes on record in the repository come out again: what a random stream is named by, and the
/// order of its numbers, are part of the data format.
#[test]
fn the_example_scenes_come_out_again() {
    for (kind, level, index) in [
        (ParkingType::Forward, Level::Complex, 1),
        (ParkingType::Parallel, Level::Extreme, 3),
        (ParkingType::Reverse, Level::Complex, 1),
    ] {
        let recorded =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{kind}.json"));
        let recorded = Scene::read(&recorded).unwrap();
        // They are from when all cars started 7 to 14 m behind the spot.
        let vehicle = Vehicle::default();
        let start_reach = [-14.0 / vehicle.length, -7.0 / vehicle.length];
        let config = GeneratorConfig { start_reach, ..GeneratorConfig::default() };
        let again = generate(&config, &vehicle, kind, level, 7, index);
        assert_eq!(again.source, recorded.source);
        assert_eq!(again.obstacles.len(), recorded.obstacles.len(), "{kind}");
        // Not to the last bit: sines differ between systems.
        let apart = |a: f64, b: f64| (a - b).abs();
        let obstacles = again.obstacles.iter().flatten().zip(recorded.obstacles.iter().flatten());
        for (a, b) in obstacles {
            assert!(apart(a[0], b[0]) + apart(a[1], b[1]) < 1e-9, "{kind}: {a:?} is not {b:?}");
        }
        assert!(again.start.distance(recorded.start) < 1e-9, "{kind}");
        assert!(signed_angle(again.start.heading, recorded.start.heading).abs() < 1e-9, "{kind}");
    }
}

#[test]
fn refuses_settings_by_name() {
    let vehicle = Vehicle::default();
    let complaint = |edit: &dyn Fn(&mut GeneratorConfig)| {
        let mut config = GeneratorConfig::default();
        edit(&mut config);
        config.validate(&vehicle).expect_err("a bad config").to_string()
    };
    let message = complaint(&|c| c.extreme.bay_spot_width = [1.5, 2.0]);
    assert!(message.contains("extreme.bay_spot_width is [1.5, 2.0]"), "{message}");
    assert!(complaint(&|c| c.start_reach = [-1.0, -2.0]).contains("start_reach"));
    assert!(complaint(&|c| c.lane_car_probability = f64::NAN).contains("lane_car_probability"));
    let truck = Vehicle { length: 9.0, wheelbase: 5.0, ..vehicle };
    let message = GeneratorConfig::default().validate(&truck).unwrap_err().to_string();
    assert!(message.contains("easy.parallel_spot_width"), "{message}");
    assert!(toml::from_str::<GeneratorConfig>("lane_widht = 5.0").is_err());
    assert_eq!(toml::from_str::<GeneratorConfig>("").unwrap(), GeneratorConfig::default());
}
