//! Rows → the bytes of a shard.

use std::sync::Arc;

use arrow_array::{
    ArrayRef, Float32Array, Float64Array, RecordBatch, StringArray, UInt32Array, UInt64Array,
};
use arrow_schema::DataType;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::ColumnPath;

use super::schema::{Metadata, Sample, columns, manoeuvre_text};

/// Key of the [`Metadata`] JSON in a Parquet file's key-value metadata.
pub const METADATA_KEY: &str = "n3p";

/// The Parquet file of `samples`, which must be [rounded](Sample::rounded).
///
/// The same rows give the same bytes: no time stamps, one row group.
#[allow(clippy::missing_panics_doc, reason = "what is written is plain data")]
pub fn encode(metadata: &Metadata, samples: &[Sample]) -> Result<Vec<u8>, ParquetError> {
    let schema = Arc::new(columns());
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_statistics_enabled(EnabledStatistics::None)
        .set_offset_index_disabled(true)
        .set_key_value_metadata(Some(vec![KeyValue::new(
            METADATA_KEY.to_owned(),
            serde_json::to_string(metadata).expect("metadata is plain data"),
        )]));
    // Nearly random numbers: a dictionary would only add to them, and the bytes of one
    // significance are more alike than those of one number. A cell's columns repeat instead.
    let random = |name: &str, kind: &DataType| *kind == DataType::Float32 || name == "expansions";
    for field in schema.fields().iter().filter(|f| random(f.name(), f.data_type())) {
        let column = ColumnPath::from(field.name().as_str());
        properties = properties
            .set_column_dictionary_enabled(column.clone(), false)
            .set_column_encoding(column, Encoding::BYTE_STREAM_SPLIT);
    }
    let batch = RecordBatch::try_new(schema.clone(), arrays(samples))?;
    let options = ArrowWriterOptions::new()
        .with_properties(properties.build())
        .with_skip_arrow_metadata(true);
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new_with_options(&mut bytes, schema, options)?;
    writer.write(&batch)?;
    writer.close()?;
    Ok(bytes)
}

/// The columns of [`columns`], in its order.
fn arrays(samples: &[Sample]) -> Vec<ArrayRef> {
    let text = |f: &dyn Fn(&Sample) -> &str| -> ArrayRef {
        Arc::new(StringArray::from_iter_values(samples.iter().map(f)))
    };
    let small = |f: &dyn Fn(&Sample) -> u32| -> ArrayRef {
        Arc::new(UInt32Array::from_iter_values(samples.iter().map(f)))
    };
    let double = |f: &dyn Fn(&Sample) -> f64| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(samples.iter().map(f)))
    };
    let single = |f: &dyn Fn(&Sample) -> f64| -> ArrayRef {
        Arc::new(Float32Array::from_iter_values(samples.iter().map(|s| f(s) as f32)))
    };
    vec![
        text(&|s| s.cell.kind().name()),
        small(&|s| s.cell_index),
        small(&|s| s.sample_index),
        double(&|s| s.cell.lane_width),
        double(&|s| s.cell.spot_width),
        double(&|s| s.cell.dead_end),
        single(&|s| s.start.x),
        single(&|s| s.start.y),
        single(&|s| s.start.heading),
        text(&|s| s.status.name()),
        single(&|s| s.rs_start.x),
        single(&|s| s.rs_start.y),
        single(&|s| s.rs_start.heading),
        text(&|s| &s.rs_word),
        single(&|s| s.rs_lengths[0]),
        single(&|s| s.rs_lengths[1]),
        single(&|s| s.rs_lengths[2]),
        single(&|s| s.rs_lengths[3]),
        single(&|s| s.rs_lengths[4]),
        single(&|s| s.entry),
        Arc::new(StringArray::from_iter_values(
            samples.iter().map(|s| manoeuvre_text(&s.manoeuvre)),
        )),
        single(&|s| s.path_length),
        small(&|s| s.direction_changes),
        small(&|s| s.expansions),
        Arc::new(UInt64Array::from_iter_values(samples.iter().map(|s| s.seed))),
    ]
}
