//! Cells of a grid as rectangles.

/// A block of cells: columns `x0..x1` of rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    pub x0: usize,
    pub x1: usize,
    pub y0: usize,
    pub y1: usize,
}

/// The blocked cells of a grid as blocks that do not overlap: runs of a row, grown over the rows that have the same run.
///
/// `rows` from the lowest on; a byte stands for a blocked cell where `is_blocked` says so.
pub(crate) fn blocks<'a>(
    rows: impl Iterator<Item = &'a [u8]>,
    is_blocked: &[bool; 256],
) -> Vec<Block> {
    let (mut blocks, mut open, mut still) = (Vec::new(), Vec::<Block>::new(), Vec::new());
    let mut runs = Vec::new();
    let mut y = 0;
    let mut last: &[u8] = &[];
    for row in rows {
        // A row like the one before has the same runs.
        if row != last || y == 0 {
            find_runs(row, is_blocked, &mut runs);
            let mut before = open.iter().peekable();
            for &(x0, x1) in &runs {
                let mut since = y;
                while let Some(block) = before.next_if(|block| block.x0 <= x0) {
                    if (block.x0, block.x1) == (x0, x1) {
                        since = block.y0;
                    } else {
                        blocks.push(Block { y1: y, ..*block });
                    }
                }
                still.push(Block { x0, x1, y0: since, y1: since });
            }
            blocks.extend(before.map(|block| Block { y1: y, ..*block }));
            std::mem::swap(&mut open, &mut still);
            still.clear();
        }
        (last, y) = (row, y + 1);
    }
    blocks.extend(open.into_iter().map(|block| Block { y1: y, ..block }));
    blocks
}

/// Where blocked cells of a row begin and end.
fn find_runs(row: &[u8], is_blocked: &[bool; 256], runs: &mut Vec<(usize, usize)>) {
    runs.clear();
    let (mut x, mut from) = (0, None);
    while x < row.len() {
        match (is_blocked[usize::from(row[x])], from) {
            (true, None) => from = Some(x),
            (false, Some(since)) => {
                runs.push((since, x));
                from = None;
            }
            _ => {}
        }
        let end = same_until(row, x);
        x = end;
    }
    runs.extend(from.map(|since| (since, row.len())));
}

/// The end of the bytes that are as the one at `x`, as far as that is quickly seen.
fn same_until(row: &[u8], x: usize) -> usize {
    const WORD: usize = 16;
    let word = [row[x]; WORD];
    let mut end = x + 1;
    while row.get(end..end + WORD).is_some_and(|bytes| bytes == word) {
        end += WORD;
    }
    end
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn blocks_cover_each_blocked_cell_once_and_no_other(
            columns in 1_usize..80, seed in proptest::collection::vec(0_u8..6, 1..900), repeat in 1_usize..4,
        ) {
            // Bytes that often stay the same, and rows that repeat.
            let bytes: Vec<u8> = seed.iter().flat_map(|&b| vec![b % 3; 1 + 9 * usize::from(b / 3)]).collect();
            let rows: Vec<&[u8]> =
                bytes.chunks_exact(columns).flat_map(|row| vec![row; repeat]).collect();
            let mut is_blocked = [false; 256];
            is_blocked[1] = true;
            is_blocked[2] = true;
            let mut covered = vec![vec![0; columns]; rows.len()];
            for block in blocks(rows.iter().copied(), &is_blocked) {
                for row in &mut covered[block.y0..block.y1] {
                    row[block.x0..block.x1].iter_mut().for_each(|count| *count += 1);
                }
            }
            for (row, counts) in rows.iter().zip(covered) {
                let expected: Vec<i32> = row.iter().map(|&b| i32::from(b > 0)).collect();
                prop_assert_eq!(counts, expected);
            }
        }
    }
}
