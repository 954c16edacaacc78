//! Cutting the corners of a path: curves between its poses, and poses beside it.
//!
//! A search or a library returns a path through poses of its own choosing. Here the poses along
//! that path, and where it is nearer to obstacles than is comfortable some beside it, are nodes
//! in the order of driving. The cheapest chain of free Reeds-Shepp curves through them, with the
//! path's own pieces as the ways already known, is found by dynamic programming. Nothing gets
//! worse, and the work is bounded by the number of nodes.

use crate::curves::{Path, Segment};
use crate::geometry::{Pose, Vec2};
use crate::vehicle::Vehicle;

use super::Problem;
use super::analytic::AnalyticExpansion;
use super::cost::{CostModel, DriveState};
use super::nearness::Nearness;
use super::nonholonomic::NonHolonomic;

/// Nodes along the path, about.
const ALONG: f64 = 10.0;
/// Nodes beside it, at most.
const BESIDE: usize = 24;
/// Gains below this share of the cost are not worth a curve.
const GAIN: f64 = 0.01;
/// What an estimate of a curve's cost may be too high by: a share, and metres for its coarse steps.
const ESTIMATE: f64 = 0.95;
const SLACK: f64 = 0.3;
/// Times the corners are cut.
const ROUNDS: usize = 2;

/// Cuts corners; buffers are reused.
#[derive(Debug, Default)]
pub(super) struct Shortcuts {
    analytic: AnalyticExpansion,
    nodes: Vec<Node>,
}

/// A pose that the path may lead through, and the cheapest way there so far.
#[derive(Clone, Debug)]
struct Node {
    pose: Pose,
    /// Along the path, metres: nodes are ordered by it.
    at: f64,
    /// Cost from the start; infinite beside the path, where no way is known yet.
    cost: f64,
    arrival: DriveState,
    /// The node before, and the motions from there.
    from: Option<(usize, Vec<Segment>)>,
}

impl Shortcuts {
    /// `path` or a cheaper one to the same goal, and its cost with nearness. `estimates` are those
    /// of `model`.
    pub fn cut(
        &mut self,
        problem: &Problem,
        model: &CostModel,
        estimates: &mut NonHolonomic,
        path: Path,
    ) -> (Path, f64) {
        let nearness = Nearness::new(problem, model);
        let whole =
            |path: &Path| model.path(&problem.vehicle, &path.segments) + nearness.of_path(path);
        let mut best = (whole(&path), path);
        for _ in 0..ROUNDS {
            let shorter = self.round(problem, model, estimates, &nearness, &best.1);
            let cost = whole(&shorter);
            if cost >= best.0 * (1.0 - GAIN / 2.0) || !problem.collision.path_is_free(&shorter) {
                break;
            }
            best = (cost, shorter);
        }
        (best.1, best.0)
    }

    fn round(
        &mut self,
        problem: &Problem,
        model: &CostModel,
        estimates: &mut NonHolonomic,
        nearness: &Nearness,
        path: &Path,
    ) -> Path {
        let vehicle = &problem.vehicle;
        self.place_nodes(problem, model, nearness, path);
        let last = self.nodes.len() - 1;
        let least = GAIN * self.nodes[last].cost;
        let slack = SLACK * vehicle.scale();
        for to in 1..=last {
            for from in 0..to {
                let before = &self.nodes[from];
                let room = self.nodes[to].cost - before.cost - least;
                let target = self.nodes[to].pose;
                if room <= 0.0 || before.pose.distance(target) >= room {
                    continue;
                }
                let seen = before.pose.relative(target);
                if estimates.cost(seen, vehicle, model) * ESTIMATE - slack >= room {
                    continue;
                }
                let (pose, state) = (before.pose, before.arrival);
                let curve = self.analytic.curve_after(
                    state,
                    pose,
                    target,
                    DriveState::PARKED,
                    room,
                    problem,
                    model,
                );
                if let Some((word, cost)) = curve {
                    self.offer(to, from, word.segments().to_vec(), cost, nearness, vehicle);
                }
            }
        }
        self.chain(path.start)
    }

    /// Takes a way to node `to`, if it is the cheapest one with nearness.
    fn offer(
        &mut self,
        to: usize,
        from: usize,
        way: Vec<Segment>,
        cost: f64,
        nearness: &Nearness,
        vehicle: &Vehicle,
    ) {
        let before = &self.nodes[from];
        let total = before.cost + cost + nearness.of_motions(before.pose, &way);
        if total < self.nodes[to].cost {
            let arrival = state_after(way.last(), before.arrival, vehicle);
            let node = &mut self.nodes[to];
            (node.cost, node.arrival, node.from) = (total, arrival, Some((from, way)));
        }
    }

    /// The way to the last node.
    fn chain(&self, start: Pose) -> Path {
        let mut ways = Vec::new();
        let mut node = self.nodes.last();
        while let Some((from, way)) = node.and_then(|n| n.from.as_ref()) {
            ways.push(way);
            node = self.nodes.get(*from);
        }
        Path::new(start, ways.into_iter().rev().flatten().copied())
    }

    /// Nodes at the borders of the path's segments and along them, with the path's own way to each;
    /// where the way there is near something, free poses beside it.
    fn place_nodes(
        &mut self,
        problem: &Problem,
        model: &CostModel,
        nearness: &Nearness,
        path: &Path,
    ) {
        let vehicle = &problem.vehicle;
        let spacing = (path.length() / ALONG).max(0.4 * vehicle.turning_radius());
        self.nodes.clear();
        let (mut state, mut cost, mut at) = (DriveState::PARKED, 0.0, 0.0);
        let start = Node { pose: path.start, at, cost, arrival: state, from: None };
        self.nodes.push(start);
        let mut beside = Vec::new();
        for (from, s) in path.legs() {
            let pieces = (s.length.abs() / spacing).ceil().max(1.0);
            let piece = Segment { length: s.length / pieces, ..s };
            for i in 0..pieces as usize {
                let begin = s.at(from, piece.length * i as f64);
                let pose = piece.end(begin);
                let (driven, after) =
                    model.segment(state, piece.length, vehicle.steer(s.curvature));
                let near = nearness.of_motion(begin, piece);
                let middle = at + piece.length.abs() / 2.0;
                let middle_pose = piece.at(begin, piece.length / 2.0);
                if near > 0.0 && beside.len() < BESIDE && nearness.is_on_the_way(middle_pose) {
                    for side in [-2.0, -1.0, 1.0, 2.0] {
                        let across = Vec2::new(0.0, side * nearness.distance());
                        let p = middle_pose.point_to_parent(across);
                        let pose = Pose::new(p.x, p.y, middle_pose.heading);
                        if problem.collision.pose_is_free(pose) {
                            beside.push((middle, pose));
                        }
                    }
                }
                cost += driven + near;
                at += piece.length.abs();
                state = after;
                let from = Some((self.nodes.len() - 1, vec![piece]));
                self.nodes.push(Node { pose, at, cost, arrival: state, from });
            }
        }
        self.insert(beside);
    }

    /// Inserts poses beside the path in their places; what leads to nodes is renumbered.
    fn insert(&mut self, beside: Vec<(f64, Pose)>) {
        if beside.is_empty() {
            return;
        }
        let along = std::mem::take(&mut self.nodes);
        let mut beside = beside.into_iter().peekable();
        let mut numbers = Vec::with_capacity(along.len());
        for mut node in along {
            while let Some((at, pose)) = beside.next_if(|(at, _)| *at < node.at) {
                let (cost, arrival) = (f64::INFINITY, DriveState::PARKED);
                self.nodes.push(Node { pose, at, cost, arrival, from: None });
            }
            if let Some((from, _)) = &mut node.from {
                *from = numbers[*from];
            }
            numbers.push(self.nodes.len());
            self.nodes.push(node);
        }
    }
}

/// Gear and steering after the last motion of a way.
fn state_after(last: Option<&Segment>, before: DriveState, vehicle: &Vehicle) -> DriveState {
    last.map_or(before, |s| DriveState { gear: Some(s.gear()), steer: vehicle.steer(s.curvature) })
}
