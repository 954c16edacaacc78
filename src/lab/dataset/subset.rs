//! Smaller data sets out of a larger one, to see how much data is enough.

use serde::{Deserialize, Serialize};

use super::read::Dataset;
use super::schema::Sample;
use crate::world::cell::{Axis, Grid};

/// Which part of a data set: every so many-th value of each axis of the grid, from the
/// smallest on, and the first samples of each cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Subset {
    /// Every so many-th lane width, 1 to 1000.
    pub lane_width: usize,
    /// Every so many-th spot width, 1 to 1000.
    pub spot_width: usize,
    /// Every so many-th dead end, 1 to 1000.
    pub dead_end: usize,
    /// Samples of each cell, at least 1; more than there are take all.
    pub samples_per_cell: u32,
}

impl Default for Subset {
    /// Everything.
    fn default() -> Self {
        Self { lane_width: 1, spot_width: 1, dead_end: 1, samples_per_cell: u32::MAX }
    }
}

impl Subset {
    /// Checks every field; the message names it.
    pub fn validate(&self) -> Result<(), String> {
        let every = [
            ("lane_width", self.lane_width),
            ("spot_width", self.spot_width),
            ("dead_end", self.dead_end),
        ];
        for (field, value) in every {
            if !(1..=1000).contains(&value) {
                return Err(format!("{field} is {value}; expected 1 to 1000"));
            }
        }
        if self.samples_per_cell == 0 {
            return Err("samples_per_cell is 0; expected at least 1".to_owned());
        }
        Ok(())
    }

    /// The rows of `data` that lie in it, in cells of the coarser grid; starts are those of the
    /// whole. Where a coarser
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
            let kind = sample.cell.kind();
            let place = old.place(kind, sample.cell_index as usize);
            // Of all stances of angled bays.
            let every = [1, self.lane_width, self.spot_width, self.dead_end];
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::lab::dataset::{CollectConfig, Status};
    use crate::world::ParkingType;

    fn data() -> Dataset {
        let config = CollectConfig { samples_per_cell: 3, ..CollectConfig::default() };
        let kind = ParkingType::Parallel;
        let start = Pose::new(-9.0, 4.0, 0.0);
        let row = |cell: u32, i| {
            let place = config.grid.cell(kind, cell as usize);
            Sample::unsolved(place, cell, i, start, Status::NoPath, 1)
        };
        let cells = 0..config.grid.cell_count(kind) as u32;
        let samples = cells.flat_map(|cell| [0, 1, 2].map(|i| row(cell, i))).collect();
        Dataset { metadata: config.metadata(), samples }
    }

    #[test]
    fn the_rest_is_as_if_collected_on_the_coarser_grid() {
        let whole = data();
        let part = Subset { lane_width: 2, spot_width: 4, dead_end: 3, samples_per_cell: 2 };
        let thinned = part.of(&whole);
        let grid = thinned.metadata.grid;
        // 7, 9 and 9 values become 4, 3 and 3.
        assert_eq!(grid.cell_count(ParkingType::Parallel), 4 * 3 * 3);
        assert_eq!((grid.lane_width.max, grid.parallel_spot_width.max), (7.0, 8.0));
        assert_eq!(grid.dead_end.max, 10.0, "12 m is no longer on the axis");
        assert_eq!(thinned.samples.len(), 36 * 2);
        assert_eq!(thinned.metadata.samples_per_cell, 2);
        for (i, s) in thinned.samples.iter().enumerate() {
            let kind = ParkingType::Parallel;
            assert_eq!((s.cell_index, s.sample_index), (i as u32 / 2, i as u32 % 2));
            assert_eq!(s.cell, grid.cell(kind, s.cell_index as usize));
            let was = whole.samples.iter().find(|w| w.cell == s.cell);
            assert!(was.is_some(), "{:?} is a cell of the whole", s.cell);
        }
    }

    #[test]
    fn everything_stays_everything() {
        let whole = data();
        let same = Subset::default().of(&whole);
        assert_eq!(same.metadata, whole.metadata);
        assert_eq!(format!("{:?}", same.samples), format!("{:?}", whole.samples));
    }

    #[test]
    fn refusals_name_the_field() {
        assert!(Subset::default().validate().is_ok());
        let none = Subset { samples_per_cell: 0, ..Subset::default() };
        assert!(none.validate().unwrap_err().starts_with("samples_per_cell is 0"));
        let none = Subset { dead_end: 0, ..Subset::default() };
        assert!(none.validate().unwrap_err().starts_with("dead_end is 0"));
    }
}
