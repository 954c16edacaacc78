//! From a scene to its spot frame.
use super::{ParkingType, Scene};
use crate::geometry::{Frame, Vec2};

/// Where a scene's spot lies and what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotGuess {
    /// The spot frame in the world (the goal's own frame where no spot is known).
    pub frame: Frame,
    /// The parking type, where known.
    pub kind: Option<ParkingType>,
}
/// The planning frame of a scene.
pub fn guess(_scene: &Scene) -> SpotGuess {
    unimplemented!()
}
/// Corners of a world-aligned box seen from `frame`, counter-clockwise there.
pub fn bounds_in_frame(_bounds: [f64; 4], _frame: &Frame) -> [Vec2; 4] {
    unimplemented!()
}
