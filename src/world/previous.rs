//! A path that was planned before, as a request gives it along.

use serde::{Deserialize, Serialize};

use super::scene::InvalidField;
use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::{Gear, Vehicle};

/// A path that the car follows already: the arrays of a path file, in the scene's frame. Planning keeps to it while
/// it is free and near the best.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreviousPath {
    /// Rear-axle poses `[x, y, θ]`.
    pub poses: Vec<[f64; 3]>,
    /// +1 forward, −1 backward: of the motion that follows a pose.
    pub gears: Vec<i8>,
    /// Angle of the front wheels on that motion, radians.
    pub steer: Vec<f64>,
    /// The angles at both ends of that motion, where it changes on the way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steer_from: Option<Vec<f64>>,
    /// See `steer_from`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steer_to: Option<Vec<f64>>,
    /// The method that planned it; of no use here.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub method: String,
}

impl PreviousPath {
    /// Checks that it is a path.
    pub(super) fn check(&self) -> Result<(), InvalidField> {
        let n = self.poses.len();
        let invalid = |field: &str, message: String| {
            Err(InvalidField { field: format!("previous.{field}"), message })
        };
        let angles = [("steer_from", &self.steer_from), ("steer_to", &self.steer_to)];
        let angles = angles.into_iter().filter_map(|(name, list)| Some((name, list.as_ref()?)));
        let angles: Vec<_> = angles.chain([("steer", &self.steer)]).collect();
        let lengths = angles.iter().map(|(name, list)| (*name, list.len()));
        for (name, length) in lengths.chain([("gears", self.gears.len())]) {
            if length != n {
                let message = format!("has {length} values; expected {n}, one for each pose");
                return invalid(name, message);
            }
        }
        for (i, pose) in self.poses.iter().enumerate() {
            if !pose.iter().all(|v| v.is_finite()) {
                return invalid(&format!("poses[{i}]"), "is not finite".to_owned());
            }
        }
        for (name, list) in angles {
            if let Some(i) = list.iter().position(|v| v.is_nan() || v.abs() > 1.5) {
                let message = format!("is {}; expected an angle in radians", list[i]);
                return invalid(&format!("{name}[{i}]"), message);
            }
        }
        match self.gears.iter().position(|g| !matches!(g, 1 | -1)) {
            Some(i) => {
                invalid(&format!("gears[{i}]"), format!("is {}; expected 1 or -1", self.gears[i]))
            }
            None => Ok(()),
        }
    }

    /// Where it leads; `None` for a path of no poses.
    pub fn end(&self) -> Option<Pose> {
        self.poses.last().map(|&p| p.into())
    }

    /// What is left of it for a car at `pose`, as arcs and straights; `None` for one that is nowhere near it. Where it
    /// comes by several times, the last counts.
    ///
    /// Clothoids become the straight and the turn that they lie between.
    pub fn rest(&self, pose: Pose, vehicle: &Vehicle) -> Option<Vec<Segment>> {
        /// Farther away, metres and radians, a car is not on its way any more.
        const NEAR: f64 = 0.5;
        const TURNED: f64 = 0.2;
        /// Poses about as near as the nearest, metres.
        const AS_NEAR: f64 = 0.02;
        let scale = vehicle.scale();
        let distance = |&p: &[f64; 3]| {
            let there = Pose::from(p);
            let turned = (there.heading - pose.heading).sin().abs() > TURNED
                || (there.heading - pose.heading).cos() < 0.0;
            if turned { f64::INFINITY } else { pose.distance(there) }
        };
        let distances: Vec<f64> = self.poses.iter().map(distance).collect();
        let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
        if nearest > NEAR * scale {
            return None;
        }
        let first = distances.iter().rposition(|&d| d <= nearest + AS_NEAR * scale)?;
        let mut rest: Vec<Segment> = Vec::new();
        let mut add = |curvature: f64, length: f64, gear: Gear| match rest.last_mut() {
            _ if length < 1e-12 => {}
            Some(last) if last.gear() == gear && (last.curvature - curvature).abs() < 1e-9 => {
                last.length += gear.sign() * length;
            }
            _ => rest.push(Segment { curvature, length: gear.sign() * length }),
        };
        let mut i = first;
        while i + 1 < self.poses.len() {
            let [begin, _] = self.curvatures(i, vehicle);
            let i_begins = i;
            let (gear, mut length, mut turn, mut end) = (self.gears[i], 0.0, 0.0, begin);
            // One motion: up to where the gear or the sense of steering changes, or the wheels are straight.
            while i + 1 < self.poses.len() {
                let [from, to] = self.curvatures(i, vehicle);
                let goes_on = length == 0.0
                    || (self.gears[i] == gear
                        && (from - end).abs() < 1e-9
                        && ((to - from).abs() < 1e-9) == ((end - begin).abs() < 1e-9)
                        && (to - from) * (end - begin) >= 0.0
                        && (from != 0.0 || end == begin));
                if !goes_on {
                    break;
                }
                let chord = Pose::from(self.poses[i]).distance(self.poses[i + 1].into());
                let mean = f64::midpoint(from, to);
                let half = mean.abs() * chord / 2.0;
                let part =
                    if half < 1e-9 { chord } else { 2.0 * half.min(1.0).asin() / mean.abs() };
                (length, turn, end, i) = (length + part, turn + part * mean, to, i + 1);
            }
            let gear = if gear > 0 { Gear::Forward } else { Gear::Backward };
            let peak = if begin.abs() > end.abs() { begin } else { end };
            let turning = if peak == 0.0 { 0.0 } else { (turn / peak).clamp(0.0, length) };
            let parts = [(peak, turning), (0.0, length - turning)];
            let parts = if begin.abs() > end.abs() { parts } else { [parts[1], parts[0]] };
            for (curvature, length) in parts {
                // Wheels that are turned already need no straight to turn on.
                if curvature != 0.0 || peak == 0.0 || i_begins > first || begin == 0.0 {
                    add(curvature, length, gear);
                }
            }
        }
        Some(rest)
    }

    /// The curvatures at both ends of the motion that follows pose `i`, 1/m.
    fn curvatures(&self, i: usize, vehicle: &Vehicle) -> [f64; 2] {
        let angle = |list: &Option<Vec<f64>>| list.as_ref().map_or(self.steer[i], |s| s[i]);
        // What is straight but for rounding is straight.
        let straightened = |curvature: f64| if curvature.abs() < 1e-9 { 0.0 } else { curvature };
        [&self.steer_from, &self.steer_to].map(|s| straightened(vehicle.curvature(angle(s))))
    }
}
