//! What a data set is called: a checksum over its settings and rows.

use sha2::{Digest, Sha256};

use super::schema::{Metadata, Sample, manoeuvre_text};

/// SHA-256, lower-case hexadecimal, over the settings and `samples`, row by row in the order of types,
/// cells and samples: the same for every build that collects the same rows, however they are cut
/// into files.
pub fn content_sha256<'a>(
    metadata: &Metadata,
    samples: impl IntoIterator<Item = &'a Sample>,
) -> String {
    let mut hash = ContentHash::new(metadata);
    let mut samples: Vec<&Sample> = samples.into_iter().collect();
    samples.sort_by_key(|s| (s.cell.kind(), s.cell_index, s.sample_index));
    samples.into_iter().for_each(|sample| hash.push(sample));
    hash.finish()
}

/// [`content_sha256`] of rows that come one after the other, in its order.
pub(super) struct ContentHash {
    hash: Sha256,
    row: Vec<u8>,
}

impl ContentHash {
    pub(super) fn new(metadata: &Metadata) -> Self {
        let mut hash = Sha256::new();
        hash.update(metadata.settings().to_string());
        Self { hash, row: Vec::new() }
    }

    pub(super) fn push(&mut self, sample: &Sample) {
        self.row.clear();
        write(sample, &mut self.row);
        self.hash.update(&self.row);
    }

    pub(super) fn finish(self) -> String {
        self.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// Appends every column that the settings and the place in the grid leave open.
fn write(s: &Sample, row: &mut Vec<u8>) {
    let text = |row: &mut Vec<u8>, text: &str| {
        row.extend((text.len() as u32).to_le_bytes());
        row.extend(text.as_bytes());
    };
    text(row, s.cell.kind().name());
    text(row, s.status.name());
    text(row, &s.rs_word);
    text(row, &manoeuvre_text(&s.manoeuvre));
    for number in [s.cell_index, s.sample_index, s.direction_changes, s.expansions] {
        row.extend(number.to_le_bytes());
    }
    let poses = [s.start, s.rs_start].map(<[f64; 3]>::from);
    let lengths = [s.entry, s.path_length];
    for &value in poses.iter().flatten().chain(&s.rs_lengths).chain(&lengths) {
        // One NaN for all.
        let value = if value.is_nan() { f64::NAN } else { value };
        row.extend(value.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::lab::dataset::{CollectConfig, Status};
    use crate::world::ParkingType;

    #[test]
    fn names_settings_and_rows_but_not_the_build() {
        let config = CollectConfig::default();
        let metadata = config.metadata();
        let cell = config.grid.cell(ParkingType::Reverse, 0);
        let start = Pose::new(-9.0, 5.0, 0.25);
        let row = Sample::unsolved(cell, 0, 0, start, Status::NoPath, 1);
        let name = |metadata: &Metadata, row: &Sample| content_sha256(metadata, [row]);
        let first = name(&metadata, &row);
        let built_again = Metadata { git_revision: "elsewhere".to_owned(), ..metadata.clone() };
        assert_eq!(first, name(&built_again, &row));
        let packed_otherwise = Metadata { cells_per_shard: 7, ..metadata.clone() };
        assert_eq!(first, name(&packed_otherwise, &row));

        let reseeded = Metadata { seed: 2, ..metadata.clone() };
        let others = [
            name(&reseeded, &row),
            name(&metadata, &Sample { expansions: 1, ..row.clone() }),
            name(&metadata, &Sample { entry: 1.0, ..row.clone() }),
            content_sha256(&metadata, [&row, &row]),
        ];
        assert!(others.iter().all(|o| *o != first));
    }
}
