//! A path: where it starts and the segments driven from there.

use super::Segment;
use crate::geometry::{Frame, Pose, wrap_angle};
use crate::vehicle::{Gear, Vehicle};

/// A drivable path of the rear axle, segments of constant curvature end to end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    /// Where it begins.
    pub start: Pose,
    /// The motions, in driving order.
    pub segments: Vec<Segment>,
}

/// One sampled pose of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The pose; heading in (−π, π].
    pub pose: Pose,
    /// Gear of the motion that follows (for the last sample: that led here).
    pub gear: Gear,
    /// Curvature of that motion, 1/m.
    pub curvature: f64,
}

impl Path {
    /// The shortest distance between two samples, metres.
    pub const LEAST_STEP: f64 = 1e-3;

    /// A path that begins at `start`; segments shorter than a nanometre are dropped and
    /// equal neighbours (same curvature and gear) are joined.
    pub fn new(start: Pose, segments: impl IntoIterator<Item = Segment>) -> Self {
        let mut path = Self { start, segments: Vec::new() };
        path.extend(segments);
        path
    }

    /// Appends `segments`, joining and dropping as [`Path::new`] does.
    pub fn extend(&mut self, segments: impl IntoIterator<Item = Segment>) {
        let segments = segments.into_iter();
        self.segments.reserve(segments.size_hint().0);
        for s in segments {
            if s.length.abs() < 1e-9 {
                continue;
            }
            match self.segments.last_mut() {
                Some(last) if last.curvature == s.curvature && last.gear() == s.gear() => {
                    last.length += s.length;
                }
                _ => self.segments.push(s),
            }
        }
    }

    /// The pose at the end.
    pub fn end(&self) -> Pose {
        self.segments.iter().fold(self.start, |pose, s| s.end(pose))
    }

    /// The path before segment `index`, and the rest.
    pub fn split_at(&self, index: usize) -> (Path, Path) {
        let (before, after) = self.segments.split_at(index);
        let first = Path { start: self.start, segments: before.to_vec() };
        let rest = Path { start: first.end(), segments: after.to_vec() };
        (first, rest)
    }

    /// Driven length, metres.
    pub fn length(&self) -> f64 {
        // Not `sum`, whose nothing is −0.
        self.segments.iter().fold(0.0, |sum, s| sum + s.length.abs())
    }

    /// How often the gear changes along the way.
    pub fn direction_changes(&self) -> usize {
        self.segments.windows(2).filter(|w| w[0].gear() != w[1].gear()).count()
    }

    /// The largest |curvature|, 1/m.
    pub fn max_abs_curvature(&self) -> f64 {
        self.segments.iter().map(|s| s.curvature.abs()).fold(0.0, f64::max)
    }

    /// Each segment with the pose it starts from.
    pub fn legs(&self) -> impl Iterator<Item = (Pose, Segment)> + '_ {
        self.segments.iter().scan(self.start, |pose, &s| {
            let from = *pose;
            *pose = s.end(from);
            Some((from, s))
        })
    }

    /// Poses at most `step` metres and half a radian apart, every segment border included.
    ///
    /// A step below [`Path::LEAST_STEP`], or NaN, counts as that.
    pub fn sample(&self, step: f64) -> Vec<Sample> {
        /// Radians: from much larger turns between two poses the arc cannot be told.
        const TURN: f64 = 0.5;
        let step = Self::LEAST_STEP.max(step);
        let mut out = Vec::new();
        let push = |out: &mut Vec<Sample>, p: Pose, s: Segment| {
            let pose = Pose::new(p.x, p.y, wrap_angle(p.heading));
            out.push(Sample { pose, gear: s.gear(), curvature: s.curvature });
        };
        let mut last = None;
        for (from, s) in self.legs() {
            let n = (s.length / step).abs().max((s.turn() / TURN).abs()).ceil().max(1.0) as usize;
            for i in 0..n {
                push(&mut out, s.at(from, s.length * i as f64 / n as f64), s);
            }
            last = Some((s.end(from), s));
        }
        let (end, s) = last.unwrap_or((self.start, Segment::straight(0.0)));
        push(&mut out, end, s);
        out
    }

    /// The path seen from `frame`, given in the world of the frame's parent.
    pub fn to_world(&self, frame: &Frame) -> Path {
        let flip = |s: &Segment| Segment { curvature: frame.flip_curvature(s.curvature), ..*s };
        Path {
            start: frame.world_from_local(self.start),
            segments: self.segments.iter().map(flip).collect(),
        }
    }

    /// The path given in the world of the parent of `frame`, seen from `frame`.
    pub fn seen_from(&self, frame: &Frame) -> Path {
        // A mirror is its own inverse.
        let segments = self.to_world(frame).segments;
        Path { start: frame.local_from_world(self.start), segments }
    }

    /// The same way driven backwards, from its end to its start.
    pub fn reversed(&self) -> Path {
        Path::new(self.end(), self.segments.iter().rev().map(|s| s.reversed()))
    }

    /// Mean |δ(t + 0.1 s) − δ(t)| along the path at the vehicle's speeds, radians (the
    /// paper's Δδ). Zero for paths shorter than one time step.
    pub fn mean_abs_steer_change(&self, vehicle: &Vehicle) -> f64 {
        const DT: f64 = 0.1;
        let mut steer = Vec::new();
        let (mut elapsed, mut next) = (0.0, 0.0);
        for s in &self.segments {
            elapsed += s.length.abs() / vehicle.speed(s.gear());
            while next < elapsed {
                steer.push(vehicle.steer(s.curvature));
                next += DT;
            }
        }
        if steer.len() < 2 {
            return 0.0;
        }
        let total: f64 = steer.windows(2).map(|w| (w[1] - w[0]).abs()).sum();
        total / (steer.len() - 1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zigzag() -> Path {
        let segments =
            [(0.0, 1.0), (0.0, 0.5), (0.2, 2.0), (0.2, -1.0), (0.0, 1e-12), (-0.2, -1.0)];
        Path::new(
            Pose::new(1.0, 2.0, 0.3),
            segments.map(|(curvature, length)| Segment { curvature, length }),
        )
    }

    #[test]
    fn joins_drops_and_counts() {
        let p = zigzag();
        assert_eq!(p.segments.len(), 4);
        assert_eq!(p.direction_changes(), 1);
        assert!((p.length() - 5.5).abs() < 1e-12);
    }

    #[test]
    fn samples_are_close_and_end_at_the_ends() {
        let p = zigzag();
        let poses = p.sample(0.1);
        assert_eq!(poses[0].pose, p.start);
        assert!(poses.last().unwrap().pose.distance(p.end()) < 1e-12);
        assert!(poses.windows(2).all(|w| w[0].pose.distance(w[1].pose) <= 0.1 + 1e-12));
    }

    #[test]
    fn samples_are_finitely_many_and_tell_the_arc() {
        let circle = Path::new(Pose::default(), [Segment { curvature: 50.0, length: 0.3 }]);
        let poses = circle.sample(f64::INFINITY);
        assert_eq!(poses.len(), 31);
        for step in [0.0, -1.0, f64::NAN, 1e-300] {
            assert_eq!(circle.sample(step).len(), 301, "{step}");
        }
    }

    #[test]
    fn a_mirrored_path_ends_at_the_mirrored_end() {
        let frame = Frame { origin_in_world: Pose::new(4.0, -1.0, 2.0), mirrored: true };
        let p = zigzag();
        let end = p.to_world(&frame).end();
        let expected = frame.world_from_local(p.end());
        assert!(end.distance(expected) < 1e-12);
        assert!(wrap_angle(end.heading - expected.heading).abs() < 1e-12);
    }
}
