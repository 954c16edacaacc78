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

/// The open nodes of a search.
#[derive(Debug, Default)]
pub(super) struct OpenList {
    queue: BinaryHeap<Open>,
}

impl OpenList {
    /// Forgets all nodes.
    pub fn clear(&mut self) {
        self.queue.clear();
    }

    /// Adds a node of priority `f`.
    pub fn push(&mut self, node: NodeIndex, f: f32) {
        self.queue.push(Open { f, node });
    }

    /// Takes the first node that is not `stale`; those before it are dropped.
    pub fn pop(&mut self, mut stale: impl FnMut(NodeIndex) -> bool) -> Option<NodeIndex> {
        std::iter::from_fn(|| self.queue.pop()).map(|open| open.node).find(|&n| !stale(n))
    }
}
