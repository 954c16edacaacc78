//! Ways out of a parallel spot, however tight: to and fro, each motion as far as there is room.
//!
//! The alternating full-lock arcs of [`exit_manoeuvre`](super::exit_manoeuvre) turn the car but do not shift
//! it, and end at the kerb where a spot is tight. Here straights and arcs of the other lock may stand between
//! them. All sequences of motions at full lock or straight, each until it would touch, are tried, those of
//! fewest changes of gear first; where none leads out, motions half as long, too. What such motions lead to
//! within a tight spot is little: some dozens of poses that differ, some hundreds with the halves. A lattice
//! fine enough for such spots has hundreds of thousands.

use std::collections::{BTreeSet, VecDeque};

use crate::curves::Segment;
use crate::geometry::Pose;
use crate::vehicle::Gear;

use super::Problem;
use super::exit_manoeuvre::{Exit, Manoeuvre, STEEPEST};

/// First the car goes as far as it may; where that does not lead out, half as far, too. For each, the shares of
/// that length, and how many poses from which it may go on there are at most.
const ROUNDS: [(&[f64], usize); 2] = [(&[1.0], 400), (&[1.0, 0.5], 2_000)];
/// Poses count as the same within so many vehicle lengths and radians.
const SAME: f64 = 0.008;
const SAME_TURN: f64 = 0.025;
/// Motions shorter than this lead nowhere, vehicle lengths; none is longer than the others.
const SHORTEST: f64 = 0.004;
const LONGEST: f64 = 1.0;
/// Shares of a motion that leads out after which it may end.
const OUT: [f64; 3] = [1.0, 0.7, 0.4];
/// Poses within the spot, at most.
const WITHIN: usize = 30;

/// Exits from the goal of `problem`, which lies in a parallel spot; where none is found, poses within the spot
/// that are turned the farthest. Every way in is free.
pub(crate) fn exits(problem: &Problem) -> Vec<Exit> {
    let mut within = Vec::new();
    for (shares, most) in ROUNDS {
        let (exits, poses) = round(problem, shares, most);
        if !exits.is_empty() {
            return exits;
        }
        within = poses.turned_the_farthest();
    }
    within
}

/// The exits, and what was tried.
fn round<'a>(problem: &'a Problem, shares: &[f64], most: usize) -> (Vec<Exit>, Poses<'a>) {
    let mut poses = Poses { problem, all: Vec::new(), seen: BTreeSet::new() };
    poses.add(Place { pose: problem.goal, by: None, motions: 0 });
    let (mut exits, mut fewest) = (Vec::new(), None);
    let mut waiting = VecDeque::from([0]);
    while let Some(number) = waiting.pop_front() {
        let place = poses.all[number];
        if fewest.is_some_and(|fewest| place.motions > fewest) {
            break;
        }
        let here = poses.manoeuvre_to(number);
        let before = exits.len();
        if place.gear() != Some(Gear::Forward) {
            here.leave_if_free(&mut exits);
        }
        if poses.all.len() < most {
            poses.go_on(number, &here, shares, &mut waiting, &mut exits);
        }
        if exits.len() > before {
            fewest = fewest.or(Some(place.motions));
        }
    }
    (exits, poses)
}

/// A pose within the spot, and how the car comes there.
#[derive(Clone, Copy, Debug)]
struct Place {
    pose: Pose,
    /// The number of the place before, and the motion from there.
    by: Option<(usize, Segment)>,
    motions: usize,
}

impl Place {
    fn gear(&self) -> Option<Gear> {
        self.by.map(|(_, motion)| motion.gear())
    }
}

struct Poses<'a> {
    problem: &'a Problem,
    all: Vec<Place>,
    /// Rounded poses with the gear they are reached in.
    seen: BTreeSet<(i64, i64, i64, bool)>,
}

impl<'a> Poses<'a> {
    /// Adds a place that is not yet known; its number.
    fn add(&mut self, place: Place) -> Option<usize> {
        let Pose { x, y, heading } = place.pose;
        let same = SAME * self.problem.vehicle.length;
        let rounded = |v: f64, step: f64| (v / step).round() as i64;
        let forward = place.gear() == Some(Gear::Forward);
        let key = (rounded(x, same), rounded(y, same), rounded(heading, SAME_TURN), forward);
        self.seen.insert(key).then(|| {
            self.all.push(place);
            self.all.len() - 1
        })
    }

    /// Adds where the motions from a place lead, and exits where they lead out.
    fn go_on(
        &mut self,
        number: usize,
        here: &Manoeuvre,
        shares: &[f64],
        waiting: &mut VecDeque<usize>,
        exits: &mut Vec<Exit>,
    ) {
        let (place, vehicle) = (self.all[number], &self.problem.vehicle);
        let (lock, longest) = (vehicle.max_curvature(), LONGEST * vehicle.length);
        let beside = |pose: Pose| pose.y - self.problem.goal.y >= vehicle.width / 2.0;
        let mut found = Vec::new();
        for gear in [Gear::Forward, Gear::Backward] {
            if place.gear() == Some(gear) {
                continue;
            }
            for curvature in [lock, 0.0, -lock] {
                let whole = here.longest(curvature, gear, longest);
                let part = |share: &f64| Segment { length: share * whole.length, ..whole };
                if whole.length.abs() >= longest && beside(whole.end(place.pose)) {
                    exits.extend(OUT.iter().map(|share| here.exit(&[part(share)])));
                    continue;
                }
                found.extend(shares.iter().map(part));
            }
        }
        for motion in found {
            let pose = motion.end(place.pose);
            let is_short = motion.length.abs() < SHORTEST * vehicle.length;
            if pose.heading.abs() < STEEPEST && !is_short {
                let (by, motions) = (Some((number, motion)), place.motions + 1);
                waiting.extend(self.add(Place { pose, by, motions }));
            }
        }
    }

    /// Where the car is turned the farthest.
    fn turned_the_farthest(&self) -> Vec<Exit> {
        let mut numbers: Vec<usize> = (0..self.all.len()).collect();
        let heading = |number: usize| self.all[number].pose.heading;
        numbers.sort_by(|&a, &b| heading(b).total_cmp(&heading(a)));
        numbers.iter().take(WITHIN).map(|&number| self.manoeuvre_to(number).exit(&[])).collect()
    }

    /// The motions that lead to a place.
    fn manoeuvre_to(&self, number: usize) -> Manoeuvre<'a> {
        let before = |motion: &(usize, Segment)| self.all[motion.0].by;
        let way = std::iter::successors(self.all[number].by, before);
        let mut driven: Vec<Segment> = way.map(|(_, motion)| motion).collect();
        driven.reverse();
        Manoeuvre { problem: self.problem, pose: self.all[number].pose, driven }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::Path;
    use crate::vehicle::Vehicle;
    use crate::world::generate::{GeneratorConfig, LevelConfig, generate};
    use crate::world::{Level, ParkingType};

    /// Scenes whose spot is so much longer than the car.
    fn scenes(room: f64) -> impl Iterator<Item = Problem> {
        let vehicle = Vehicle::default();
        let usual = GeneratorConfig::default();
        let width = vehicle.length + room;
        let complex = LevelConfig { parallel_spot_width: [width; 2], ..usual.complex };
        let config = GeneratorConfig { complex, ..usual };
        (0..15).map(move |i| {
            let scene = generate(&config, &vehicle, ParkingType::Parallel, Level::Complex, 5, i);
            Problem::new(&scene).unwrap()
        })
    }

    #[test]
    fn every_spot_is_left_and_every_way_in_is_free() {
        for room in [0.63, 0.8, 1.2, 2.0] {
            for problem in scenes(room) {
                let (vehicle, exits) = (&problem.vehicle, exits(&problem));
                let is_out = |e: &Exit| e.pose.y - problem.goal.y >= vehicle.width / 2.0;
                assert!(exits.iter().any(is_out), "{room}: {exits:?}");
                for Exit { pose, way_in } in exits {
                    let path = Path::new(pose, way_in);
                    assert!(problem.collision.path_is_free(&path), "{room}: {pose:?}");
                    assert!(path.end().distance(problem.goal) < 1e-9, "{room}: {pose:?}");
                    assert!((path.end().heading - problem.goal.heading).abs() < 1e-9);
                    assert!(path.max_abs_curvature() <= vehicle.max_curvature() + 1e-12);
                }
            }
        }
    }

    /// Where a car cannot turn at all there are poses within the spot, and the work is bounded.
    #[test]
    fn who_cannot_leave_is_told_where_it_may_stand() {
        for problem in scenes(0.12) {
            let exits = exits(&problem);
            assert!(!exits.is_empty() && exits.len() <= WITHIN);
            assert!(exits.iter().all(|e| e.pose.y - problem.goal.y < problem.vehicle.width / 2.0));
        }
    }
}
