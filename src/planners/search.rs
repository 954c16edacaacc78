//! The best-first search of Hybrid A*: node arena and expansion.
//!
//! The search runs *from the goal*: driving is reversible, and near the goal space is
//! tight. A node's motion leads forward in time from the node to its parent, so that the
//! way from a node to the goal is read off by walking up to the root. What is estimated is
//! the cost from the start to the node.

use crate::curves::{Clothoid, Segment};
use crate::geometry::{Aabb, Pose, wrap_angle};
use crate::vehicle::{Gear, Vehicle};
use crate::world::collision::{BodyFrame, Sweep};

use super::analytic::GoalSet;
use super::config::{Attempt, HybridAStarConfig, Resolution};
use super::cost::{CostModel, DriveState};
use super::cost_to_go::CostToGo;
use super::fitting_cost_to_go::FittingCostToGo;
use super::lattice::Lattice;
use super::multi_heuristic::Guides;
use super::nonholonomic::NonHolonomic;
pub(super) use super::open::NodeIndex;
use super::open::OpenList;
use super::transitions::{Transitions, Turning};
use super::{NoPath, Problem};

/// In place of a primitive: the node is a root.
const ROOT: u32 = u32::MAX;
/// How many times as much a careful search makes of its estimates.
const CAREFUL: f32 = 1.25;

#[derive(Clone, Copy, Debug)]
struct Node {
    pose: Pose,
    /// Cost from here to the goal.
    cost: f32,
    /// Estimated cost from the start to here.
    to_come: f32,
    /// The node that `primitive` leads to; for a root the index of its goal-set entry.
    parent: NodeIndex,
    /// Index of the motion; `ROOT` for a root.
    primitive: u32,
}

/// A motion primitive.
#[derive(Clone, Debug)]
pub(super) struct Primitive {
    /// The motion, forward in time.
    pub segment: Segment,
    /// What the reversed motion sweeps.
    sweep: Sweep,
    /// Where the reversed motion ends, seen from where it begins.
    end: Pose,
    /// Its steering angle, radians.
    steer: f64,
}

/// One search at a time; buffers are reused between searches.
#[derive(Debug, Default)]
pub(super) struct Search {
    nodes: Vec<Node>,
    open: OpenList,
    lattice: Lattice,
    cost_to_go: CostToGo,
    /// What a careful search follows in its place.
    fitting: FittingCostToGo,
    careful: bool,
    nonholonomic: NonHolonomic,
    primitives: Vec<Primitive>,
    start: Pose,
    weight: f32,
    /// What orders the other queues; `None` for a single queue.
    guides: Option<Guides>,
    /// How the wheels turn between motions; `None` where the steering angle may jump.
    turning: Option<Turning>,
    transitions: Option<Transitions>,
    enclosed: bool,
    /// Expansions since a curve was last tried.
    since_curve: u32,
    /// A curve is tried once in so much estimated cost, which falls due with every expansion.
    per_curve: f32,
}

/// What the estimate of the cost from the start to a pose is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    /// Among the obstacles, turning on the spot: the A* cost-to-go, or that of a careful search.
    pub grid: f32,
    /// With the vehicle's turning circle, without obstacles: the least Reeds-Shepp cost.
    pub curve: f32,
}

impl Estimate {
    /// The larger of the two estimates; infinite where the start cannot be reached.
    pub fn cost(self) -> f32 {
        self.grid.max(self.curve)
    }
}

impl Search {
    /// A search with one more queue for each estimate of `guides`.
    pub fn guided(guides: Guides) -> Self {
        let open = OpenList::with_others(Guides::COUNT, guides.slack());
        Self { open, guides: Some(guides), ..Self::default() }
    }

    /// A search whose steering angle does not jump.
    pub fn steered(turning: Turning) -> Self {
        Self { turning: Some(turning), ..Self::default() }
    }

    /// Starts a search from `goal` to `start`.
    pub fn begin(&mut self, attempt: Attempt, problem: &Problem, start: Pose, goal: &GoalSet) {
        let Attempt { config, resolution, domain, careful, .. } = attempt;
        let vehicle = &problem.vehicle;
        self.start = start;
        self.per_curve = 4.0 * vehicle.scale() as f32;
        if let Some(guides) = &mut self.guides {
            guides.reset(problem);
        }
        self.careful = careful;
        // A careful search has lost its way once: it follows its estimates more greedily.
        self.weight = config.heuristic_weight as f32 * if careful { CAREFUL } else { 1.0 };
        self.nodes.clear();
        self.open.clear();
        self.since_curve = 0;
        self.lattice.reset(&domain, resolution.cell, resolution.headings);
        self.nonholonomic.reset(vehicle, &config.cost);
        let cell = config.cost_to_go_cell;
        self.cost_to_go.reset(&domain, cell, vehicle, start.position());
        if careful {
            self.fitting.reset(&domain, cell, vehicle, start);
        }
        self.prepare_primitives(resolution, vehicle, problem.collision.footprint());
        let distance = self.cost_to_go.distance(goal.pose.position(), &problem.collision);
        self.enclosed = !distance.is_finite();
        if self.enclosed {
            return;
        }
        for (i, entry) in goal.entries().iter().enumerate() {
            let pose = Pose { heading: wrap_angle(entry.pose.heading), ..entry.pose };
            let estimate = self.estimate_to_come(pose, problem, &config.cost);
            let to_come = estimate.cost();
            let Some(state) = self.lattice.state(pose) else { continue };
            let cost = entry.cost() as f32;
            if to_come.is_finite() && cost < self.lattice.cost(state) {
                self.lattice.set_cost(state, cost);
                let parent = i as NodeIndex;
                self.push(Node { pose, cost, to_come, parent, primitive: ROOT }, estimate);
            }
        }
    }

    fn prepare_primitives(&mut self, resolution: &Resolution, vehicle: &Vehicle, footprint: &Aabb) {
        self.primitives.clear();
        let half = (resolution.steers / 2) as i32;
        for gear in [Gear::Forward, Gear::Backward] {
            for i in -half..=half {
                let steer = vehicle.max_steer * f64::from(i) / f64::from(half);
                let segment = Segment {
                    curvature: steer.tan() / vehicle.wheelbase,
                    length: gear.sign() * resolution.step,
                };
                // Swept in reverse: from the node it leads to.
                let sweep = Sweep::new(footprint, segment.reversed());
                let end = segment.reversed().end(Pose::default());
                self.primitives.push(Primitive { segment, sweep, end, steer });
            }
        }
        let transitions = |turning| Transitions::new(turning, &self.primitives, vehicle, footprint);
        self.transitions = self.turning.as_ref().map(transitions);
    }

    /// Estimates of curves for `vehicle` and the cost `model`.
    pub fn curve_estimates(&mut self, vehicle: &Vehicle, model: &CostModel) -> &mut NonHolonomic {
        self.nonholonomic.reset(vehicle, model);
        &mut self.nonholonomic
    }

    /// Takes the open node of least f that is still the best of its state.
    pub fn pop(&mut self) -> Option<NodeIndex> {
        let Self { nodes, lattice, open, .. } = self;
        open.pop(|node| {
            // A cheaper way to the same state was found after this one was queued.
            let n = nodes[node as usize];
            lattice.state(n.pose).is_some_and(|s| lattice.cost(s) < n.cost)
        })
    }

    /// Why the queue is empty.
    pub fn stop(&self) -> NoPath {
        if self.enclosed { NoPath::Enclosed } else { NoPath::Exhausted }
    }

    /// Whether a curve from the start to `node` should be tried: rarely far from the start,
    /// always close to it.
    pub fn wants_curve(&mut self, node: NodeIndex) -> bool {
        self.since_curve += 1;
        let wants = self.since_curve as f32 * self.per_curve >= self.nodes[node as usize].to_come;
        if wants {
            self.since_curve = 0;
        }
        wants
    }

    /// Cost from `node` to the goal.
    pub fn cost(&self, node: NodeIndex) -> f64 {
        f64::from(self.nodes[node as usize].cost)
    }

    /// Estimated cost of a whole path through `node`.
    pub fn estimate(&self, node: NodeIndex) -> f64 {
        let n = &self.nodes[node as usize];
        f64::from(n.cost + n.to_come)
    }

    /// Where the path is to start.
    pub fn start(&self) -> Pose {
        self.start
    }

    /// The pose of `node`.
    pub fn pose(&self, node: NodeIndex) -> Pose {
        self.nodes[node as usize].pose
    }

    /// The gear and steering with which the way from `node` to the goal begins.
    pub fn departure(&self, node: NodeIndex, goal: &GoalSet) -> DriveState {
        let n = &self.nodes[node as usize];
        match self.primitives.get(n.primitive as usize) {
            Some(p) => DriveState { gear: Some(p.segment.gear()), steer: p.steer },
            None => goal.entries()[n.parent as usize].departure(),
        }
    }

    /// The primitive with which the way from `node` to the goal begins; for a root the straight into the goal,
    /// if it has one.
    fn next(&self, node: NodeIndex, goal: &GoalSet) -> Option<usize> {
        let n = &self.nodes[node as usize];
        if n.primitive != ROOT {
            return Some(n.primitive as usize);
        }
        let departure = goal.entries()[n.parent as usize].departure();
        let same =
            |p: &Primitive| Some(p.segment.gear()) == departure.gear && p.segment.curvature == 0.0;
        self.primitives.iter().position(same)
    }

    /// Generates the predecessors of `node`.
    pub fn expand(
        &mut self,
        node: NodeIndex,
        goal: &GoalSet,
        config: &HybridAStarConfig,
        problem: &Problem,
    ) {
        let parent = self.nodes[node as usize];
        let state = self.departure(node, goal);
        let node_frame = BodyFrame::new(parent.pose);
        let next = if self.turning.is_some() { self.next(node, goal) } else { None };
        for i in 0..self.primitives.len() {
            let p = &self.primitives[i];
            let (mut frame, mut turn, mut length) = (node_frame, p.end.heading, p.segment.length);
            let transition = self.transitions.as_ref().and_then(|t| t.between(i, next?));
            if let Some(t) = transition {
                frame = node_frame.compose(&t.end);
                turn += t.turn;
                length += t.motion.length;
            }
            let position = frame.parent(p.end.position());
            let heading = wrap_angle(parent.pose.heading + turn);
            let pose = Pose::new(position.x, position.y, heading);
            // Costs of changes are symmetric: the state after may stand for the one before.
            let (step_cost, _) = config.cost.segment(state, length, p.steer);
            let cost = parent.cost + step_cost as f32;
            let Some(lattice_state) = self.lattice.state(pose) else { continue };
            let collision = &problem.collision;
            if cost >= self.lattice.cost(lattice_state)
                || transition.is_some_and(|t| !t.is_free(&node_frame, collision))
                || !collision.sweep_is_free(&frame, &self.primitives[i].sweep)
            {
                continue;
            }
            let estimate = self.estimate_to_come(pose, problem, &config.cost);
            let to_come = estimate.cost();
            if !to_come.is_finite() {
                continue;
            }
            self.lattice.set_cost(lattice_state, cost);
            self.push(Node { pose, cost, to_come, parent: node, primitive: i as u32 }, estimate);
        }
    }

    fn push(&mut self, node: Node, estimate: Estimate) {
        let index = self.nodes.len() as NodeIndex;
        self.nodes.push(node);
        let anchor = node.cost + self.weight * node.to_come;
        match &self.guides {
            None => self.open.push(index, anchor, &[]),
            Some(guides) => {
                let others =
                    guides.estimates(estimate, node.pose).map(|to_come| node.cost + to_come);
                self.open.push(index, anchor, &others);
            }
        }
    }

    /// Estimates the cost from the start to `pose`.
    fn estimate_to_come(&mut self, pose: Pose, problem: &Problem, model: &CostModel) -> Estimate {
        let per_metre = model.forward.min(model.backward);
        let Self { cost_to_go, fitting, .. } = self;
        let distance = if self.careful {
            fitting.distance(pose, cost_to_go, &problem.collision)
        } else {
            cost_to_go.distance(pose.position(), &problem.collision)
        };
        let grid = distance * per_metre;
        if !grid.is_finite() {
            return Estimate { grid: f32::INFINITY, curve: 0.0 };
        }
        let curve = self.nonholonomic.cost(self.start.relative(pose), &problem.vehicle, model);
        Estimate { grid: grid as f32, curve: curve as f32 }
    }

    /// The motions from `node` to the goal, in driving order, and the root's goal-set entry.
    pub fn way(&self, node: NodeIndex) -> (Vec<Segment>, usize) {
        let mut segments = Vec::new();
        let mut n = &self.nodes[node as usize];
        while n.primitive != ROOT {
            segments.push(self.primitives[n.primitive as usize].segment);
            n = &self.nodes[n.parent as usize];
        }
        (segments, n.parent as usize)
    }

    /// The motions from `node` to the goal with the transitions between them, in driving order.
    pub fn continuous_way(&self, node: NodeIndex, goal: &GoalSet) -> Vec<Clothoid> {
        let mut motions: Vec<Clothoid> = Vec::new();
        let mut n = &self.nodes[node as usize];
        while n.primitive != ROOT {
            let primitive = n.primitive as usize;
            motions.push(self.primitives[primitive].segment.into());
            let next = self.next(n.parent, goal);
            let transition = self.transitions.as_ref().and_then(|t| t.between(primitive, next?));
            motions.extend(transition.map(|t| t.motion));
            n = &self.nodes[n.parent as usize];
        }
        motions.extend(goal.entries()[n.parent as usize].rest.iter().map(|&s| Clothoid::from(s)));
        motions
    }
}
