//! N3P itself, and what picks its models for a vehicle.
//!
//! [`guided`] is the planner: it asks a selector where to park from. A [`Method`] is a planner by
//! name; it is built from [`Models`], which know the vehicles they serve.

mod by_vehicle;
pub mod guided;
mod method;
mod models;

pub use guided::GuidedPlanner;
pub use method::{Method, MethodError, MethodSettings};
pub use models::{Models, ModelsError};
