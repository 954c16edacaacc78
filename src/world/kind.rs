//! Parking types and difficulty levels.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

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
}

impl ParkingType {
    /// All types, in the order of every table.
    pub const ALL: [ParkingType; 3] = [Self::Forward, Self::Parallel, Self::Reverse];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Reverse => "reverse",
            Self::Parallel => "parallel",
        }
    }

    /// Whether the spot is a bay (forward or reverse).
    pub fn is_bay(self) -> bool {
        self != Self::Parallel
    }

    /// Heading of the parked car in the spot frame, radians.
    pub fn goal_heading(self) -> f64 {
        match self {
            Self::Forward => -std::f64::consts::FRAC_PI_2,
            Self::Reverse => std::f64::consts::FRAC_PI_2,
            Self::Parallel => 0.0,
        }
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
            expected: "forward, reverse, parallel".to_owned(),
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
