//! Where a policy from outside comes from.

use std::time::Duration;

use super::{Policy, PolicyFault};

/// A policy from outside.
#[derive(Clone, Debug)]
pub struct PolicySource;
impl PolicySource {
    /// New.
    pub fn new(_spec: &str, limit_s: f64) -> Result<Self, PolicyFault> { let _ = Duration::from_secs_f64(limit_s); Ok(Self) }
    /// Opens it.
    pub fn open(&self) -> Result<Box<dyn Policy + Send>, PolicyFault> { Err(PolicyFault::Ended) }
}
