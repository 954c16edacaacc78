//! The C interface of N3P: handles, buffers of the caller's, and codes with a message.
//!
//! `include/n3p.h` is made of these files by cbindgen (`tests/header.rs`), and `docs/c.md` is the
//! guide. Types and constants are named as in C, so that one name finds both. No panic leaves a
//! function: it becomes `N3P_INTERNAL`.
//!
//! - [`status`]: codes, messages, and the guard around every function
//! - [`types`]: the structs that cross
//! - [`handles`]: numbers in the place of pointers, so that a closed handle is found out
//! - [`memory`]: what is read from and written to the caller's memory
//! - [`lot`], [`scene`], [`parker`], [`plan`]: the functions

#![warn(missing_docs)]
#![allow(non_camel_case_types, reason = "named as in C")]
#![allow(clippy::missing_safety_doc, reason = "docs/c.md says once what pointers must be")]

pub mod handles;
pub mod lot;
pub mod memory;
pub mod parker;
pub mod plan;
pub mod scene;
pub mod status;
pub mod types;
