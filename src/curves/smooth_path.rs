//! A path whose curvature does not jump while the car drives.

use super::{Clothoid, Path, Segment};
use crate::geometry::{Frame, Pose, wrap_angle};
use crate::vehicle::{Gear, Vehicle};

/// A drivable path of the rear axle, motions of steadily changing curvature end to end.
///
/// Whether it is *smooth* is a question of what it is made of: [`SmoothPath::jumps`] tells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SmoothPath {
    /// Where it begins.
    pub start: Pose,
    /// The curvature that the wheels stand for before the car moves, 1/m.
    pub begin: f64,
    /// The motions, in driving order.
    pub motions: Vec<Clothoid>,
}

/// One piece of a sampled path: a pose, and the short motion that follows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The pose; heading in (−π, π].
    pub pose: Pose,
    /// Gear of the motion that follows (of the last pose: that led there).
    pub gear: Gear,
    /// What is driven from there to the next pose; of the last pose, of no length, the motion that led there.
    pub motion: Clothoid,
}

/// Whether a change between these curvatures, 1/m, is more than rounding.
pub(super) fn jumps(from: f64, to: f64) -> bool {
    const ROUNDING: f64 = 1e-6;
    (from - to).abs() > ROUNDING * from.abs().max(to.abs())
}

impl SmoothPath {
    /// The motions of `path` as they are.
    pub fn of(path: &Path) -> Self {
        Self {
            start: path.start,
            begin: 0.0,
            motions: path.segments.iter().map(|&s| s.into()).collect(),
        }
    }

    /// Each motion with the pose it starts from.
    pub fn legs(&self) -> impl Iterator<Item = (Pose, Clothoid)> + '_ {
        self.motions.iter().scan(self.start, |pose, &c| {
            let from = *pose;
            *pose = c.end(from);
            Some((from, c))
        })
    }

    /// The pose at the end.
    pub fn end(&self) -> Pose {
        self.motions.iter().fold(self.start, |pose, c| c.end(pose))
    }

    /// Driven length, metres.
    pub fn length(&self) -> f64 {
        self.motions.iter().fold(0.0, |sum, c| sum + c.length.abs())
    }

    /// How often the gear changes along the way.
    pub fn direction_changes(&self) -> usize {
        self.motions.windows(2).filter(|w| w[0].gear() != w[1].gear()).count()
    }

    /// Whether it is made of arcs and straights alone.
    pub fn is_arcs(&self) -> bool {
        self.motions.iter().all(|c| c.is_arc())
    }

    /// Places where the curvature jumps while the car drives on in the same gear.
    pub fn jumps(&self) -> usize {
        let jumps = |w: &&[Clothoid]| w[0].gear() == w[1].gear() && jumps(w[0].to, w[1].from);
        self.motions.windows(2).filter(jumps).count()
    }

    /// Whether the steering wheel is turned at standstill: `[at the start, at a change of gear]`.
    pub fn turns_at_standstill(&self) -> [bool; 2] {
        let start = self.motions.first().is_some_and(|c| jumps(self.begin, c.from));
        let turns = |w: &[Clothoid]| w[0].gear() != w[1].gear() && jumps(w[0].to, w[1].from);
        [start, self.motions.windows(2).any(turns)]
    }

    /// The path seen from `frame`, given in the world of the frame's parent.
    pub fn to_world(&self, frame: &Frame) -> Self {
        let flip = |c: &Clothoid| Clothoid {
            from: frame.flip_curvature(c.from),
            to: frame.flip_curvature(c.to),
            ..*c
        };
        Self {
            start: frame.world_from_local(self.start),
            begin: frame.flip_curvature(self.begin),
            motions: self.motions.iter().map(flip).collect(),
        }
    }

    /// Poses at most `step` metres apart, and half a radian, every border of a motion included. Where the
    /// curvature changes they are so close that an arc of the mean curvature leads from each to the next
    /// one within two micrometres.
    pub fn sample(&self, step: f64) -> Vec<Step> {
        const TURN: f64 = 0.5;
        const ASIDE: f64 = 2e-6;
        let step = Path::LEAST_STEP.max(step);
        // About as many as arcs take, so that the vector hardly grows.
        let about = (self.length() / step).min(1e5) as usize + 2 * self.motions.len() + 1;
        let mut out = Vec::with_capacity(about);
        let mut last = Clothoid::default();
        let at = |p: Pose| Pose::new(p.x, p.y, wrap_angle(p.heading));
        for (from, c) in self.legs() {
            let most = match c.sharpness() {
                0.0 => step,
                // An arc of length h is σh³/12 beside the clothoid at its end.
                sharp => step.min((12.0 * ASIDE / sharp).cbrt()),
            };
            let n = (c.length.abs() / most).max((c.turn() / TURN).abs()).ceil().max(1.0);
            for i in 0..n as u32 {
                let [begin, end] = [i, i + 1].map(|i| c.length * f64::from(i) / n);
                let motion = Clothoid {
                    from: c.curvature(begin),
                    to: c.curvature(end),
                    length: end - begin,
                };
                out.push(Step { pose: at(c.at(from, begin)), gear: c.gear(), motion });
                last = motion;
            }
        }
        let motion = Clothoid { from: last.to, to: last.to, length: 0.0 };
        out.push(Step { pose: at(self.end()), gear: last.gear(), motion });
        out
    }

    /// Arcs from the same start from which no point of the vehicle is ever farther than `deviation` metres,
    /// and which end with the same heading: what is swept exactly in place of the clothoids.
    ///
    /// An arc of length h with the mean curvature of its part of a clothoid of sharpness σ is nowhere more
    /// than σh²/8 off in heading, and at its end, where the heading is right, off by at most σh³/12 in
    /// position, which adds up from arc to arc. A point of the vehicle within R of the rear axle is so off by
    /// at most σh² (R/8 + l/12), where l is the length of all clothoids.
    pub fn arcs(&self, deviation: f64, vehicle: &Vehicle) -> Path {
        let reach = vehicle.reach();
        let ramps: f64 = self.motions.iter().filter(|c| !c.is_arc()).map(|c| c.length.abs()).sum();
        let mut path = Path { start: self.start, segments: Vec::with_capacity(self.motions.len()) };
        for c in &self.motions {
            let sharp = c.sharpness();
            let n = if sharp == 0.0 {
                1.0
            } else {
                let h = (deviation / (sharp * (reach / 8.0 + ramps / 12.0))).sqrt();
                (c.length.abs() / h).ceil().clamp(1.0, 1e6)
            };
            for i in 0..n as u32 {
                let middle = c.length * (f64::from(i) + 0.5) / n;
                path.segments
                    .push(Segment { curvature: c.curvature(middle), length: c.length / n });
            }
        }
        path
    }
}
