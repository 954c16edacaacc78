//! Parking types, how a parked car stands, and difficulty levels.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::geometry::Vec2;
use crate::vehicle::Gear;

/// How the car stands in its spot (the paper's γ).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "plan", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum ParkingType {
    /// Bay, nose in.
    Forward,
    /// Bay, tail in.
    Reverse,
    /// Along the lane.
    Parallel,
    /// A bay at 30° to 150° to the lane, nose in or tail in; at 90° it is one of the others.
    Angled,
}

impl ParkingType {
    /// All types, in the order of every table.
    pub const ALL: [ParkingType; 4] = [Self::Forward, Self::Parallel, Self::Reverse, Self::Angled];

    /// The paper's three: square to the lane or along it. What says no type means these where all of
    /// them were meant before there were others.
    pub const SQUARE: [ParkingType; 3] = [Self::Forward, Self::Parallel, Self::Reverse];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Reverse => "reverse",
            Self::Parallel => "parallel",
            Self::Angled => "angled",
        }
    }

    /// Whether the spot is a bay, into which a straight leads.
    pub fn is_bay(self) -> bool {
        self != Self::Parallel
    }

    /// Heading of the parked car in the spot frame, radians; `None` where every spot has its own.
    pub fn goal_heading(self) -> Option<f64> {
        match self {
            Self::Forward => Some(-FRAC_PI_2),
            Self::Reverse => Some(FRAC_PI_2),
            Self::Parallel => Some(0.0),
            Self::Angled => None,
        }
    }
}

/// How a parked car stands in the spot frame: its type, and its heading.
///
/// Tail in, the nose points out of the bay and the heading is the bay's slant φ; nose in it is φ − π.
/// The slant is the angle from the direction of travel to the way out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    kind: ParkingType,
    heading: f64,
}

impl Stance {
    /// A car of a type, parked with `heading` (radians) where the type leaves that open.
    pub fn new(kind: ParkingType, heading: f64) -> Self {
        Self { kind, heading: kind.goal_heading().unwrap_or(heading) }
    }

    /// The parking type.
    pub fn kind(self) -> ParkingType {
        self.kind
    }

    /// Heading of the parked car in the spot frame, radians.
    pub fn heading(self) -> f64 {
        self.heading
    }

    /// The unit vector that leads out of the spot to the lane, spot frame.
    pub fn out(self) -> Vec2 {
        if self.kind != ParkingType::Angled {
            // Exactly.
            return Vec2::new(0.0, 1.0);
        }
        let (sin, cos) = self.heading.sin_cos();
        Vec2::new(cos, sin) * sin.signum()
    }

    /// The gears in which a straight may lead into the spot: none but one into a bay.
    pub fn entry_gears(self) -> &'static [Gear] {
        match self.kind {
            ParkingType::Parallel => &[Gear::Forward, Gear::Backward],
            _ if self.heading < 0.0 => &[Gear::Forward],
            _ => &[Gear::Backward],
        }
    }

    /// The same spot when the car comes along the lane the other way: seen in the mirror.
    pub fn other_way(self) -> Self {
        let Self { kind, heading } = self;
        Self::new(kind, heading.signum() * PI - heading)
    }
}

/// Difficulty of a generated scene (paper, section V-B).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "plan", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Wide spots, a dead end in half of the scenes.
    Easy,
    /// Narrower spots, always a dead end.
    Complex,
    /// The narrowest spots, always a close dead end.
    Extreme,
}

impl Level {
    /// All levels, easiest first.
    pub const ALL: [Level; 3] = [Self::Easy, Self::Complex, Self::Extreme];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Easy => "easy",
            Self::Complex => "complex",
            Self::Extreme => "extreme",
        }
    }
}

/// A name that is none of the known ones.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("unknown {what} \"{name}\"; expected one of {expected}")]
pub struct UnknownName {
    /// What the name should be one of.
    pub what: &'static str,
    /// The name given.
    pub name: String,
    /// The names that exist.
    pub expected: String,
}

impl FromStr for ParkingType {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| UnknownName {
            what: "parking type",
            name: name.to_owned(),
            expected: "forward, reverse, parallel, angled".to_owned(),
        })
    }
}

impl FromStr for Level {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|l| l.name() == name).ok_or_else(|| UnknownName {
            what: "level",
            name: name.to_owned(),
            expected: "easy, complex, extreme".to_owned(),
        })
    }
}

impl fmt::Display for ParkingType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bay_leads_out_to_the_lane_whichever_way_the_car_stands_and_comes() {
        for degrees in [30.0, 75.0, 105.0, 150.0_f64] {
            let slant = degrees.to_radians();
            for heading in [slant, slant - PI] {
                let stance = Stance::new(ParkingType::Angled, heading);
                let out = Vec2::new(slant.cos(), slant.sin());
                assert!((stance.out() - out).norm() < 1e-12, "{stance:?}");
                let mirrored = Vec2::new(-out.x, out.y);
                assert!((stance.other_way().out() - mirrored).norm() < 1e-12, "{stance:?}");
                assert_eq!(stance.other_way().entry_gears(), stance.entry_gears());
                assert!((stance.other_way().other_way().heading() - heading).abs() < 1e-12);
            }
        }
        for kind in ParkingType::SQUARE {
            let stance = Stance::new(kind, 0.3);
            assert_eq!(Some(stance.heading()), kind.goal_heading());
            assert_eq!(stance.other_way(), stance);
        }
    }
}
