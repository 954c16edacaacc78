//! Who stands within a known manoeuvre, or beside one, goes on with its rest.

use std::f64::consts::TAU;

use super::{Library, Manoeuvre};
use crate::curves::{Path, Segment};
use crate::geometry::{Pose, signed_angle};
use crate::planners::cost::CostModel;
use crate::planners::{Problem, joint};
use crate::vehicle::Vehicle;

/// A car this near to a pose of a manoeuvre stands within it, metres: distance, and turn at full
/// lock. Poses are looked at so far apart along it. Both for the default vehicle.
pub(super) const BESIDE: f64 = 0.4;
const STRIDE: f64 = 0.25;
/// Newton's steps to the pose beside the start.
const STEPS_BESIDE: usize = 4;
/// The cheapest rests of manoeuvres that are looked at, and the free ones among them that are bent to begin
/// at the start.
const NEAR_RESTS: usize = 50;
const RESTS: usize = 3;

/// Where the manoeuvres of a library pass, seen from the goal.
#[derive(Clone, Debug)]
pub(super) struct Passages {
    /// In ascending order of boxes.
    passages: Vec<Passage>,
    boxes: Boxes,
}

/// A manoeuvre that passes through a box of poses.
#[derive(Clone, Copy, Debug)]
struct Passage {
    /// See [`Boxes::number`].
    number: u32,
    manoeuvre: u32,
    place: Place,
}

/// A pose along a manoeuvre. There are tens of thousands, and little is needed of each: single
/// precision will do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// The number of the motion.
    motion: u32,
    /// How much of it is driven, metres.
    driven: f32,
    x: f32,
    y: f32,
    heading: f32,
}

impl Place {
    /// Distance from a pose, and the turn to its heading at full lock, metres.
    fn apart(&self, pose: Pose, radius: f64) -> f64 {
        let [x, y] = [pose.x - f64::from(self.x), pose.y - f64::from(self.y)];
        let turn = signed_angle(f64::from(self.heading), pose.heading).abs();
        (x * x + y * y).sqrt() + turn * radius
    }
}

/// Boxes of poses: as large as what is near to a pose, so that this lies in its box and those around.
#[derive(Clone, Copy, Debug)]
struct Boxes {
    /// Metres.
    side: f64,
    /// Of a full turn.
    turns: i64,
}

impl Boxes {
    fn new(vehicle: &Vehicle) -> Self {
        let side = BESIDE * vehicle.scale();
        let turns = (TAU * vehicle.turning_radius() / side).floor().max(1.0) as i64;
        Self { side, turns: turns.min(1 << 8) }
    }

    fn of(&self, pose: Pose) -> [i64; 3] {
        let place = |v: f64| (v / self.side).floor() as i64;
        let turn = (pose.heading.rem_euclid(TAU) / TAU * self.turns as f64) as i64;
        [place(pose.x), place(pose.y), turn]
    }

    /// The number of a box. Boxes far away share some.
    fn number(&self, [x, y, turn]: [i64; 3]) -> u32 {
        let twelve = |v: i64| v as u32 & 0xfff;
        twelve(x) << 20 | twelve(y) << 8 | turn.rem_euclid(self.turns) as u32
    }
}

impl Passages {
    pub(super) fn new(manoeuvres: &[Manoeuvre], vehicle: &Vehicle) -> Self {
        let boxes = Boxes::new(vehicle);
        let mut driven_through = Vec::new();
        for (manoeuvre, passing) in (0..).zip(manoeuvres) {
            driven_through.extend(passing.poses(vehicle.scale()).map(|(motion, driven, at)| {
                let (number, driven) = (boxes.number(boxes.of(at)), driven as f32);
                let [x, y, heading] = [at.x, at.y, at.heading].map(|v| v as f32);
                let place = Place { motion: motion as u32, driven, x, y, heading };
                Passage { number, manoeuvre, place }
            }));
        }
        // By box, and in the order of manoeuvres and driving within each. One integer is sorted sooner
        // than all of a passage.
        let numbers = (0..).zip(&driven_through);
        let mut order: Vec<u64> =
            numbers.map(|(i, p): (u64, &Passage)| u64::from(p.number) << 32 | i).collect();
        order.sort_unstable();
        let passages = order.iter().map(|key| driven_through[*key as u32 as usize]).collect();
        Self { passages, boxes }
    }

    /// The manoeuvres that pass near a pose, in ascending order, each with how near it passes, and where.
    pub(super) fn near(&self, pose: Pose, vehicle: &Vehicle) -> Vec<(u32, f64, Place)> {
        let (nearest, radius) = (BESIDE * vehicle.scale(), vehicle.turning_radius());
        let [x, y, turn] = self.boxes.of(pose);
        let mut near = Vec::new();
        for beside in 0..27 {
            let (dx, dy, dt) = (beside / 9 - 1, beside / 3 % 3 - 1, beside % 3 - 1);
            let number = self.boxes.number([x + dx, y + dy, turn + dt]);
            let from = self.passages.partition_point(|p| p.number < number);
            for p in self.passages[from..].iter().take_while(|p| p.number == number) {
                let apart = p.place.apart(pose, radius);
                if apart < nearest {
                    near.push((p.manoeuvre, apart, p.place));
                }
            }
        }
        near.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        near.dedup_by_key(|(manoeuvre, ..)| *manoeuvre);
        near
    }
}

impl Manoeuvre {
    /// Poses along it: the number of the motion, how much of it is driven, and the pose.
    pub(super) fn poses(&self, scale: f64) -> impl Iterator<Item = (usize, f64, Pose)> {
        let motions = self.entry.rest.iter().zip(&self.begins).enumerate();
        motions.flat_map(move |(i, (motion, &begin))| {
            let steps = (motion.length.abs() / (STRIDE * scale)).ceil().max(1.0);
            (0..steps as usize).map(move |k| {
                let driven = motion.length * k as f64 / steps;
                (i, driven, motion.at(begin, driven))
            })
        })
    }

    /// What is left of it from beside `start`, near which it passes at `place`; poses are seen from
    /// the goal.
    fn rest(&self, place: Place, start: Pose) -> Path {
        let (motions, i) = (&self.entry.rest, place.motion as usize);
        let (length, sign) = (motions[i].length.abs(), motions[i].gear().sign());
        let mut driven = f64::from(place.driven);
        let mut at = motions[i].at(self.begins[i], driven);
        // Right beside the start rather than a stride away: nothing is to be bent for who stands on it.
        for _ in 0..STEPS_BESIDE {
            let ahead = at.point_to_local(start.position()).x * sign;
            driven = (driven.abs() + ahead).clamp(0.0, length) * sign;
            at = motions[i].at(self.begins[i], driven);
        }
        let first = Segment { length: motions[i].length - driven, ..motions[i] };
        Path::new(at, std::iter::once(first).chain(motions[i + 1..].iter().copied()))
    }
}

impl Library {
    /// The plan of a car that stands within a manoeuvre, or beside one: its rest, bent to begin at
    /// the start. The cheapest of those that are free and cost less than `bound`; `None` where the car
    /// stands within none.
    pub fn rest(&self, problem: &Problem, model: &CostModel, bound: f64) -> Option<(Path, f64)> {
        let passages = self.passages.get_or_init(|| Passages::new(&self.manoeuvres, &self.vehicle));
        let start = problem.goal.relative(problem.start);
        let mut near = passages.near(start, &self.vehicle);
        let cost = |path: &Path| model.path(&self.vehicle, &path.segments);
        let rest = |(i, _, place): &(u32, f64, Place)| {
            let path = self.manoeuvres[*i as usize].rest(*place, start);
            (cost(&path), path)
        };
        let mut cheapest: Vec<(f64, Path)> =
            near.iter().map(rest).filter(|(cost, _)| *cost < bound).collect();
        cheapest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let bent = |(_, rest): (f64, Path)| {
            let path = joint::close(problem, &rest)?;
            let cost = cost(&path);
            (cost < bound).then_some((path, cost))
        };
        let first_bent = |rests: &mut dyn Iterator<Item = (f64, Path)>| {
            let here = |(cost, rest): (f64, Path)| {
                (cost, Path { start: problem.goal.compose(rest.start), ..rest })
            };
            let free = |(_, rest): &(f64, Path)| problem.collision.path_is_free(rest);
            rests.map(here).filter(free).take(RESTS).find_map(bent)
        };
        // In order of cost, which bending hardly changes. Many may pass here: who stands upon one of them
        // goes on, whatever the others cost.
        first_bent(&mut cheapest.into_iter().take(NEAR_RESTS)).or_else(|| {
            near.sort_by(|a, b| a.1.total_cmp(&b.1));
            first_bent(&mut near.iter().take(RESTS).map(rest).filter(|(cost, _)| *cost < bound))
        })
    }
}
