//! The structs that cross. Numbers stand for choices, so that any bits are some value.

use n3p::Vehicle;
use n3p::curves::TrajectoryLimits;
use n3p::curves::smoothing::StandstillSteering;
use n3p::curves::trajectory::Moment;
use n3p::geometry::Pose;
use n3p::planners::{Budget, Effort};
use n3p::world::ParkingType;
use std::ffi::c_char;

use super::plan::n3p_plan;
use super::status::{Failure, Result};

/// A pose of the centre of the rear axle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct n3p_pose {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians, counter-clockwise from the x axis.
    pub heading: f64,
}

impl From<n3p_pose> for Pose {
    fn from(pose: n3p_pose) -> Self {
        Pose::new(pose.x, pose.y, pose.heading)
    }
}

/// A vehicle.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_vehicle {
    /// Bumper to bumper, metres.
    pub length: f64,
    /// Side to side, metres.
    pub width: f64,
    /// Rear to front axle, metres.
    pub wheelbase: f64,
    /// Rear axle to rear bumper, metres.
    pub rear_overhang: f64,
    /// Largest angle of the front wheels, radians.
    pub max_steer: f64,
    /// Speed when driving forward, m/s; only trajectories depend on it.
    pub forward_speed: f64,
    /// Speed when driving backward, m/s; positive.
    pub backward_speed: f64,
    /// How fast the front wheels turn, rad/s; only trajectories depend on it. 0: as usual, 0.6.
    pub steer_rate: f64,
}

impl From<n3p_vehicle> for Vehicle {
    fn from(v: n3p_vehicle) -> Self {
        Self {
            length: v.length,
            width: v.width,
            wheelbase: v.wheelbase,
            rear_overhang: v.rear_overhang,
            max_steer: v.max_steer,
            forward_speed: v.forward_speed,
            backward_speed: v.backward_speed,
            steer_rate: if v.steer_rate == 0.0 { Self::default().steer_rate } else { v.steer_rate },
        }
    }
}

impl From<Vehicle> for n3p_vehicle {
    fn from(v: Vehicle) -> Self {
        Self {
            length: v.length,
            width: v.width,
            wheelbase: v.wheelbase,
            rear_overhang: v.rear_overhang,
            max_steer: v.max_steer,
            forward_speed: v.forward_speed,
            backward_speed: v.backward_speed,
            steer_rate: v.steer_rate,
        }
    }
}

/// The paper's car, a 2024 Honda Accord.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_vehicle_default() -> n3p_vehicle {
    Vehicle::default().into()
}

/// What becomes of a first path.
#[repr(C)]
pub enum n3p_effort {
    /// Where it costs more than usual, something cheaper is looked for.
    N3P_EFFORT_USUAL = 0,
    /// It is the answer.
    N3P_EFFORT_FIRST = 1,
    /// Something cheaper is always looked for, with half of the budget.
    N3P_EFFORT_MOST = 2,
}

/// Where the steering wheel may be turned while the car stands. Elsewhere it turns as the car drives, and
/// the steering angle is continuous.
#[repr(C)]
pub enum n3p_standstill_steering {
    /// Wherever the curvature jumps: paths are arcs and straights.
    N3P_STEERING_ANYWHERE = 0,
    /// Where the gear changes, and at the start where nothing else fits.
    N3P_STEERING_AT_CHANGES = 1,
    /// Nowhere.
    N3P_STEERING_NEVER = 2,
}

/// How a parker plans. All zeros are the defaults.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_options {
    /// A method's name, such as "n3p" or "ha-rs"; NULL: "n3p" where the models serve the vehicle,
    /// else "ha-rs".
    pub method: *const c_char,
    /// Distance from obstacles where start and goal allow it, metres, 0 to 1; less than 0.005 means
    /// that.
    pub margin: f64,
    /// How deep start and goal may reach into obstacles, metres, 0 to 0.2.
    pub allow_contact: f64,
    /// Most node expansions of a plan; 0: 200,000. Work is counted, never time, so that plans are
    /// the same everywhere.
    pub max_expansions: usize,
    /// What becomes of a first path, an n3p_effort.
    pub effort: i32,
    /// Where the steering wheel may be turned while the car stands, an n3p_standstill_steering.
    pub standstill_steering: i32,
}

impl n3p_options {
    pub(crate) const DEFAULT: Self = Self {
        method: std::ptr::null(),
        margin: 0.0,
        allow_contact: 0.0,
        max_expansions: 0,
        effort: n3p_effort::N3P_EFFORT_USUAL as i32,
        standstill_steering: n3p_standstill_steering::N3P_STEERING_ANYWHERE as i32,
    };

    pub(crate) fn standstill_steering(&self) -> Result<StandstillSteering> {
        match self.standstill_steering {
            s if s == n3p_standstill_steering::N3P_STEERING_ANYWHERE as i32 => {
                Ok(StandstillSteering::Anywhere)
            }
            s if s == n3p_standstill_steering::N3P_STEERING_AT_CHANGES as i32 => {
                Ok(StandstillSteering::AtChanges)
            }
            s if s == n3p_standstill_steering::N3P_STEERING_NEVER as i32 => {
                Ok(StandstillSteering::Never)
            }
            other => Err(Failure::bad_input(format!(
                "options.standstill_steering is {other}; expected an n3p_standstill_steering, 0 to 2"
            ))),
        }
    }

    pub(crate) fn budget(&self) -> Result<Budget> {
        let effort = match self.effort {
            e if e == n3p_effort::N3P_EFFORT_USUAL as i32 => Effort::Usual,
            e if e == n3p_effort::N3P_EFFORT_FIRST as i32 => Effort::First,
            e if e == n3p_effort::N3P_EFFORT_MOST as i32 => Effort::Most,
            other => {
                let text = format!("options.effort is {other}; expected an n3p_effort, 0 to 2");
                return Err(Failure::bad_input(text));
            }
        };
        let usual = Budget::default().max_expansions;
        let max_expansions = if self.max_expansions == 0 { usual } else { self.max_expansions };
        Ok(Budget { max_expansions, effort })
    }
}

/// How the goal lies in its spot.
#[repr(C)]
pub enum n3p_parking_type {
    /// To be found from the obstacles around.
    N3P_PARKING_ANY = 0,
    /// A bay, nose in.
    N3P_PARKING_FORWARD = 1,
    /// A bay, tail in.
    N3P_PARKING_REVERSE = 2,
    /// Along the lane.
    N3P_PARKING_PARALLEL = 3,
    /// A bay at 30 to 150 degrees to the lane, nose in or tail in.
    N3P_PARKING_ANGLED = 4,
}

pub(crate) fn parking_type(number: i32) -> Result<Option<ParkingType>> {
    match number {
        n if n == n3p_parking_type::N3P_PARKING_ANY as i32 => Ok(None),
        n if n == n3p_parking_type::N3P_PARKING_FORWARD as i32 => Ok(Some(ParkingType::Forward)),
        n if n == n3p_parking_type::N3P_PARKING_REVERSE as i32 => Ok(Some(ParkingType::Reverse)),
        n if n == n3p_parking_type::N3P_PARKING_PARALLEL as i32 => Ok(Some(ParkingType::Parallel)),
        n if n == n3p_parking_type::N3P_PARKING_ANGLED as i32 => Ok(Some(ParkingType::Angled)),
        other => {
            let text = format!("parking_type is {other}; expected an n3p_parking_type, 0 to 4");
            Err(Failure::bad_input(text))
        }
    }
}

/// The number of an n3p_parking_type.
pub(crate) fn parking_number(kind: Option<ParkingType>) -> i32 {
    (match kind {
        None => n3p_parking_type::N3P_PARKING_ANY,
        Some(ParkingType::Forward) => n3p_parking_type::N3P_PARKING_FORWARD,
        Some(ParkingType::Reverse) => n3p_parking_type::N3P_PARKING_REVERSE,
        Some(ParkingType::Parallel) => n3p_parking_type::N3P_PARKING_PARALLEL,
        Some(ParkingType::Angled) => n3p_parking_type::N3P_PARKING_ANGLED,
    }) as i32
}

/// What is asked of a plan besides avoiding obstacles.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_request {
    /// Where the car stands.
    pub start: n3p_pose,
    /// Where it may park; the cheapest is taken.
    pub goals: *const n3p_pose,
    /// How many goals, 1 to 256.
    pub goal_count: usize,
    /// How far from a goal the car may stop, metres, 0 to 1.
    pub position_tolerance: f64,
    /// How far it may be turned there to either side, radians, 0 to 0.5.
    pub heading_tolerance: f64,
    /// How the goal lies in its spot, an n3p_parking_type.
    pub parking_type: i32,
    /// Distance to keep ahead of the car, behind it, and on either side, metres, 0 to 1; 0 for the
    /// parker's own.
    pub margins: n3p_margins,
    /// The car's outline in its own frame, x and y of each vertex in turn, within the rectangle of its
    /// sizes; NULL where it is that rectangle.
    pub contour: *const f64,
    /// How many vertices the outline has, 3 to 64; 0 for none.
    pub contour_count: usize,
    /// Angle of the front wheels at the start, radians, positive to the left.
    pub start_steer: f64,
    /// The plan that the car follows already, which is kept while it is free and near the best; NULL
    /// for none.
    pub previous: *const n3p_plan,
}

/// Distances on each side of a car, metres.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_margins {
    /// Ahead of it.
    pub front: f64,
    /// Behind it.
    pub rear: f64,
    /// On its left.
    pub left: f64,
    /// On its right.
    pub right: f64,
    /// Around its mirrors: what of the contour stands out farther to either side than the body does at
    /// the rear axle; 0 for the sides'.
    pub mirrors: f64,
}

/// What a plan came to.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_summary {
    /// Driven length, metres.
    pub length: f64,
    /// Distance kept from what is next to start or goal, metres; from all else at least the margin
    /// asked for.
    pub margin: f64,
    /// Changes between forward and backward.
    pub direction_changes: usize,
    /// Node expansions that it took.
    pub expansions: usize,
    /// Which goal it leads to, from 0.
    pub goal_index: usize,
    /// How the goal lies in its spot, given or found: an n3p_parking_type.
    pub parking_type: i32,
    /// The method's name.
    pub method: [c_char; 16],
    /// How n3p came to it: "library", "direct", "searched", "fallback", "no-lane", "no-spot", or "kept"; "" by
    /// other methods.
    pub route: [c_char; 16],
}

/// `name` as it is in C: with a NUL behind it.
pub(crate) fn short_name(name: &str) -> [c_char; 16] {
    let mut chars = [0; 16];
    for (char, byte) in chars[..15].iter_mut().zip(name.bytes()) {
        *char = byte as c_char;
    }
    chars
}

/// A pose of a path, and how it is driven on from there.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_path_pose {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub heading: f64,
    /// Angle of the front wheels on the way to the next pose, radians, positive to the left; at the
    /// end that which led there.
    pub steer: f64,
    /// Angle of the front wheels at this pose, and with which the way to the next one ends: they differ from
    /// `steer` where the steering angle changes on the way.
    pub steer_from: f64,
    /// See `steer_from`.
    pub steer_to: f64,
    /// Gear on the way to the next pose: 1 forward, -1 backward; at the end that which led there.
    pub gear: i32,
}

/// How fast a path may be driven. The speeds are the vehicle's.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_limits {
    /// Largest acceleration and braking when driving forward, m/s².
    pub forward_acceleration: f64,
    /// The same when driving backward, m/s².
    pub backward_acceleration: f64,
    /// Largest v²·|κ| at the rear axle, m/s².
    pub lateral_acceleration: f64,
    /// How fast the acceleration changes at most, m/s³.
    pub jerk: f64,
    /// How fast the front wheels turn, rad/s.
    pub steer_rate: f64,
    /// Not 0: the car stops wherever the steering angle jumps.
    pub stop_to_steer: i32,
}

impl From<n3p_limits> for TrajectoryLimits {
    fn from(limits: n3p_limits) -> Self {
        Self {
            forward_acceleration: limits.forward_acceleration,
            backward_acceleration: limits.backward_acceleration,
            lateral_acceleration: limits.lateral_acceleration,
            jerk: limits.jerk,
            steer_rate: limits.steer_rate,
            stop_to_steer: limits.stop_to_steer != 0,
        }
    }
}

/// 1 m/s² in both gears, 2 m/s² to the side, 2 m/s³, 0.6 rad/s, and no stops to steer.
#[unsafe(no_mangle)]
pub extern "C" fn n3p_limits_default() -> n3p_limits {
    let limits = TrajectoryLimits::default();
    n3p_limits {
        forward_acceleration: limits.forward_acceleration,
        backward_acceleration: limits.backward_acceleration,
        lateral_acceleration: limits.lateral_acceleration,
        jerk: limits.jerk,
        steer_rate: limits.steer_rate,
        stop_to_steer: limits.stop_to_steer.into(),
    }
}

/// A moment of a driven path.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct n3p_moment {
    /// Since the start, seconds.
    pub time: f64,
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub heading: f64,
    /// m/s, negative backward.
    pub speed: f64,
    /// Rate of change of the speed from now on, m/s².
    pub acceleration: f64,
    /// Angle of the front wheels, radians, positive to the left.
    pub steer: f64,
    /// Curvature of an arc driven with this angle, 1/m.
    pub curvature: f64,
    /// Driven since the start, metres.
    pub distance: f64,
    /// 1 forward, -1 backward.
    pub gear: i32,
}

impl From<&Moment> for n3p_moment {
    fn from(m: &Moment) -> Self {
        Self {
            time: m.time,
            x: m.pose.x,
            y: m.pose.y,
            heading: m.pose.heading,
            speed: m.speed,
            acceleration: m.acceleration,
            steer: m.steer,
            curvature: m.curvature,
            distance: m.distance,
            gear: m.gear.sign() as i32,
        }
    }
}
