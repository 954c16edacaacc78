//! The playground of N3P: what its page asks, and the server that serves the page.
//!
//! Everything the page wants to know is one function, [`answer`]: JSON in, JSON out. A browser calls it
//! as WebAssembly, without any server (`browser`, `build.sh`); where there is none of that, `n3p-play`
//! serves the page and the same function ([`server`]).
//!
//! - [`ask`]: the requests, and the answers to them
//! - `planning`: a scene planned by one method, as the page shows it
//! - `desk`: planners, kept warm between requests
//! - `catalogue`: methods, vehicles and examples to choose from
//! - `clock`: the time a plan takes

#![warn(missing_docs)]

pub mod ask;
#[cfg(target_arch = "wasm32")]
mod browser;
mod catalogue;
mod clock;
mod desk;
mod planning;
#[cfg(not(target_arch = "wasm32"))]
pub mod server;

pub use ask::answer;
