//! Analytic expansion.
use crate::curves::reeds_shepp::Word;
use crate::geometry::Pose;

/// The Reeds-Shepp curve (and entry straight) that reached the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalyticTail {
    /// Where the curve begins, planning frame: the paper's x_rs, a preparatory pose.
    pub from: Pose,
    /// The curve.
    pub word: Word,
    /// Signed length of the straight from the curve's end to the goal, metres.
    pub entry: f64,
}
