//! How fast a trajectory may be.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::vehicle::{Gear, Vehicle};

/// Limits of a trajectory. Those of speed, one per gear, belong to the
/// [`Vehicle`](crate::vehicle::Vehicle).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrajectoryLimits {
    /// Largest acceleration when driving forward, m/s²; braking is as strong.
    pub forward_acceleration: f64,
    /// Largest acceleration when driving backward, m/s²; braking is as strong.
    pub backward_acceleration: f64,
    /// Largest v²·|κ| at the rear axle, m/s².
    pub lateral_acceleration: f64,
    /// How fast the acceleration changes at most, m/s³.
    pub jerk: f64,
    /// How fast the front wheels turn, rad/s: see [`TrajectoryLimits::of`].
    pub steer_rate: f64,
    /// Whether the car stops wherever the steering angle jumps by more than
    /// [`Trajectory::STEER_TOLERANCE`](super::Trajectory::STEER_TOLERANCE).
    pub stop_to_steer: bool,
}

impl Default for TrajectoryLimits {
    fn default() -> Self {
        Self {
            forward_acceleration: 1.0,
            backward_acceleration: 1.0,
            lateral_acceleration: 2.0,
            jerk: 2.0,
            steer_rate: Vehicle::default().steer_rate,
            stop_to_steer: false,
        }
    }
}

/// A field of [`TrajectoryLimits`] outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} is {value}; it must be between {} and {} {unit}", .range.start(), .range.end())]
pub struct LimitError {
    /// Name of the field.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What would be right.
    pub range: RangeInclusive<f64>,
    /// Unit of value and range.
    pub unit: &'static str,
}

impl TrajectoryLimits {
    /// The usual limits, and the vehicle's own steering rate.
    pub fn of(vehicle: &Vehicle) -> Self {
        Self { steer_rate: vehicle.steer_rate, ..Self::default() }
    }

    /// Accelerations allowed, m/s².
    pub const ACCELERATIONS: RangeInclusive<f64> = 0.01..=50.0;
    /// Jerks allowed, m/s³.
    pub const JERKS: RangeInclusive<f64> = 0.01..=1000.0;
    /// Steering rates allowed, rad/s.
    pub const STEER_RATES: RangeInclusive<f64> = 0.01..=50.0;

    /// Checks every field.
    pub fn validate(&self) -> Result<(), LimitError> {
        let check = |field, value, range: RangeInclusive<f64>, unit| {
            if range.contains(&value) {
                Ok(())
            } else {
                Err(LimitError { field, value, range, unit })
            }
        };
        let (accelerations, rates) = (Self::ACCELERATIONS, Self::STEER_RATES);
        check("forward_acceleration", self.forward_acceleration, accelerations.clone(), "m/s²")?;
        check("backward_acceleration", self.backward_acceleration, accelerations.clone(), "m/s²")?;
        check("lateral_acceleration", self.lateral_acceleration, accelerations, "m/s²")?;
        check("jerk", self.jerk, Self::JERKS, "m/s³")?;
        check("steer_rate", self.steer_rate, rates, "rad/s")
    }

    /// Largest acceleration in `gear`, m/s².
    pub fn acceleration(&self, gear: Gear) -> f64 {
        match gear {
            Gear::Forward => self.forward_acceleration,
            Gear::Backward => self.backward_acceleration,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_which_limit_is_wrong() {
        assert_eq!(TrajectoryLimits::default().validate(), Ok(()));
        for value in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
            let limits = TrajectoryLimits { steer_rate: value, ..Default::default() };
            let message = limits.validate().unwrap_err().to_string();
            let expected = format!("steer_rate is {value}; it must be between 0.01 and 50 rad/s");
            assert_eq!(message, expected);
        }
    }
}
