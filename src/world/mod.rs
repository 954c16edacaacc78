//! The world a car parks in: scenes, collision, cells and the abstraction.
//!
//! In reading order: a [`Scene`] is what a user gives ([`mod@scene`] reads files, [`goals`] is where
//! paths may end, [`mod@tpcap`] a benchmark's, [`maps`] what else people have, `generate` makes scenes, `lots` whole car parks, `bays`
//! unusual spots, `clutter` what is no parking lot); [`spot`] finds the spot frame that everything below works in; [`Obstacles`] is a scene's geometry in any frame; [`collision`] answers
//! whether a motion is free; [`cell`] defines the abstracted environments 𝓔 of the paper and
//! [`abstraction`] finds them in a scene; [`free_spots`] finds places to park in where nothing marks them.

pub mod abstraction;
#[cfg(any(test, feature = "generate"))]
pub mod bays;
mod body;
pub mod cell;
#[cfg(any(test, feature = "generate"))]
pub mod clutter;
pub mod collision;
pub mod free_spots;
#[cfg(any(test, feature = "generate"))]
pub mod generate;
pub mod goals;
mod kind;
#[cfg(any(test, feature = "generate"))]
pub mod lots;
pub mod maps;
mod obstacles;
mod outlines;
mod placed;
mod previous;
pub mod scene;
mod scene_file;
pub mod spot;
pub mod tpcap;

pub use goals::GoalTolerance;
pub use kind::{Level, ParkingType, Stance, UnknownName};
pub use maps::{Map, MapOptions, MapRequest};
pub use obstacles::{ObstacleError, Obstacles};
pub use outlines::{DrivableArea, LowObstacles, Outline, Shape};
pub use previous::PreviousPath;
pub use scene::Scene;
