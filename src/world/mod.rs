//! The world a car parks in: scenes, collision, cells and the abstraction.
//!
//! A [`Scene`] is what a user gives; [`Obstacles`] is its geometry in any frame;
//! [`collision`] answers whether a motion is free; [`cell`] defines the abstracted
//! environments 𝓔 of the paper and [`abstraction`] finds them in a scene.

pub mod abstraction;
pub mod cell;
pub mod collision;
pub mod generate;
mod kind;
mod obstacles;
pub mod scene;
pub mod spot;
pub mod tpcap;

pub use kind::{Level, ParkingType, UnknownName};
pub use obstacles::Obstacles;
pub use scene::Scene;
