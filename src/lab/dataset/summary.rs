//! What is in a data set, told without having all of it in memory.

use std::collections::BTreeMap;
use std::path::Path;

use super::identity::ContentHash;
use super::read::for_each_shard;
use super::{DatasetError, Metadata, Sample, Status};
use crate::world::ParkingType;

/// Checksum and counts of some types of a data set.
#[derive(Clone, Debug)]
pub struct Summary {
    /// The settings it was collected with.
    pub metadata: Metadata,
    /// The [`content_sha256`](super::content_sha256) of these types.
    pub sha256: String,
    /// What their rows hold.
    pub kinds: BTreeMap<ParkingType, Tally>,
}

/// Counts of one type's rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// By status, in the order of [`Status::ALL`].
    pub statuses: [u64; Status::ALL.len()],
    /// Of solved rows: where starts lie along the lane, metres, spot frame.
    pub start_x: Counts,
    /// Of solved rows: metres.
    pub path_length: Counts,
    /// Of solved rows.
    pub direction_changes: Counts,
    /// Of solved rows.
    pub expansions: Counts,
}

/// How often each value occurs. Rows hold rounded values, so there are far fewer than rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts(BTreeMap<i64, u64>);

impl Summary {
    /// Reads and checks these types, some shards at a time.
    ///
    /// # Errors
    ///
    /// As [`Dataset::read_types`](super::Dataset::read_types).
    pub fn read(folder: &Path, kinds: &[ParkingType]) -> Result<Self, DatasetError> {
        let mut in_order = kinds.to_vec();
        in_order.sort();
        let mut tallies: BTreeMap<ParkingType, Tally> = BTreeMap::new();
        let mut hash = None;
        let metadata = for_each_shard(folder, &in_order, |metadata, samples| {
            let hash = hash.get_or_insert_with(|| ContentHash::new(metadata));
            for sample in &samples {
                hash.push(sample);
                tallies.entry(sample.cell.kind()).or_default().push(sample);
            }
        })?;
        let sha256 = hash.unwrap_or_else(|| ContentHash::new(&metadata)).finish();
        Ok(Self { metadata, sha256, kinds: tallies })
    }
}

impl Tally {
    fn push(&mut self, sample: &Sample) {
        self.statuses[sample.status as usize] += 1;
        if sample.status == Status::Solved {
            self.start_x.push(sample.start.x);
            self.path_length.push(sample.path_length);
            self.direction_changes.push(sample.direction_changes.into());
            self.expansions.push(sample.expansions.into());
        }
    }

    /// All rows.
    pub fn rows(&self) -> u64 {
        self.statuses.iter().sum()
    }

    /// The solved ones.
    pub fn solved(&self) -> u64 {
        self.statuses[Status::Solved as usize]
    }
}

impl Counts {
    fn push(&mut self, value: f64) {
        *self.0.entry(in_order(value.to_bits() as i64)).or_default() += 1;
    }

    /// The value that a `share` of all lie below; `None` of none.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let total: u64 = self.0.values().sum();
        let index = (share * (total.max(1) - 1) as f64) as u64;
        let mut so_far = 0;
        let value = self.0.iter().find(|(_, count)| {
            so_far += **count;
            so_far > index
        });
        value.map(|(key, _)| f64::from_bits(in_order(*key) as u64))
    }
}

/// The bits of a number as an integer that orders as [`f64::total_cmp`] does; its own inverse.
fn in_order(bits: i64) -> i64 {
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn quantiles_are_those_of_the_sorted_values(
            mut values in prop::collection::vec((-40i32..40).prop_map(|v| f64::from(v) / 8.0), 0..60),
            share in 0.0..=1.0,
        ) {
            let mut counts = Counts::default();
            values.iter().for_each(|&v| counts.push(v));
            values.sort_by(f64::total_cmp);
            let at = (share * (values.len().max(1) - 1) as f64) as usize;
            prop_assert_eq!(counts.quantile(share), values.get(at).copied());
        }
    }

    #[test]
    fn statuses_are_counted_in_their_order() {
        assert!(Status::ALL.iter().enumerate().all(|(i, status)| *status as usize == i));
    }
}
