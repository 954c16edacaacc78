//! The car: dimensions, steering limit, speeds, footprint.
//!
//! Kinematic bicycle, pose at the rear-axle centre (paper eq. 1): curvature
//! `κ = tan δ / wheelbase`.

mod margins;
mod overlap;

use serde::{Deserialize, Serialize};

use crate::geometry::{Aabb, Polygon, Pose, Vec2};
pub use margins::Margins;

/// Direction of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gear {
    /// Nose first.
    Forward,
    /// Tail first.
    Backward,
}

impl Gear {
    /// +1 forward, −1 backward.
    pub fn sign(self) -> f64 {
        match self {
            Gear::Forward => 1.0,
            Gear::Backward => -1.0,
        }
    }

    /// The gear of a signed length; zero counts as forward.
    pub fn of(length: f64) -> Gear {
        if length < 0.0 { Gear::Backward } else { Gear::Forward }
    }
}

/// A vehicle. The default is the paper's 2024 Honda Accord.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Bumper to bumper, metres.
    pub length: f64,
    /// Side to side, metres.
    pub width: f64,
    /// Rear to front axle, metres.
    pub wheelbase: f64,
    /// Rear axle to rear bumper, metres.
    pub rear_overhang: f64,
    /// Largest steering angle of the front wheels, radians.
    pub max_steer: f64,
    /// Speed when driving forward, m/s (for times, the Δδ metric, and the steps of policies).
    #[serde(default = "default_forward_speed")]
    pub forward_speed: f64,
    /// Speed when driving backward, m/s.
    #[serde(default = "default_backward_speed")]
    pub backward_speed: f64,
    /// How fast the front wheels turn, rad/s. The default is about 500°/s at the steering wheel of a usual
    /// car. Left out of files where it is as usual, so that those of before keep their bytes.
    #[serde(default = "default_steer_rate", skip_serializing_if = "is_default_steer_rate")]
    pub steer_rate: f64,
}

const fn default_steer_rate() -> f64 {
    Vehicle::STEER_RATE
}

fn is_default_steer_rate(rate: &f64) -> bool {
    *rate == default_steer_rate()
}

fn default_forward_speed() -> f64 {
    2.0
}

fn default_backward_speed() -> f64 {
    1.0
}

impl Default for Vehicle {
    fn default() -> Self {
        Self {
            length: 4.97,
            width: 1.86,
            wheelbase: 2.83,
            rear_overhang: 1.10,
            max_steer: 34.9_f64.to_radians(),
            forward_speed: default_forward_speed(),
            backward_speed: default_backward_speed(),
            steer_rate: default_steer_rate(),
        }
    }
}

/// A box in the vehicle's frame, larger by a margin on each side.
fn grown(body: Aabb, margins: Margins) -> Aabb {
    let [front, rear, left, right] = margins.sides();
    Aabb { min: body.min - Vec2::new(rear, right), max: body.max + Vec2::new(front, left) }
}

/// A vehicle field outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("vehicle.{field} is {value}; it must be {expected}")]
pub struct VehicleError {
    /// Name of the field.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What would be right.
    pub expected: &'static str,
}

impl Vehicle {
    /// How fast the front wheels of a usual car turn, rad/s.
    pub const STEER_RATE: f64 = 0.6;

    /// Radius of a wheel in wheelbases: 0.34 m of the default vehicle.
    pub const WHEEL_RADIUS: f64 = 0.12;

    /// Checks every field.
    pub fn validate(&self) -> Result<(), VehicleError> {
        let check = |field, value: f64, ok: bool, expected| {
            if value.is_finite() && ok {
                Ok(())
            } else {
                Err(VehicleError { field, value, expected })
            }
        };
        let lengths = "between 0.1 and 50 metres";
        let is_length = |v: f64| (0.1..=50.0).contains(&v);
        check("length", self.length, is_length(self.length), lengths)?;
        check("width", self.width, is_length(self.width), lengths)?;
        check(
            "wheelbase",
            self.wheelbase,
            is_length(self.wheelbase) && self.wheelbase < self.length,
            "at least 0.1 metres and less than the length",
        )?;
        check(
            "rear_overhang",
            self.rear_overhang,
            self.rear_overhang >= 0.0 && self.rear_overhang + self.wheelbase <= self.length,
            "at least 0 metres, and with the wheelbase no more than the length",
        )?;
        let angles = match self.max_steer {
            steer if steer > 1.5 => "between 0.01 and 1.5 radians; it looks like degrees",
            _ => "between 0.01 and 1.5 radians",
        };
        let is_angle = (0.01..1.5).contains(&self.max_steer);
        check("max_steer", self.max_steer, is_angle, angles)?;
        let speeds = "between 0.01 and 50 m/s";
        let is_speed = |v: f64| (0.01..=50.0).contains(&v);
        check("forward_speed", self.forward_speed, is_speed(self.forward_speed), speeds)?;
        check("backward_speed", self.backward_speed, is_speed(self.backward_speed), speeds)?;
        let is_rate = (0.01..=50.0).contains(&self.steer_rate);
        check("steer_rate", self.steer_rate, is_rate, "between 0.01 and 50 rad/s")
    }

    /// How many times as long as the default vehicle. Lengths in planners' settings are those
    /// for the default vehicle and are scaled by this for others, so that a plan does not depend
    /// on the unit of length.
    pub fn scale(&self) -> f64 {
        self.length / Self::default().length
    }

    /// Largest curvature, 1/m.
    pub fn max_curvature(&self) -> f64 {
        self.max_steer.tan() / self.wheelbase
    }

    /// Radius of the rear axle's tightest circle, metres.
    pub fn turning_radius(&self) -> f64 {
        self.wheelbase / self.max_steer.tan()
    }

    /// Steering angle that drives `curvature`, radians.
    pub fn steer(&self, curvature: f64) -> f64 {
        (curvature * self.wheelbase).atan()
    }

    /// Curvature driven with the steering angle `steer`, 1/m.
    pub fn curvature(&self, steer: f64) -> f64 {
        steer.tan() / self.wheelbase
    }

    /// Rear axle to front bumper, metres.
    pub fn front_extent(&self) -> f64 {
        self.length - self.rear_overhang
    }

    /// Rear axle to the farthest corner, metres: no point of the footprint is farther from it.
    pub fn reach(&self) -> f64 {
        self.rear_overhang.max(self.front_extent()).hypot(self.width / 2.0)
    }

    /// The footprint in the vehicle's own frame, grown by a margin on every side, metres.
    pub fn footprint(&self, margins: impl Into<Margins>) -> Aabb {
        let half = self.width / 2.0;
        let body = Aabb::new(-self.rear_overhang, -half, self.front_extent(), half);
        grown(body, margins.into().of_everything())
    }

    /// The rectangle around the four wheels where they stand, grown like [`Vehicle::footprint`]: what must keep off
    /// kerbs. Wheels reach as far out as the body's sides and ahead of their axles by [`Vehicle::WHEEL_RADIUS`], no
    /// farther than the body; nothing low comes between them.
    pub fn wheel_box(&self, margins: impl Into<Margins>) -> Aabb {
        let (radius, half) = (Self::WHEEL_RADIUS * self.wheelbase, self.width / 2.0);
        let rear = -radius.min(self.rear_overhang);
        let front = (self.wheelbase + radius).min(self.front_extent());
        grown(Aabb::new(rear, -half, front, half), margins.into())
    }

    /// The footprint at `pose`.
    pub fn footprint_at(&self, pose: Pose) -> Polygon {
        Polygon::rectangle(pose, self.footprint(0.0))
    }

    /// Distance from the rear axle to the footprint's centre, along the heading, metres.
    pub fn center_offset(&self) -> f64 {
        self.length / 2.0 - self.rear_overhang
    }

    /// The pose of the footprint's centre for a rear-axle pose.
    pub fn body_center(&self, pose: Pose) -> Pose {
        pose.shifted(self.center_offset())
    }

    /// The rear-axle pose whose footprint is centred on `center`.
    pub fn rear_axle(&self, center: Pose) -> Pose {
        center.shifted(-self.center_offset())
    }

    /// Whether `other` is the same car: dimensions and steering limit agree. Speeds do not matter
    /// to paths.
    pub fn is_like(&self, other: &Vehicle) -> bool {
        self.differing_field(other).is_none()
    }

    /// [`Vehicle::is_like`], and the speeds agree, too.
    pub fn drives_like(&self, other: &Vehicle) -> bool {
        self.differing_speed(other).is_none() && self.is_like(other)
    }

    /// The first speed that differs: its name, and both values.
    pub fn differing_speed(&self, other: &Vehicle) -> Option<(&'static str, f64, f64)> {
        let fields = [
            ("forward_speed", self.forward_speed, other.forward_speed),
            ("backward_speed", self.backward_speed, other.backward_speed),
        ];
        fields.into_iter().find(|(_, own, others)| own != others)
    }

    /// The first dimension in which `other` is another car: its name, and both values.
    pub fn differing_field(&self, other: &Vehicle) -> Option<(&'static str, f64, f64)> {
        /// Half a millimetre or 0.03°: vehicles given with few decimals stay usable.
        const TOLERANCE: f64 = 5e-4;
        let fields = [
            ("length", self.length, other.length),
            ("width", self.width, other.width),
            ("wheelbase", self.wheelbase, other.wheelbase),
            ("rear_overhang", self.rear_overhang, other.rear_overhang),
            ("max_steer", self.max_steer, other.max_steer),
        ];
        // By what is the same, so that NaN differs.
        let same = |own: f64, others: f64| (own - others).abs() <= TOLERANCE;
        fields.into_iter().find(|&(_, own, others)| !same(own, others))
    }

    /// Whether `other` can drive whatever this vehicle can, wherever this one fits: its footprint
    /// lies within this one's, the rear axles upon each other, and it turns at least as tightly.
    pub fn covers(&self, other: &Vehicle) -> bool {
        /// Half a millimetre: vehicles given with few decimals stay usable.
        const TOLERANCE: f64 = 5e-4;
        let within = |own: f64, others: f64| others <= own + TOLERANCE;
        within(self.rear_overhang, other.rear_overhang)
            && within(self.front_extent(), other.front_extent())
            && within(self.width, other.width)
            && within(self.turning_radius(), other.turning_radius())
    }

    /// Speed in `gear`, m/s.
    pub fn speed(&self, gear: Gear) -> f64 {
        match gear {
            Gear::Forward => self.forward_speed,
            Gear::Backward => self.backward_speed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_accord_turns_on_4_057_metres() {
        let v = Vehicle::default();
        assert!(v.validate().is_ok());
        assert!((v.turning_radius() - 4.057).abs() < 5e-4, "{}", v.turning_radius());
        assert!((v.steer(v.max_curvature()) - v.max_steer).abs() < 1e-12);
    }

    #[test]
    fn says_which_field_is_wrong() {
        let v = Vehicle { width: f64::NAN, ..Vehicle::default() };
        assert_eq!(v.validate().unwrap_err().field, "width");
        let v = Vehicle { rear_overhang: 3.0, ..Vehicle::default() };
        assert_eq!(v.validate().unwrap_err().field, "rear_overhang");
        let v = Vehicle { max_steer: 35.0, ..Vehicle::default() };
        let told = "vehicle.max_steer is 35; it must be between 0.01 and 1.5 radians; it looks \
                    like degrees";
        assert_eq!(v.validate().unwrap_err().to_string(), told);
        let v = Vehicle { max_steer: 0.0, ..Vehicle::default() };
        assert!(!v.validate().unwrap_err().to_string().contains("degrees"));
    }
}
