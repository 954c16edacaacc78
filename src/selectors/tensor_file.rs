//! Safetensors files that say what they are and notice damage.
//!
//! One metadata entry `n3p` holds a JSON object `{"sha256": …, "header": …}`. The header is an
//! object with a `format_version`; the checksum covers the header's text and all tensor bytes.

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError, SafeTensors};
use serde::Deserialize;

use super::artefact::Fault;
use super::network::LayerWeights;
use crate::files::sha256_hex;

const METADATA_KEY: &str = "n3p";

/// A tensor to write.
pub struct NamedTensor {
    name: String,
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl NamedTensor {
    /// Of single precision.
    ///
    /// # Panics
    ///
    /// When `values` do not fill `shape`.
    pub fn f32(name: String, shape: Vec<usize>, values: &[f32]) -> Self {
        assert_eq!(values.len(), shape.iter().product::<usize>(), "{name}");
        let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        Self { name, dtype: Dtype::F32, shape, bytes }
    }

    /// Of bytes.
    pub fn u8(name: String, bytes: Vec<u8>) -> Self {
        Self { name, dtype: Dtype::U8, shape: vec![bytes.len()], bytes }
    }
}

/// The bytes of a file: the same header and tensors give the same bytes.
#[allow(
    clippy::missing_panics_doc,
    reason = "a tensor has as many bytes as its shape says when it is made"
)]
pub fn encode(header: &str, mut tensors: Vec<NamedTensor>) -> Vec<u8> {
    // As safetensors lays them out, so that the checksum can be taken here.
    tensors.sort_by(|a, b| (b.dtype, &a.name).cmp(&(a.dtype, &b.name)));
    let mut parts = vec![header.as_bytes()];
    parts.extend(tensors.iter().map(|t| t.bytes.as_slice()));
    let sum = sha256_hex(&parts);
    // One entry only: safetensors writes several in random order.
    let entry = format!("{{\"sha256\":\"{sum}\",\"header\":{header}}}");
    // Collected into the map that safetensors takes, with its feature std or without.
    let metadata = [(METADATA_KEY.to_owned(), entry)].into_iter().collect();
    let views = tensors.iter().map(|t| {
        let view = TensorView::new(t.dtype, t.shape.clone(), &t.bytes);
        (&t.name, view.expect("as many bytes as the shape says"))
    });
    safetensors::serialize(views, Some(metadata)).expect("tensors are within the format")
}

/// The layers of a network of these widths as tensors `PREFIXlayers.N.weight` (`[outputs, inputs]`)
/// and `PREFIXlayers.N.bias` (`[outputs]`). Panics where the weights are not of these widths.
pub fn layer_tensors(prefix: &str, widths: &[usize], weights: &[LayerWeights]) -> Vec<NamedTensor> {
    let mut tensors = Vec::new();
    for (n, (layer, size)) in weights.iter().zip(widths.windows(2)).enumerate() {
        let name = |part| layer_name(prefix, n, part);
        tensors.push(NamedTensor::f32(name("bias"), vec![size[1]], &layer.bias));
        tensors.push(NamedTensor::f32(name("weight"), vec![size[1], size[0]], &layer.weight));
    }
    tensors
}

/// What [`layer_tensors`] made tensors of.
pub fn layers(
    tensors: &SafeTensors,
    prefix: &str,
    widths: &[usize],
) -> Result<Vec<LayerWeights>, Fault> {
    let layers = widths.windows(2).enumerate().map(|(n, size)| {
        let name = |part| layer_name(prefix, n, part);
        Ok(LayerWeights {
            weight: f32s(tensors, &name("weight"), &[size[1], size[0]])?,
            bias: f32s(tensors, &name("bias"), &[size[1]])?,
        })
    });
    layers.collect()
}

fn layer_name(prefix: &str, layer: usize, part: &str) -> String {
    format!("{prefix}layers.{layer}.{part}")
}

/// Only the version, so that a file of another version is called that and not damaged.
#[derive(Deserialize)]
struct Versioned {
    header: VersionOnly,
}

#[derive(Deserialize)]
struct VersionOnly {
    format_version: u32,
}

/// The header's text and the tensors of a file, its checksum and version checked.
pub fn decode(bytes: &[u8], version: u32) -> Result<(String, SafeTensors<'_>), Fault> {
    let (data_at, entry) = metadata(bytes)?;
    let versioned: Versioned =
        serde_json::from_str(&entry).map_err(|e| Fault::Header(e.to_string()))?;
    let found = versioned.header.format_version;
    if found != version {
        return Err(Fault::Version { found, supported: version });
    }
    let (sum, json) = split_entry(&entry)
        .ok_or_else(|| Fault::Header("no checksum before the header".to_owned()))?;
    if sum != sha256_hex(&[json.as_bytes(), &bytes[data_at..]]) {
        return Err(Fault::Checksum);
    }
    let tensors = SafeTensors::deserialize(bytes).map_err(|e| Fault::Header(e.to_string()))?;
    Ok((json.to_owned(), tensors))
}

/// Where the tensor data begin, and the metadata entry of this program.
fn metadata(bytes: &[u8]) -> Result<(usize, String), Fault> {
    const LENGTH: usize = 8;
    if bytes.is_empty() {
        return Err(Fault::Empty);
    }
    let got = bytes.len() as u64;
    if bytes.len() <= LENGTH || bytes[LENGTH] != b'{' {
        return Err(Fault::NotAModel);
    }
    let header_len = u64::from_le_bytes(bytes[..LENGTH].try_into().expect("eight bytes"));
    let data_at = header_len.saturating_add(LENGTH as u64);
    if data_at > got {
        return Err(Fault::Length { expected: data_at, got });
    }
    // Before safetensors adds the same numbers, which it does without a check.
    let tensors = data_len(&bytes[LENGTH..data_at as usize]);
    let Some(expected) = data_at.checked_add(tensors) else {
        return Err(Fault::Header(format!(
            "its tensors take {tensors} bytes, more than a file can"
        )));
    };
    match SafeTensors::read_metadata(bytes) {
        Ok((_, metadata)) => {
            let entry = metadata.metadata().as_ref().and_then(|m| m.get(METADATA_KEY));
            Ok((data_at as usize, entry.ok_or(Fault::NotAModel)?.clone()))
        }
        Err(SafeTensorError::MetadataIncompleteBuffer) if expected == got => {
            Err(Fault::Header("the tensors do not fill the file".to_owned()))
        }
        Err(SafeTensorError::MetadataIncompleteBuffer) => Err(Fault::Length { expected, got }),
        Err(e) => Err(Fault::Header(e.to_string())),
    }
}

/// Bytes of tensors that a file's own header asks for.
fn data_len(header: &[u8]) -> u64 {
    let header: serde_json::Value = serde_json::from_slice(header).unwrap_or_default();
    let tensors = header.as_object().into_iter().flatten();
    tensors.filter_map(|(_, tensor)| tensor["data_offsets"][1].as_u64()).max().unwrap_or(0)
}

/// The parts of `{"sha256":"…","header":…}`.
fn split_entry(entry: &str) -> Option<(&str, &str)> {
    let (sum, header) = entry.strip_prefix("{\"sha256\":\"")?.split_once("\",\"header\":")?;
    Some((sum, header.strip_suffix('}')?))
}

/// The kinds of model that are stored this way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A network that predicts preparatory poses.
    Mlp,
    /// A driving policy.
    Policy,
    /// Manoeuvres and networks for any vehicle.
    Fleet,
    /// What manoeuvres are worth in a scene.
    Foresight,
}

impl Content {
    /// What a header is the header of.
    pub fn of(header: &str) -> Self {
        let has = |key| {
            let parsed: Result<serde_json::Value, _> = serde_json::from_str(header);
            parsed.is_ok_and(|h| h.get(key).is_some())
        };
        match () {
            () if has("course") => Self::Policy,
            () if has("fleet") => Self::Fleet,
            () if has("foresight") => Self::Foresight,
            () => Self::Mlp,
        }
    }

    /// What a file holds; [`Content::Mlp`] where that cannot be told.
    pub fn of_file(bytes: &[u8]) -> Self {
        let entry = metadata(bytes).ok();
        let header = entry.as_ref().and_then(|(_, entry)| split_entry(entry));
        header.map_or(Self::Mlp, |(_, header)| Self::of(header))
    }
}

/// The finite values of a tensor of single precision and this shape.
pub fn f32s(file: &SafeTensors, name: &str, shape: &[usize]) -> Result<Vec<f32>, Fault> {
    let expected = format!("F32 {shape:?}");
    let wrong =
        |got: String| Fault::Shape { tensor: name.to_owned(), expected: expected.clone(), got };
    let view = file.tensor(name).map_err(|_| wrong("nothing".to_owned()))?;
    if view.dtype() != Dtype::F32 || view.shape() != shape {
        return Err(wrong(format!("{:?} {:?}", view.dtype(), view.shape())));
    }
    let (chunks, _) = view.data().as_chunks::<4>();
    let values: Vec<f32> = chunks.iter().map(|b| f32::from_le_bytes(*b)).collect();
    match values.iter().find(|v| !v.is_finite()) {
        Some(&value) => Err(Fault::NotFinite { tensor: name.to_owned(), value }),
        None => Ok(values),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of eight tensors whose sizes are right each, and together more than 64 bits count.
    fn larger_than_any_file() -> Vec<u8> {
        let size = u64::MAX / 8;
        let tensors: Vec<String> = (0..8)
            .map(|i| {
                let (begin, end) = (i * size, (i + 1) * size);
                format!(
                    "\"{i}\":{{\"dtype\":\"U8\",\"shape\":[{size}],\"data_offsets\":[{begin},{end}]}}"
                )
            })
            .collect();
        let header = format!("{{{}}}", tensors.join(","));
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend(header.as_bytes());
        bytes.extend([0; 8]);
        bytes
    }

    #[test]
    fn sizes_beyond_64_bits_are_a_damaged_header() {
        let fault = decode(&larger_than_any_file(), 1).unwrap_err();
        assert!(
            matches!(&fault, Fault::Header(why) if why.contains("18446744073709551608")),
            "{fault}"
        );
    }
}
