//! evaluation

pub mod draw;
