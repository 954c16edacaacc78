//! Scene → cell: an inner approximation of the free space around the spot.

use super::cell::Cell;

/// What the abstraction found in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Abstraction {
    /// The environment as measured, before rounding.
    pub measured: Cell,
    /// The grid cell used: `measured` rounded down.
    pub cell: Cell,
    /// Its index in the grid.
    pub index: usize,
    /// How far the spot frame was shifted along +y before measuring, metres: bays whose
    /// neighbours protrude into the lane begin their lane further out.
    pub shift: f64,
}
