//! The best-first search of Hybrid A*: open queue, node arena, expansion.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::curves::{Path, Segment};
use crate::geometry::{Aabb, Pose, wrap_angle};
use crate::vehicle::{Gear, Vehicle};
use crate::world::collision::Sweep;

use super::cost::{CostModel, DriveState};
use super::cost_to_go::CostToGo;
use super::hybrid_astar::{HybridAStarConfig, inscribed_radius};
use super::lattice::Lattice;
use super::nonholonomic::NonHolonomic;
use super::Problem;

/// Why the queue ran empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// The cost-to-go does not reach the start.
    Enclosed,
    /// Everything reachable was expanded.
    Exhausted,
}

/// Index of a node in the arena.
pub(super) type NodeIndex = u32;

/// No parent, or no primitive: the root.
const ROOT: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Node {
    pose: Pose,
    cost: f32,
    /// Heuristic cost-to-go.
    to_go: f32,
    parent: NodeIndex,
    primitive: u32,
}

/// An open node; ordered so that the heap pops the least f, then the earliest.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Open {
    f: f32,
    node: NodeIndex,
}

impl Eq for Open {}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        other.f.total_cmp(&self.f).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// A motion primitive: its sweep, and the cost of driving it.
#[derive(Clone, Debug)]
struct Primitive {
    sweep: Sweep,
    steer: f64,
}

/// One search at a time; buffers are reused between searches.
#[derive(Debug)]
pub(super) struct Search {
    nodes: Vec<Node>,
    open: BinaryHeap<Open>,
    lattice: Lattice,
    cost_to_go: CostToGo,
    nonholonomic: NonHolonomic,
    primitives: Vec<Primitive>,
    goal: Pose,
    weight: f32,
    enclosed: bool,
    /// Expansions since a curve was last tried.
    since_curve: u32,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            nodes: Vec::new(),
            open: BinaryHeap::new(),
            lattice: Lattice::default(),
            cost_to_go: CostToGo::default(),
            nonholonomic: NonHolonomic::new(),
            primitives: Vec::new(),
            goal: Pose::default(),
            weight: 1.0,
            enclosed: false,
            since_curve: 0,
        }
    }
}

impl Search {
    /// Starts a search from `start` to `goal` within `domain`.
    pub fn begin(
        &mut self,
        config: &HybridAStarConfig,
        problem: &Problem,
        domain: Aabb,
        start: Pose,
        goal: Pose,
    ) {
        let vehicle = &problem.vehicle;
        self.goal = goal;
        self.weight = config.heuristic_weight as f32;
        self.nodes.clear();
        self.open.clear();
        self.since_curve = 0;
        self.lattice.reset(&domain, config.cell, config.headings);
        self.nonholonomic.reset(vehicle);
        let radius = inscribed_radius(vehicle);
        let cell = config.cost_to_go_cell;
        self.cost_to_go.reset(&domain, cell, radius, &problem.obstacles, goal);
        self.prepare_primitives(config, vehicle, problem.collision.footprint());
        let to_go = self.heuristic(start, vehicle, &config.cost);
        self.enclosed = !to_go.is_finite();
        if self.enclosed {
            return;
        }
        if let Some(state) = self.lattice.state(start) {
            self.lattice.set_cost(state, 0.0);
        }
        self.push(Node { pose: start, cost: 0.0, to_go, parent: ROOT, primitive: ROOT });
    }

    fn prepare_primitives(
        &mut self,
        config: &HybridAStarConfig,
        vehicle: &Vehicle,
        footprint: &Aabb,
    ) {
        self.primitives.clear();
        let half = (config.steers / 2) as i32;
        for gear in [Gear::Forward, Gear::Backward] {
            for i in -half..=half {
                let steer = vehicle.max_steer * f64::from(i) / f64::from(half);
                let segment = Segment {
                    curvature: steer.tan() / vehicle.wheelbase,
                    length: gear.sign() * config.step,
                };
                self.primitives.push(Primitive { sweep: Sweep::new(footprint, segment), steer });
            }
        }
    }

    /// Takes the open node of least f that is still the best of its state.
    pub fn pop(&mut self) -> Option<NodeIndex> {
        while let Some(Open { node, .. }) = self.open.pop() {
            let n = self.nodes[node as usize];
            // A cheaper way to the same state was found after this one was queued.
            let stale = self.lattice.state(n.pose).is_some_and(|s| self.lattice.cost(s) < n.cost);
            if !stale {
                return Some(node);
            }
        }
        None
    }

    /// Why the queue is empty.
    pub fn stop(&self) -> Stop {
        if self.enclosed { Stop::Enclosed } else { Stop::Exhausted }
    }

    /// Whether a curve to the goal should be tried from `node`: rarely far from the goal,
    /// always close to it.
    pub fn wants_curve(&mut self, node: NodeIndex) -> bool {
        self.since_curve += 1;
        let wants = self.since_curve as f32 * 4.0 >= self.nodes[node as usize].to_go;
        if wants {
            self.since_curve = 0;
        }
        wants
    }

    /// The pose of `node`, and the gear and steering it was reached with.
    pub fn arrival(&self, node: NodeIndex) -> (Pose, DriveState) {
        let n = &self.nodes[node as usize];
        let state = self.primitives.get(n.primitive as usize).map_or(DriveState::PARKED, |p| {
            DriveState { gear: Some(p.sweep.segment().gear()), steer: p.steer }
        });
        (n.pose, state)
    }

    /// Generates the successors of `node`.
    pub fn expand(&mut self, node: NodeIndex, config: &HybridAStarConfig, problem: &Problem) {
        let parent = self.nodes[node as usize];
        let (_, state) = self.arrival(node);
        for i in 0..self.primitives.len() {
            let p = &self.primitives[i];
            let segment = p.sweep.segment();
            let end = segment.end(parent.pose);
            let end = Pose { heading: wrap_angle(end.heading), ..end };
            let (step_cost, _) = config.cost.segment(state, segment.length, p.steer);
            let cost = parent.cost + step_cost as f32;
            let Some(lattice_state) = self.lattice.state(end) else { continue };
            if cost >= self.lattice.cost(lattice_state)
                || !problem.collision.sweep_is_free(parent.pose, &p.sweep)
            {
                continue;
            }
            let to_go = self.heuristic(end, &problem.vehicle, &config.cost);
            if !to_go.is_finite() {
                continue;
            }
            self.lattice.set_cost(lattice_state, cost);
            self.push(Node { pose: end, cost, to_go, parent: node, primitive: i as u32 });
        }
    }

    fn push(&mut self, node: Node) {
        let index = self.nodes.len() as NodeIndex;
        self.nodes.push(node);
        self.open.push(Open { f: node.cost + self.weight * node.to_go, node: index });
    }

    /// The larger of the two cost-to-go heuristics.
    fn heuristic(&mut self, pose: Pose, vehicle: &Vehicle, model: &CostModel) -> f32 {
        let per_metre = model.forward.min(model.backward);
        let among_obstacles = self.cost_to_go.distance(pose.position()) * per_metre;
        if !among_obstacles.is_finite() {
            return f32::INFINITY;
        }
        let curve = self.nonholonomic.cost(self.goal.relative(pose), vehicle, model);
        among_obstacles.max(curve) as f32
    }

    /// The path from the root to `node`.
    pub fn path_to(&self, node: NodeIndex) -> Path {
        let mut segments = Vec::new();
        let mut n = &self.nodes[node as usize];
        while n.parent != ROOT {
            segments.push(self.primitives[n.primitive as usize].sweep.segment());
            n = &self.nodes[n.parent as usize];
        }
        segments.reverse();
        Path::new(n.pose, segments)
    }
}
