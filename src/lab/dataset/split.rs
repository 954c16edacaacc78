//! Which cells validate. Whole cells, since samples of one cell are alike.

use std::collections::BTreeSet;

use rand::Rng;

use crate::rng::{Stream, rng};

/// The `share` (0 to 1, rounded to whole cells) of `cells` to validate with; the others train.
///
/// Depends on the seed and the set of cell indices, not on their order. Cells keep their rank
/// when others are added, so the sets of a small and of a larger grid resemble each other.
pub fn validation_cells(
    cells: impl IntoIterator<Item = u32>,
    share: f64,
    seed: u64,
) -> BTreeSet<u32> {
    let distinct: BTreeSet<u32> = cells.into_iter().collect();
    let count = (share.clamp(0.0, 1.0) * distinct.len() as f64).round() as usize;
    let rank = |cell: u32| rng(seed, Stream::Split, cell.into()).next_u64();
    let mut ranked: Vec<(u64, u32)> = distinct.into_iter().map(|c| (rank(c), c)).collect();
    ranked.sort_unstable();
    ranked.into_iter().take(count).map(|(_, cell)| cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_share_whatever_the_order() {
        let split = validation_cells(0..567, 0.1, 7);
        assert_eq!(split.len(), 57);
        assert_eq!(split, validation_cells((0..567).rev().chain(3..40), 0.1, 7));
        assert_ne!(split, validation_cells(0..567, 0.1, 8));
        assert!(validation_cells(0..567, 0.0, 7).is_empty());
        assert_eq!(validation_cells(0..567, 1.0, 7).len(), 567);
    }
}
