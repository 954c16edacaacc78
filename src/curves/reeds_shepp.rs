//! Reeds-Shepp curves.
use super::Segment;
/// One Reeds-Shepp word between two poses: up to five segments of full curvature or straight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Word {
    segments: [Segment; 5],
    len: usize,
}
