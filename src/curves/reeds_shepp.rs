//! Reeds-Shepp curves.
use super::Segment;
use crate::geometry::Pose;
/// One Reeds-Shepp word between two poses: up to five segments of full curvature or straight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Word {
    segments: [Segment; 5],
    len: usize,
}
impl Word {
    /// The segments in driving order, metres.
    pub fn segments(&self) -> &[Segment] {
        &self.segments[..self.len]
    }
    /// Driven length, metres.
    pub fn length(&self) -> f64 {
        self.segments().iter().map(|s| s.length.abs()).sum()
    }
    /// Its name, such as `L+R-S-` (turn and gear per segment).
    pub fn name(&self) -> String {
        String::new()
    }
}
/// All words from `from` to `to` that exist (at most 48), unsorted, appended to `out`.
pub fn words(_from: Pose, _to: Pose, _radius: f64, _out: &mut Vec<Word>) {
    unimplemented!()
}
/// Length of the shortest word, metres.
pub fn shortest_length(_from: Pose, _to: Pose, _radius: f64) -> f64 {
    unimplemented!()
}
