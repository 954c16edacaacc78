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
#![expect(non_camel_case_types, reason = "named as in C, in every module that has some")]

/// What a function asks for of the pointers that it is given, beside what it checks ([`memory`]).
/// As a macro, which cbindgen passes over, it stays out of the header: there and in docs/c.md the
/// general rules are said in the words of C.
macro_rules! safety {
    ($asked:literal) => {
        concat!("\n\n# Safety\n\nWhere they are neither NULL nor misaligned: ", $asked)
    };
}

pub mod handles;
pub mod lot;
pub mod memory;
pub mod parker;
pub mod plan;
pub mod scene;
pub mod status;
pub mod types;
