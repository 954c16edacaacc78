//! The world a car parks in: scenes, collision, cells and the abstraction.
//!
//! In reading order: a [`Scene`] is what a user gives ([`mod@scene`] reads files, [`mod@tpcap`] a
//! benchmark's, [`mod@generate`] makes scenes, [`mod@bays`] unusual ones, [`mod@clutter`] some that are no parking
//! lots); [`spot`] finds the spot frame that everything below works in; [`Obstacles`] is a scene's geometry in any frame; [`collision`] answers
//! whether a motion is free; [`cell`] defines the abstracted environments 𝓔 of the paper and
//! [`abstraction`] finds them in a scene.

pub mod abstraction;
pub mod bays;
pub mod cell;
pub mod clutter;
pub mod collision;
pub mod generate;
mod kind;
mod obstacles;
pub mod scene;
pub mod spot;
pub mod tpcap;

pub use kind::{Level, ParkingType, UnknownName};
pub use obstacles::{ObstacleError, Obstacles};
pub use scene::Scene;
