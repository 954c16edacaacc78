//! The nearest of a cell's samples.
//!
//! A cell of the usual grids holds some hundred samples, and looking at each of them takes less than half a
//! microsecond. Where a data set of one's own puts more into a cell, kiddo's k-d tree finds them (feature
//! `kiddo`, part of the laboratory); the answers are the same.

use std::num::NonZero;

#[cfg(feature = "kiddo")]
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// A point of the metric, metres.
pub type MetricPoint = [f32; 4];

/// From so many points on a tree is worth building: a look at each takes more than a microsecond
/// (`cargo bench --bench selectors`).
#[cfg(feature = "kiddo")]
const TREE_FROM: usize = 500;

/// The points of one cell, in sample order.
#[derive(Debug)]
pub struct Points {
    points: Vec<MetricPoint>,
    #[cfg(feature = "kiddo")]
    tree: Option<Tree>,
}

/// Squared distance of two points of the metric, m², summed in double precision.
pub fn distance_sq(a: &MetricPoint, b: &MetricPoint) -> f64 {
    let squares = std::array::from_fn::<f64, 4, _>(|i| {
        let d = f64::from(a[i]) - f64::from(b[i]);
        d * d
    });
    squares.iter().sum()
}

impl Points {
    /// `points` are finite.
    pub fn new(points: Vec<MetricPoint>) -> Self {
        Self {
            #[cfg(feature = "kiddo")]
            tree: (points.len() >= TREE_FROM).then(|| Tree::new(&points)),
            points,
        }
    }

    /// The `n` nearest `(distance_sq, position)`, sorted by both; all where there are fewer.
    pub fn nearest(&self, query: &MetricPoint, n: NonZero<usize>) -> Vec<(f64, usize)> {
        #[cfg(feature = "kiddo")]
        if let Some(tree) = &self.tree {
            let exact = |i: usize| (distance_sq(&self.points[i], query), i);
            if let Some(found) = tree.nearest(query, n, exact) {
                return found;
            }
        }
        self.look_at_each(query, n)
    }

    fn look_at_each(&self, query: &MetricPoint, n: NonZero<usize>) -> Vec<(f64, usize)> {
        let mut all: Vec<_> =
            self.points.iter().enumerate().map(|(i, p)| (distance_sq(p, query), i)).collect();
        if n.get() < all.len() {
            all.select_nth_unstable_by(n.get() - 1, by_distance);
            all.truncate(n.get());
        }
        all.sort_unstable_by(by_distance);
        all
    }
}

fn by_distance(a: &(f64, usize), b: &(f64, usize)) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1))
}

#[cfg(feature = "kiddo")]
struct Tree(ImmutableKdTree<f32, 4>);

#[cfg(feature = "kiddo")]
impl std::fmt::Debug for Tree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Tree")
    }
}

#[cfg(feature = "kiddo")]
impl Tree {
    fn new(points: &[MetricPoint]) -> Self {
        Self(ImmutableKdTree::new_from_slice(points).expect("points that are finite and not empty"))
    }

    /// The `n` nearest, or `None` where only `exact` distances of all points tell which they are: the tree
    /// computes in single precision and breaks ties as it likes, so it is asked for one more, which has to
    /// be clearly farther.
    fn nearest(
        &self,
        query: &MetricPoint,
        n: NonZero<usize>,
        exact: impl Fn(usize) -> (f64, usize),
    ) -> Option<Vec<(f64, usize)>> {
        /// Far above the rounding of a sum of four squares in single precision (2e-7).
        const ROUNDING: f64 = 1e-5;
        let found =
            self.0.query(query).nearest_n::<SquaredEuclidean<f32>>(n.saturating_add(1)).execute();
        let mut hits: Vec<_> = found.iter().map(|hit| exact(hit.item as usize)).collect();
        hits.sort_unstable_by(by_distance);
        let beyond = *hits.get(n.get())?;
        hits.truncate(n.get());
        let clearly = beyond.0 > hits.last()?.0 * (1.0 + ROUNDING) + f64::MIN_POSITIVE;
        clearly.then_some(hits)
    }
}

#[cfg(all(test, feature = "kiddo"))]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// On a lattice most distances are met several times.
        #[test]
        fn the_tree_finds_what_a_look_at_each_finds(
            points in prop::collection::vec([-4_i8..4, -4_i8..4, -2_i8..2, -2_i8..2], 1..400),
            query in [-5.0_f32..5.0, -5.0_f32..5.0, -3.0_f32..3.0, -3.0_f32..3.0],
            on_lattice: bool,
            n in 1_usize..60,
        ) {
            let points: Vec<MetricPoint> = points.iter().map(|p| p.map(f32::from)).collect();
            let query = if on_lattice { query.map(f32::round) } else { query };
            let n = NonZero::new(n).unwrap();
            let exact = |i: usize| (distance_sq(&points[i], &query), i);
            let found = Tree::new(&points).nearest(&query, n, exact);
            let all = Points { points: points.clone(), tree: None }.look_at_each(&query, n);
            prop_assert_eq!(all.len(), n.get().min(points.len()));
            prop_assert!(all.is_sorted_by(|a, b| by_distance(a, b).is_lt()));
            if let Some(found) = found {
                prop_assert_eq!(found, all);
            }
        }
    }

    #[test]
    fn large_cells_have_a_tree() {
        let points = |count: usize| {
            Points::new((0..count).map(|i| [i as f32, (i % 7) as f32, 0.0, 1.0]).collect())
        };
        assert!(points(TREE_FROM - 1).tree.is_none());
        let large = points(TREE_FROM);
        assert!(large.tree.is_some());
        let n = NonZero::new(5).unwrap();
        let query = [200.2, 3.1, 0.0, 1.0];
        assert_eq!(large.nearest(&query, n), large.look_at_each(&query, n));
    }
}
