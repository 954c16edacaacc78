//! N3P itself, and what picks its models for a vehicle.
//!
//! [`guided`] is the planner: it asks a selector where to park from. A [`Method`] is a planner by
//! name; it is built from [`Models`], which know the vehicles they serve.

mod by_vehicle;
mod catalogue;
mod driver;
pub mod guided;
pub mod method;
mod models;
pub(crate) mod more;

pub use catalogue::{Listing, catalogue};
pub use driver::{Choice, Driver, RolloutConfig, TrainedPolicy};
pub use guided::GuidedPlanner;
pub use method::{Method, MethodError, MethodSettings};
pub use models::{FORESIGHT, Models, ModelsError};
