//! Clothoids between the motion primitives of a search whose steering angle is not to jump.
//!
//! Motions of a search are arcs and straights. Where one follows another in the same gear, the wheels turn on a
//! clothoid driven between them: the transition. It is a motion of its own, so that every node lies where the car comes, and
//! swept like any other.

use crate::curves::{Clothoid, SmoothPath};
use crate::geometry::{Aabb, Pose};
use crate::vehicle::Vehicle;
use crate::world::collision::{BodyFrame, CollisionWorld, Sweep};

use super::search::Primitive;

/// How the wheels turn in a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning {
    /// |Change of curvature| per metre of the transitions, 1/m².
    pub sharpness: f64,
    /// Whether the wheels may turn at standstill where the gear changes.
    pub at_changes: bool,
    /// How far from where it is checked the car may come on one transition, metres.
    pub deviation: f64,
}

/// A clothoid on which the wheels turn from the steering of one primitive to that of another.
#[derive(Clone, Debug)]
pub(super) struct Transition {
    /// The motion, forward in time.
    pub motion: Clothoid,
    /// Where the reversed motion ends, seen from where it begins.
    pub end: BodyFrame,
    /// The turn of the reversed motion, radians.
    pub turn: f64,
    /// What the reversed motion sweeps: arcs, each with its begin, seen from where the motion begins.
    arcs: Vec<(BodyFrame, Sweep)>,
}

impl Transition {
    fn new(motion: Clothoid, deviation: f64, vehicle: &Vehicle, footprint: &Aabb) -> Self {
        let reversed = Clothoid { from: motion.to, to: motion.from, length: -motion.length };
        let origin = Pose::default();
        let path = SmoothPath { start: origin, begin: reversed.from, motions: vec![reversed] };
        let arcs = path.arcs(deviation, vehicle);
        let end = reversed.end(origin);
        Self {
            motion,
            end: BodyFrame::new(end),
            turn: end.heading,
            arcs: arcs
                .legs()
                .map(|(at, s)| (BodyFrame::new(at), Sweep::new(footprint, s)))
                .collect(),
        }
    }

    /// Whether the reversed motion is free from `start` on.
    pub fn is_free(&self, start: &BodyFrame, collision: &CollisionWorld) -> bool {
        self.arcs.iter().all(|(at, sweep)| collision.sweep_is_free(&start.compose(at), sweep))
    }
}

/// The transitions between all primitives of a search.
#[derive(Debug)]
pub(super) struct Transitions {
    /// By primitive before and primitive after; `None` where the wheels need not turn while the car drives.
    between: Vec<Option<Transition>>,
    primitives: usize,
}

impl Transitions {
    pub fn new(
        turning: &Turning,
        primitives: &[Primitive],
        vehicle: &Vehicle,
        footprint: &Aabb,
    ) -> Self {
        let transition = |before: &Primitive, after: &Primitive| {
            let [a, b] = [before, after].map(|p| p.segment);
            let stands = a.gear() != b.gear() && turning.at_changes;
            let length = a.gear().sign() * (a.curvature - b.curvature).abs() / turning.sharpness;
            let motion = Clothoid { from: a.curvature, to: b.curvature, length };
            (!stands && length != 0.0)
                .then(|| Transition::new(motion, turning.deviation, vehicle, footprint))
        };
        let from = |before| primitives.iter().map(move |after| transition(before, after));
        let between = primitives.iter().flat_map(from).collect();
        Self { between, primitives: primitives.len() }
    }

    /// What is driven between two primitives, given by their index.
    pub fn between(&self, before: usize, after: usize) -> Option<&Transition> {
        self.between[before * self.primitives + after].as_ref()
    }
}
