//! The open nodes of a search, least f first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Index of a node in the arena.
pub(super) type NodeIndex = u32;

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

type Queue = BinaryHeap<Open>;

/// The open nodes of a search: one queue, the *anchor*, or besides it any number of others
/// that order the same nodes differently (see `multi_heuristic.rs`).
#[derive(Debug, Default)]
pub(super) struct OpenList {
    anchor: Queue,
    others: Vec<Queue>,
    /// How far beyond the anchor's least priority the others may go: a factor.
    slack: f32,
    /// Whose turn it was last, among the others.
    turn: usize,
    /// By node: whether some queue gave it out already. Only kept where there are others.
    taken: Vec<bool>,
}

impl OpenList {
    /// A list with `others` queues besides the anchor; see [`OpenList::pop`] for `slack`.
    pub fn with_others(others: usize, slack: f32) -> Self {
        let others = (0..others).map(|_| Queue::new()).collect();
        Self { others, slack, ..Self::default() }
    }

    /// Forgets all nodes.
    pub fn clear(&mut self) {
        self.anchor.clear();
        self.others.iter_mut().for_each(Queue::clear);
        self.taken.clear();
        self.turn = 0;
    }

    /// Adds the next node (nodes come in the order of their indices) with its priority in
    /// the anchor and in each other queue.
    pub fn push(&mut self, node: NodeIndex, anchor: f32, others: &[f32]) {
        self.anchor.push(Open { f: anchor, node });
        if !self.others.is_empty() {
            debug_assert_eq!(node as usize, self.taken.len());
            self.taken.push(false);
            self.others.iter_mut().zip(others).for_each(|(q, &f)| q.push(Open { f, node }));
        }
    }

    /// Takes a node that is not `stale`; stale ones are dropped.
    ///
    /// The other queues have their turns one after another, and each gives its first node as
    /// long as that node's priority there is at most `slack` times the least of the anchor.
    /// Otherwise, and where there are no others, the anchor gives its first.
    pub fn pop(&mut self, mut stale: impl FnMut(NodeIndex) -> bool) -> Option<NodeIndex> {
        let Self { anchor, others, taken, .. } = self;
        if others.is_empty() {
            return std::iter::from_fn(|| anchor.pop()).map(|o| o.node).find(|&n| !stale(n));
        }
        let mut first = |queue: &mut Queue| {
            while let Some(&open) = queue.peek() {
                if !taken[open.node as usize] && !stale(open.node) {
                    return Some(open);
                }
                queue.pop();
            }
            None
        };
        let least = first(anchor)?;
        self.turn = (self.turn + 1) % others.len();
        let open = first(&mut others[self.turn])
            .filter(|open| open.f <= self.slack * least.f)
            .unwrap_or(least);
        taken[open.node as usize] = true;
        Some(open.node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes 0, 1, … with their priorities in the anchor and one other queue, as they leave.
    fn order(slack: f32, priorities: &[(f32, f32)]) -> Vec<NodeIndex> {
        let mut list = OpenList::with_others(1, slack);
        for (node, &(anchor, other)) in priorities.iter().enumerate() {
            list.push(node as NodeIndex, anchor, &[other]);
        }
        std::iter::from_fn(|| list.pop(|_| false)).collect()
    }

    #[test]
    fn the_anchor_holds_the_others_back() {
        let nodes = [(4.0, 9.0), (5.0, 7.0), (6.0, 6.0)];
        // Within the slack the other queue decides; beyond it the anchor does, until the
        // least of what is left has risen far enough.
        assert_eq!(order(2.0, &nodes), [2, 1, 0]);
        assert_eq!(order(1.25, &nodes), [0, 2, 1]);
        assert_eq!(order(1.0, &nodes), [0, 1, 2]);
    }

    #[test]
    fn nothing_leaves_twice_and_stale_nodes_never() {
        let mut list = OpenList::with_others(2, 10.0);
        for node in 0..20 {
            list.push(node, 1.0 + node as f32, &[30.0 - node as f32, 5.0]);
        }
        let mut left: Vec<_> = std::iter::from_fn(|| list.pop(|n| n % 3 == 0)).collect();
        left.sort_unstable();
        assert_eq!(left, (0..20).filter(|n| n % 3 != 0).collect::<Vec<_>>());
    }
}
