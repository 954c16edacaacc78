//! How good the answers of nearest neighbours are, told by the stored samples alone.
//!
//! Stored starts are asked for as if they were not stored: the nearest *other* sample of the
//! cell answers, and the answer is compared with the sample's own preparatory pose. So every
//! question meets a cell that lacks one sample; in use none is lacking.

use serde::{Deserialize, Serialize};

use super::quality::{Errors, Reach, errors, reach};
use super::targets::Example;
use crate::lab::dataset::{Metadata, Sample};
use crate::selectors::knn::KnnSelector;
use crate::selectors::nearest;

/// Samples asked for, at most: judging one takes some ten microseconds.
const MOST: usize = 1000;

/// What the nearest other samples of a parking type answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeaveOneOut {
    /// Their distance from the samples' own poses.
    pub errors: Errors,
    /// What they are worth to a planner.
    pub reach: Reach,
}

/// Asks for some of the `solved` samples, which are ordered by cell; evenly spread over those
/// with another in their cell. `None` where no cell has two. `heading_radius`: metres per radian
/// of the metric.
pub(super) fn leave_one_out(
    metadata: &Metadata,
    solved: &[&Sample],
    heading_radius: f64,
) -> Option<LeaveOneOut> {
    let cells = solved.chunk_by(|a, b| a.cell_index == b.cell_index).filter(|c| c.len() > 1);
    let all: Vec<_> = cells.flat_map(|cell| (0..cell.len()).map(move |i| (cell, i))).collect();
    if all.is_empty() {
        return None;
    }
    let count = all.len().min(MOST);
    let asked = (0..count).map(|i| all[i * all.len() / count]);
    let (examples, answers): (Vec<_>, Vec<_>) = asked
        .map(|(cell, i)| {
            let nearest = nearest_other(cell, i, heading_radius);
            (Example::stored(cell[i]), cell[nearest].rs_start)
        })
        .unzip();
    let (errors, reach) = (errors(&answers, &examples), reach(metadata, &examples, &answers));
    Some(LeaveOneOut { errors, reach })
}

/// Position of the sample of `cell` whose start is nearest to that of sample `i`, itself aside;
/// of equally near ones the first, as [`KnnSelector::nearest`] has it.
fn nearest_other(cell: &[&Sample], i: usize, heading_radius: f64) -> usize {
    let point = |j: usize| KnnSelector::point(cell[j].start, heading_radius);
    let asked = point(i);
    let distance_sq = |j: usize| nearest::distance_sq(&point(j), &asked);
    let others = (0..cell.len()).filter(|&j| j != i).map(|j| (distance_sq(j), j));
    others.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a cell with two samples").1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::lab::dataset::{CollectConfig, Status};
    use crate::world::ParkingType;

    /// Samples `(cell, start, preparatory pose)` of parallel spots.
    fn samples(rows: &[(usize, Pose, Pose)]) -> (Metadata, Vec<Sample>) {
        let config = CollectConfig::default();
        let rows = rows.iter().enumerate().map(|(i, &(index, start, rs_start))| {
            let cell = config.grid.cell(ParkingType::Parallel, index);
            let row = Sample::unsolved(cell, index as u32, i as u32, start, Status::Solved, 1);
            Sample { rs_start, ..row }
        });
        (config.metadata(), rows.collect())
    }

    fn asked(rows: &[(usize, Pose, Pose)], heading_radius: f64) -> Option<LeaveOneOut> {
        let (metadata, samples) = samples(rows);
        leave_one_out(&metadata, &samples.iter().collect::<Vec<_>>(), heading_radius)
    }

    #[test]
    fn the_nearest_other_of_the_cell_answers() {
        let at = |x: f64| Pose::new(x, 3.0, 0.0);
        // Cell 2 has the same start twice: zero metres away, but not the sample itself.
        let rows = [
            (1, at(0.0), at(10.0)),
            (1, at(1.0), at(12.0)),
            (1, at(3.0), at(15.0)),
            (2, at(0.0), at(20.0)),
            (2, at(0.0), Pose::new(20.5, 3.0, 0.1)),
            (7, at(0.0), at(99.0)),
        ];
        let got = asked(&rows, 2.0).unwrap();
        // 10 → 12, 12 → 10, 15 → 12, 20 ↔ 20.5; cell 7 has nothing to ask.
        assert_eq!(got.reach.rows, 5);
        let errors = got.errors;
        assert!((errors.position_mean_m - (2.0 + 2.0 + 3.0 + 0.5 + 0.5) / 5.0).abs() < 1e-12);
        assert_eq!((errors.position_median_m, errors.position_p95_m), (2.0, 3.0));
        assert!((errors.heading_mean_rad - 0.2 / 5.0).abs() < 1e-12, "{errors:?}");
        assert_eq!(asked(&rows[5..], 2.0), None);
        assert_eq!(asked(&[rows[0], rows[3], rows[5]], 2.0), None, "one in each cell");
    }

    #[test]
    fn headings_count_by_their_radius() {
        let (_, samples) = samples(&[
            (1, Pose::new(0.0, 3.0, 0.0), Pose::default()),
            (1, Pose::new(0.5, 3.0, 0.0), Pose::default()),
            (1, Pose::new(0.0, 3.0, 0.2), Pose::default()),
            (1, Pose::new(-0.5, 3.0, 0.0), Pose::default()),
        ]);
        let cell: Vec<&Sample> = samples.iter().collect();
        assert_eq!(nearest_other(&cell, 0, 1.0), 2, "0.2 m against 0.5 m");
        assert_eq!(nearest_other(&cell, 0, 4.0), 1, "0.8 m against twice 0.5 m: the first");
    }

    #[test]
    fn many_samples_are_thinned() {
        let pose = |i: usize| Pose::new(0.001 * i as f64, 3.0, 0.0);
        let rows: Vec<_> = (0..MOST + 500).map(|i| (i / 50, pose(i), pose(i))).collect();
        let got = asked(&rows, 2.0).unwrap();
        assert_eq!(got.reach.rows, MOST);
        assert!((got.errors.position_p95_m - 0.001).abs() < 1e-9, "{got:?}");
    }
}
