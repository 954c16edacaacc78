//! Laws of recognising spots: an unusual bay is what it is, whichever way the car comes from and
//! wherever it lies; oblique ones are angled.

#![cfg(feature = "lab")]

use n3p::geometry::{Frame, Pose, Vec2, signed_angle};
use n3p::vehicle::Vehicle;
use n3p::world::bays::{Unusual, bay};
use n3p::world::generate::{GeneratorConfig, generate};
use n3p::world::spot::{Precision, guess};
use n3p::world::{Level, ParkingType, Scene, Stance};

const SEED: u64 = 5;
const COUNT: u64 = 60;

fn without_type(scene: &Scene) -> Scene {
    Scene { parking_type: None, ..scene.clone() }
}

fn kind(scene: &Scene) -> Option<ParkingType> {
    guess(&without_type(scene), Precision::Rounded).unwrap().kind()
}

/// The scene seen from elsewhere.
fn moved(scene: &Scene, frame: &Frame) -> Scene {
    let point = |&[x, y]: &[f64; 2]| frame.world_from_local_point(Vec2::new(x, y)).into();
    let outline = |o: &Vec<[f64; 2]>| {
        let mut seen: Vec<[f64; 2]> = o.iter().map(point).collect();
        if frame.mirrored {
            seen.reverse();
        }
        seen
    };
    Scene {
        start: frame.world_from_local(scene.start),
        goal: frame.world_from_local(scene.goal),
        obstacles: scene.obstacles.iter().map(outline).collect(),
        points: scene.points.iter().map(point).collect(),
        ..scene.clone()
    }
}

/// The same in other units of length.
fn scaled(scene: &Scene, by: f64) -> Scene {
    let pose = |p: Pose| Pose { x: p.x * by, y: p.y * by, ..p };
    let v = scene.vehicle;
    Scene {
        start: pose(scene.start),
        goal: pose(scene.goal),
        vehicle: Vehicle {
            length: v.length * by,
            width: v.width * by,
            wheelbase: v.wheelbase * by,
            rear_overhang: v.rear_overhang * by,
            ..v
        },
        obstacles: scene
            .obstacles
            .iter()
            .map(|o| o.iter().map(|p| p.map(|v| v * by)).collect())
            .collect(),
        ..scene.clone()
    }
}

/// Of a sort of bay, what share is taken for what it is, and which for something else.
fn shares(unusual: Unusual) -> (f64, f64) {
    let (mut right, mut wrong, mut all) = (0, 0, 0);
    for &expected in unusual.kinds() {
        for index in 0..COUNT {
            let found = kind(&bay(unusual, expected, SEED, index));
            all += 1;
            right += usize::from(found == Some(expected));
            if found.is_some_and(|k| k != expected) {
                wrong += 1;
                println!("{} {expected} {index}: taken for {found:?}", unusual.name());
            }
        }
    }
    (f64::from(right as u32) / f64::from(all), f64::from(wrong) / f64::from(all))
}

#[test]
fn unusual_bays_are_what_they_are() {
    let mut failed = false;
    for (unusual, least) in [
        (Unusual::Deep, 1.0),
        (Unusual::Pillars, 0.98),
        (Unusual::Kerbs, 0.95),
        (Unusual::Last, 0.9),
    ] {
        let (right, wrong) = shares(unusual);
        println!("{}: {right:.3} right, {wrong:.3} wrong", unusual.name());
        failed |= right < least || wrong > 0.02;
    }
    assert!(!failed, "see above");
}

/// Which way the lane of an oblique bay leads, and which way its car stands there, is seen as well.
#[test]
fn oblique_bays_are_angled() {
    let mut failed = false;
    for unusual in [Unusual::At45, Unusual::At60] {
        let slant = unusual.slant().expect("oblique");
        for &side in unusual.kinds() {
            let (mut right, mut square) = (0, 0);
            for index in 0..COUNT {
                let found = guess(&bay(unusual, side, SEED, index), Precision::Rounded).unwrap();
                let what = format!("{} {side} {index}", unusual.name());
                match found.stance {
                    Some(stance) if stance.kind() == ParkingType::Angled => {
                        let nose_in = stance.heading() < 0.0;
                        assert_eq!(nose_in, side == ParkingType::Forward, "{what}");
                        let leans = stance.out().x.abs().acos();
                        if (leans - slant).abs() < 8_f64.to_radians() {
                            right += 1;
                        } else {
                            println!("{what}: at {:.1}°", leans.to_degrees());
                        }
                    }
                    found => {
                        square += u64::from(found.is_some());
                        println!("{what}: taken for {found:?}");
                    }
                }
            }
            println!("{} {side}: {right} of {COUNT} right, {square} square", unusual.name());
            failed |= 100 * right < 90 * COUNT || 50 * square > COUNT;
        }
    }
    assert!(!failed, "see above");
}

/// So are nearly all of the generator's, where the car comes along the lane; between narrow neighbours and
/// a near dead end one of 20 degrees from square may be taken for square.
#[test]
fn generated_angled_bays_are_found_without_a_hint() {
    let (config, vehicle, kind) =
        (GeneratorConfig::default(), Vehicle::default(), ParkingType::Angled);
    for (level, percent) in Level::ALL.into_iter().zip([90, 85, 70]) {
        let mut right = 0;
        for index in 0..COUNT {
            let scene = generate(&config, &vehicle, kind, level, SEED, index);
            let [given, found] = [&scene, &without_type(&scene)]
                .map(|scene| guess(scene, Precision::Rounded).unwrap().stance);
            assert_eq!(given.map(Stance::kind), Some(kind), "{}", scene.name);
            let apart = |s: Stance| signed_angle(scene.goal.heading, s.heading()).abs();
            let is_right = |s: Stance| s.kind() == kind && apart(s) < 8_f64.to_radians();
            right += u64::from(found.is_some_and(is_right));
            if !found.is_some_and(is_right) {
                println!("{}: {:?} for {}", scene.name, found, scene.goal.heading);
            }
        }
        println!("{level}: {right} of {COUNT}");
        assert!(100 * right >= percent * COUNT, "{level}: {right} of {COUNT}");
    }
}

#[test]
fn a_spot_is_the_same_from_either_side_and_anywhere() {
    let places = [
        Frame { origin_in_world: Pose::new(37.0, -12.0, 1.1), mirrored: false },
        Frame { origin_in_world: Pose::new(-8.0, 301.0, -2.7), mirrored: true },
    ];
    for unusual in Unusual::ALL {
        for &of in unusual.kinds() {
            for index in 0..COUNT / 4 {
                let scene = bay(unusual, of, SEED, index);
                let here = kind(&scene);
                let what = format!("{} {of} {index}", unusual.name());
                for place in &places {
                    assert_eq!(kind(&moved(&scene, place)), here, "{what}: {place:?}");
                }
                for by in [0.5, 2.0] {
                    assert_eq!(kind(&scaled(&scene, by)), here, "{what}: {by} times as large");
                }
            }
        }
    }
}

/// In a row that is open to both sides the car may come from either.
#[test]
fn a_deep_bay_is_the_same_whichever_way_the_car_comes() {
    for kind_here in [ParkingType::Forward, ParkingType::Reverse] {
        for index in 0..COUNT {
            let scene = bay(Unusual::Deep, kind_here, SEED, index);
            // Turned about where it stands, and as far away on the other side.
            let turned =
                Pose { heading: scene.start.heading + std::f64::consts::PI, ..scene.start };
            let out = Frame { origin_in_world: scene.goal, mirrored: false };
            let seen = out.local_from_world(turned);
            let across = Pose::new(seen.x, -seen.y, -seen.heading);
            let other = out.world_from_local(across);
            for start in [turned, other] {
                let scene = Scene { start, ..scene.clone() };
                assert_eq!(kind(&scene), Some(kind_here), "{kind_here} {index} from {start:?}");
            }
        }
    }
}

#[test]
fn the_mouth_of_a_deep_bay_is_where_the_lane_begins() {
    for of in [ParkingType::Forward, ParkingType::Reverse] {
        for index in 0..COUNT {
            let scene = bay(Unusual::Deep, of, SEED, index);
            let given = guess(&scene, Precision::Rounded).unwrap();
            let found = guess(&without_type(&scene), Precision::Rounded).unwrap();
            assert_eq!(found.stance, given.stance);
            assert_eq!((found.frame, found.mouth), (given.frame, given.mouth), "{of} {index}");
            // A bay is 9 m deep at most, a usual lane begins 2.75 m from the parked centre.
            let most = 9.0 - scene.vehicle.length / 2.0 - 2.75;
            assert!((0.0..=most + 1e-6).contains(&found.mouth), "{of} {index}: {}", found.mouth);
        }
    }
}

/// A scanner sees the same spots: the outlines as points 5 cm apart.
#[test]
fn scanned_points_are_read_as_what_they_are_points_of() {
    let scanned = |scene: &Scene| {
        let mut points = Vec::new();
        for outline in &scene.obstacles {
            for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                let steps = ((b[0] - a[0]).hypot(b[1] - a[1]) / 0.05).ceil() as u32;
                let at = |i: u32, k: usize| a[k] + (b[k] - a[k]) * f64::from(i) / f64::from(steps);
                points.extend((0..steps).map(|i| [at(i, 0), at(i, 1)]));
            }
        }
        Scene { obstacles: Vec::new(), points, ..scene.clone() }
    };
    let (mut same, mut all) = (0, 0);
    for unusual in Unusual::ALL {
        for &expected in unusual.kinds() {
            for index in 0..COUNT {
                let scene = bay(unusual, expected, SEED, index);
                all += 1;
                same += u32::from(kind(&scene) == kind(&scanned(&scene)));
            }
        }
    }
    assert!(same * 100 >= all * 97, "{same} of {all}");
    // A garage: a bay, and walls across the lane to either side.
    let wall = |x: f64| vec![[x, -3.0], [x + 0.3, -3.0], [x + 0.3, 9.5], [x, 9.5]];
    let car = |x: f64| vec![[x, -2.6], [x + 2.5, -2.6], [x + 2.5, 2.4], [x, 2.4]];
    let garage = Scene {
        start: Pose::new(-7.0, 6.0, 0.0),
        goal: Pose::new(0.0, -1.5, std::f64::consts::FRAC_PI_2),
        obstacles: vec![
            car(-4.1),
            car(1.6),
            wall(-12.0),
            wall(12.0),
            vec![[-12.0, 9.5], [12.0, 9.5]],
        ],
        ..bay(Unusual::ALL[0], Unusual::ALL[0].kinds()[0], SEED, 0)
    };
    assert_eq!(kind(&garage), Some(ParkingType::Reverse));
    assert_eq!(kind(&scanned(&garage)), Some(ParkingType::Reverse));
}
