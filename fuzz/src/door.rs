//! The Rust door with any numbers at all: an error or a plan, never a panic.

use std::sync::OnceLock;

use arbitrary::{Arbitrary, Result, Unstructured};
use n3p::curves::TrajectoryLimits;
use n3p::curves::smoothing::StandstillSteering;
use n3p::geometry::Pose;
use n3p::planners::{Budget, Shape};
use n3p::vehicle::Margins;
use n3p::world::{DrivableArea, GoalTolerance, ParkingType, PreviousPath};
use n3p::{Lot, Method, Models, Parker, Request, Vehicle};

/// Mostly a number that means something, at times any.
pub fn number(u: &mut Unstructured) -> Result<f64> {
    Ok(match u8::arbitrary(u)? {
        0 => f64::arbitrary(u)?,
        1 => {
            *u.choose(&[f64::NAN, f64::INFINITY, -0.0, 0.0, f64::MAX, 5e-324, 1e7, 5e11, -1e308])?
        }
        _ => f64::from(i16::arbitrary(u)?) / 512.0,
    })
}

fn pose(u: &mut Unstructured) -> Result<Pose> {
    Ok(Pose::new(number(u)?, number(u)?, number(u)?))
}

/// At most `most` of something.
pub fn some<T>(
    u: &mut Unstructured,
    most: u8,
    mut one: impl FnMut(&mut Unstructured) -> Result<T>,
) -> Result<Vec<T>> {
    (0..u8::arbitrary(u)? % (most + 1)).map(|_| one(u)).collect()
}

fn point(u: &mut Unstructured) -> Result<[f64; 2]> {
    Ok([number(u)?, number(u)?])
}

fn vehicle(u: &mut Unstructured) -> Result<Vehicle> {
    let usual = Vehicle::default();
    if u8::arbitrary(u)? % 4 > 0 {
        return Ok(usual);
    }
    let mut one = |usual: f64| Ok(if bool::arbitrary(u)? { number(u)? } else { usual });
    Ok(Vehicle {
        length: one(usual.length)?,
        width: one(usual.width)?,
        wheelbase: one(usual.wheelbase)?,
        rear_overhang: one(usual.rear_overhang)?,
        max_steer: one(usual.max_steer)?,
        forward_speed: one(usual.forward_speed)?,
        backward_speed: one(usual.backward_speed)?,
        steer_rate: one(usual.steer_rate)?,
    })
}

fn lot(u: &mut Unstructured) -> Result<Lot> {
    let mut lot = Lot::new();
    for polygon in some(u, 4, |u| some(u, 6, point))? {
        lot.polygon(polygon);
    }
    for line in some(u, 2, |u| some(u, 4, point))? {
        lot.polyline(line);
    }
    lot.points(some(u, 6, point)?);
    if u8::arbitrary(u)? % 4 == 0 {
        lot.low_polygon(some(u, 6, point)?);
        lot.low_polyline(some(u, 4, point)?);
        lot.low_points(some(u, 3, point)?);
    }
    if u8::arbitrary(u)? % 8 == 0 {
        let (outer, holes) = (some(u, 6, point)?, some(u, 2, |u| some(u, 5, point))?);
        lot.drivable_area(DrivableArea { outer, holes });
    }
    if u8::arbitrary(u)? % 4 == 0 {
        lot.bounds([number(u)?, number(u)?, number(u)?, number(u)?]);
    }
    if u8::arbitrary(u)? % 4 == 0 {
        let (origin, resolution) = (point(u)?, number(u)?);
        let (columns, cells) =
            (usize::from(u8::arbitrary(u)? % 8), some(u, 40, |u| bool::arbitrary(u))?);
        lot.grid(origin, resolution, columns, &cells);
    }
    Ok(lot)
}

fn previous(u: &mut Unstructured) -> Result<PreviousPath> {
    Ok(PreviousPath {
        poses: some(u, 6, |u| pose(u).map(Into::into))?,
        gears: some(u, 6, |u| Ok(if bool::arbitrary(u)? { 1 } else { -1 }))?,
        steer: some(u, 6, number)?,
        steer_from: if bool::arbitrary(u)? { Some(some(u, 6, number)?) } else { None },
        steer_to: if bool::arbitrary(u)? { Some(some(u, 6, number)?) } else { None },
        ..PreviousPath::default()
    })
}

/// Everything that can be asked of a parker, with any numbers.
pub fn door(data: &[u8]) {
    let _ = tried(&mut Unstructured::new(data));
}

fn tried(u: &mut Unstructured) -> Result<()> {
    let (vehicle, lot) = (vehicle(u)?, lot(u)?);
    let request = Request {
        start: pose(u)?,
        goals: some(u, 3, pose)?,
        tolerance: if u8::arbitrary(u)? % 4 == 0 {
            Some(GoalTolerance { position_m: number(u)?, heading_rad: number(u)? })
        } else {
            None
        },
        parking_type: Some(*u.choose(&ParkingType::ALL)?).filter(|_| data_is_even(u)),
        contour: if u8::arbitrary(u)? % 4 == 0 { some(u, 8, point)? } else { Vec::new() },
        margins: if u8::arbitrary(u)? % 4 == 0 {
            let [front, rear, left, right] = [number(u)?, number(u)?, number(u)?, number(u)?];
            let mirrors = if data_is_even(u) { Some(number(u)?) } else { None };
            Some(Margins { front, rear, left, right, mirrors })
        } else {
            None
        },
        start_steer: if u8::arbitrary(u)? % 4 == 0 { number(u)? } else { 0.0 },
        previous: if u8::arbitrary(u)? % 4 == 0 { Some(previous(u)?) } else { None },
    };
    let method = if u8::arbitrary(u)? % 8 == 0 { Method::N3P } else { Method::HA_RS };
    let models = if method == Method::N3P && vehicle == Vehicle::default() {
        static MODELS: OnceLock<Models> = OnceLock::new();
        MODELS.get_or_init(|| Models::compiled_in(&Vehicle::default()).expect("whole")).clone()
    } else {
        Models::default()
    };
    let method =
        if models.selector(Method::N3P, &vehicle).is_some() { method } else { Method::HA_RS };
    let Ok(mut parker) = Parker::by(method, vehicle, models) else { return Ok(()) };
    parker = parker.budget(Budget::new(usize::from(u8::arbitrary(u)?)));
    parker = parker.standstill_steering(*u.choose(&StandstillSteering::ALL)?);
    if u8::arbitrary(u)? % 4 == 0 {
        let (margin, contact) = (number(u)?, number(u)?);
        let shape = Shape { least_move: Some(number(u)?), last_straight: None };
        let asked = parker.margin(margin).and_then(|p| p.allow_contact(contact));
        let Ok(asked) = asked.and_then(|p| p.shape(shape)) else { return Ok(()) };
        parker = asked;
    }
    let Ok(plan) = parker.plan_request(&request, &lot) else { return Ok(()) };
    let poses = plan.poses().poses;
    assert!(poses.iter().flatten().all(|v| v.is_finite()), "{request:?}");
    assert!(plan.length().is_finite());
    let limits = TrajectoryLimits {
        forward_acceleration: number(u)?,
        backward_acceleration: number(u)?,
        lateral_acceleration: number(u)?,
        jerk: number(u)?,
        steer_rate: number(u)?,
        stop_to_steer: bool::arbitrary(u)?,
    };
    let _ = plan.trajectory(&limits);
    let _ = plan.trajectory(&TrajectoryLimits::default()).expect("the usual limits");
    Ok(())
}

fn data_is_even(u: &mut Unstructured) -> bool {
    u8::arbitrary(u).is_ok_and(|b| b % 2 == 0)
}
