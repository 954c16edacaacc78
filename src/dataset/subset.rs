//! Smaller data sets out of a larger one, to see how much data is enough.

use serde::{Deserialize, Serialize};

use super::read::Dataset;
use super::schema::Sample;
use crate::world::cell::{Axis, Grid};

/// Which part of a data set: every so many-th value of each axis of the grid, from the
/// smallest on, and the first samples of each cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Subset {
    /// Every so many-th lane width, 1 to 1000.
    pub lane_width: usize,
    /// Every so many-th spot width, 1 to 1000.
    pub spot_width: usize,
    /// Every so many-th dead end, 1 to 1000.
    pub dead_end: usize,
    /// Samples of each cell; more than there are take all.
    pub samples_per_cell: u32,
}

impl Subset {
    /// The rows of `data` that lie in it, as if collected on the coarser grid. Where a coarser
    /// axis misses the largest value, the cells above its last one belong to that.
    pub fn of(&self, data: &Dataset) -> Dataset {
        let old = data.metadata.grid;
        let thin = |axis: Axis, every: usize| {
            let step = axis.step * every as f64;
            let last = (axis.len() - 1) / every;
            Axis { max: axis.min + last as f64 * step, step, ..axis }
        };
        let grid = Grid {
            lane_width: thin(old.lane_width, self.lane_width),
            bay_spot_width: thin(old.bay_spot_width, self.spot_width),
            parallel_spot_width: thin(old.parallel_spot_width, self.spot_width),
            dead_end: thin(old.dead_end, self.dead_end),
            ..old
        };
        let mut metadata = data.metadata.clone();
        metadata.grid = grid;
        metadata.samples_per_cell = metadata.samples_per_cell.min(self.samples_per_cell);
        let kept = data.samples.iter().filter(|s| s.sample_index < metadata.samples_per_cell);
        let moved = kept.filter_map(|sample| {
            let kind = sample.cell.kind;
            let place = old.place(kind, sample.cell_index as usize);
            let every = [self.lane_width, self.spot_width, self.dead_end];
            if place.iter().zip(every).any(|(index, every)| index % every != 0) {
                return None;
            }
            let index = grid.index(kind, std::array::from_fn(|i| place[i] / every[i]));
            let cell = grid.cell(kind, index);
            Some(Sample { cell, cell_index: index as u32, ..sample.clone() })
        });
        let samples = moved.collect();
        Dataset { metadata, samples }
    }
}
