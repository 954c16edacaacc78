//! Clouds of points in PCD files: `ascii`, `binary` and `binary_compressed`.
//!
//! Format: pointclouds.org, "The PCD (Point Cloud Data) file format"; the packing is that of liblzf.

use std::collections::HashMap;

use super::cloud::{Cloud, plain_row};
use super::{Map, MapFile, MapOptions};
use crate::world::scene::SceneError;

/// One field of a point in a PCD file.
struct Field {
    /// Where its first value lies in a point: bytes in binary files, values in others.
    offset: usize,
    size: usize,
    kind: u8,
}

/// What the head of a PCD file says.
struct Head<'a> {
    /// Of x, y and perhaps z.
    binary: [Option<Field>; 3],
    columns: [Option<usize>; 3],
    /// Size of a point: bytes in binary files, values in others.
    bytes: usize,
    values: usize,
    /// For each field its size and number of values, as compressed files order them.
    layout: Vec<usize>,
    fields: [Option<usize>; 3],
    points: usize,
    data: &'a str,
}

pub(super) fn read(bytes: &[u8], options: &MapOptions, file: MapFile) -> Result<Map, SceneError> {
    let (head, from) = head_of(bytes, file)?;
    let body = &bytes[from..];
    let has_z = head.fields[2].is_some();
    let short = |there: usize| {
        let text = format!("is cut short: it has {there} of {} points", head.points);
        file.format(text)
    };
    // A file may claim any number of points: what is set aside follows from what is there.
    let mut cloud = Cloud::new(options, head.points.min(body.len()));
    match head.data {
        "ascii" => {
            let text = str::from_utf8(body)
                .map_err(|_| file.format("is not text (UTF-8) after DATA ascii"))?;
            let (mut at, mut count, mut values) = (0, 0, vec![0.0; head.values]);
            while at < text.len() && count < head.points {
                if let Some(end) = plain_row(body, at, b' ', &mut values) {
                    at = end;
                } else {
                    let line = text[at..].split('\n').next().unwrap_or_default();
                    at += line.len() + 1;
                    let fields: Vec<&str> = line.split_ascii_whitespace().collect();
                    if fields.is_empty() {
                        continue;
                    }
                    if fields.len() != head.values {
                        let text = format!(
                            "point {count} has {} values; expected {}",
                            fields.len(),
                            head.values
                        );
                        return Err(file.format(text));
                    }
                    for column in head.columns.into_iter().flatten() {
                        let field = fields[column];
                        values[column] = field.parse().map_err(|_| {
                            file.format(format!("point {count} has {field:?}; expected a number"))
                        })?;
                    }
                }
                let [x, y, z] = head.columns.map(|column| column.map(|column| values[column]));
                cloud.add(x.unwrap_or(f64::NAN), y.unwrap_or(f64::NAN), z);
                count += 1;
            }
            if count < head.points {
                return Err(short(count));
            }
        }
        "binary" => {
            let there = body.len() / head.bytes;
            if there < head.points {
                return Err(short(there));
            }
            for point in body.chunks_exact(head.bytes).take(head.points) {
                let value = |field: &Field| value_of(&point[field.offset..], field);
                let [x, y, z] = head.binary.each_ref().map(|field| field.as_ref().map(value));
                cloud.add(x.unwrap_or(f64::NAN), y.unwrap_or(f64::NAN), z);
            }
        }
        "binary_compressed" => {
            let size = |at: usize| {
                let bytes = body.get(at..at + 4)?;
                Some(u32::from_le_bytes(bytes.try_into().ok()?) as usize)
            };
            let (Some(packed), Some(size)) = (size(0), size(4)) else { return Err(short(0)) };
            if Some(size) != head.points.checked_mul(head.bytes) {
                let text = format!(
                    "unpacks to {size} bytes; expected {} points of {}",
                    head.points, head.bytes
                );
                return Err(file.format(text));
            }
            let packed =
                body.get(8..).and_then(|rest| rest.get(..packed)).ok_or_else(|| short(0))?;
            let unpacked = unpack(packed, size)
                .ok_or_else(|| file.format("is damaged: its points cannot be unpacked"))?;
            // Field after field, each of all points.
            let begin = |field: usize| head.points * head.layout[..field].iter().sum::<usize>();
            let axes: Vec<_> = (0..3)
                .map(|axis| {
                    let (index, field) = (head.fields[axis]?, head.binary[axis].as_ref()?);
                    Some((begin(index), head.layout[index], field))
                })
                .collect();
            for point in 0..head.points {
                let value = |axis: usize| {
                    axes[axis].map(|(begin, step, field)| {
                        value_of(&unpacked[begin + point * step..], field)
                    })
                };
                cloud.add(value(0).unwrap_or(f64::NAN), value(1).unwrap_or(f64::NAN), value(2));
            }
        }
        other => {
            let text = format!("is {other:?}; expected ascii, binary or binary_compressed");
            return Err(file.invalid("DATA", text));
        }
    }
    cloud.map(has_z, file)
}

/// The head of a PCD file, and where its points begin.
fn head_of<'a>(bytes: &'a [u8], file: MapFile) -> Result<(Head<'a>, usize), SceneError> {
    let (mut lists, mut at) = (HashMap::new(), 0);
    let data = loop {
        let rest = &bytes[at..];
        let end = rest.iter().position(|&b| b == b'\n').filter(|&end| end < 4096);
        let Some(line) = end.and_then(|end| str::from_utf8(&rest[..end]).ok()) else {
            let text = "is no point cloud: its head has no line DATA; expected a PCD file";
            return Err(file.format(text));
        };
        at += line.len() + 1;
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            None => {}
            Some(word) if word.starts_with('#') => {}
            Some("DATA") => break words.next().unwrap_or_default(),
            Some(key) => {
                // Some programs name its columns.
                let key = if key == "COLUMNS" { "FIELDS" } else { key };
                lists.insert(key, words.collect::<Vec<_>>());
            }
        }
    };
    let list = |key: &str| {
        let text = "is missing in the head; expected a PCD file";
        lists.get(key).ok_or_else(|| file.invalid(key, text))
    };
    let numbers = |key: &str| {
        let words = list(key)?;
        let numbers: Option<Vec<usize>> = words.iter().map(|word| word.parse().ok()).collect();
        let text = format!("is {:?}; expected whole numbers", words.join(" "));
        numbers.ok_or_else(|| file.invalid(key, text))
    };
    let names = list("FIELDS")?;
    let (sizes, kinds) = (numbers("SIZE")?, list("TYPE")?);
    let counts = if lists.contains_key("COUNT") { numbers("COUNT")? } else { vec![1; names.len()] };
    for (key, length) in [("SIZE", sizes.len()), ("TYPE", kinds.len()), ("COUNT", counts.len())] {
        if length != names.len() {
            let text = format!("has {length} entries; expected {}, as many as FIELDS", names.len());
            return Err(file.invalid(key, text));
        }
    }
    // More would be no point, and room for them is set aside.
    const MOST: usize = 1 << 16;
    let total = counts.iter().fold(0_usize, |sum, &count| sum.saturating_add(count));
    if total > MOST {
        let text = format!("is {total} values in all; expected at most {MOST}");
        return Err(file.invalid("COUNT", text));
    }
    let kind = |i: usize| kinds[i].as_bytes().first().copied().unwrap_or_default();
    for (i, &size) in sizes.iter().enumerate() {
        let is_known = match kind(i) {
            b'F' => [4, 8].contains(&size),
            b'I' | b'U' => [1, 2, 4, 8].contains(&size),
            _ => false,
        };
        if !is_known {
            let text = format!(
                "of {} is {} with SIZE {size}; expected F, I or U of 1 to 8 bytes",
                names[i], kinds[i]
            );
            return Err(file.invalid("TYPE", text));
        }
    }
    let points = match (lists.contains_key("POINTS"), numbers("WIDTH"), numbers("HEIGHT")) {
        (true, _, _) => numbers("POINTS")?.first().copied().unwrap_or(0),
        (false, width, height) => {
            let of = |list: Vec<usize>| list.first().copied().unwrap_or(0);
            of(width?).saturating_mul(of(height?))
        }
    };
    let layout: Vec<usize> = sizes.iter().zip(&counts).map(|(size, count)| size * count).collect();
    let index = |name: &str| names.iter().position(|&n| n == name);
    let fields = ["x", "y", "z"].map(index);
    if fields[0].is_none() || fields[1].is_none() {
        let text = format!("is {:?}; expected x and y among them", names.join(" "));
        return Err(file.invalid("FIELDS", text));
    }
    if let Some(i) = fields.into_iter().flatten().find(|&i| counts[i] != 1) {
        let text = format!("of {} is {}; expected 1", names[i], counts[i]);
        return Err(file.invalid("COUNT", text));
    }
    let head = Head {
        binary: fields.map(|i| {
            i.map(|i| Field { offset: layout[..i].iter().sum(), size: sizes[i], kind: kind(i) })
        }),
        columns: fields.map(|i| i.map(|i| counts[..i].iter().sum())),
        bytes: layout.iter().sum(),
        values: counts.iter().sum(),
        layout,
        fields,
        points,
        data,
    };
    Ok((head, at))
}

/// The value that `bytes` begin with, little-endian.
fn value_of(bytes: &[u8], field: &Field) -> f64 {
    let mut wide = [0; 8];
    wide[..field.size].copy_from_slice(&bytes[..field.size]);
    let unsigned = u64::from_le_bytes(wide);
    match (field.kind, field.size) {
        (b'F', 4) => f64::from(f32::from_bits(unsigned as u32)),
        (b'F', _) => f64::from_bits(unsigned),
        (b'U', _) => unsigned as f64,
        // The sign is the highest bit of what is there.
        (_, size) => {
            let unused = 64 - 8 * size as u32;
            ((unsigned << unused) as i64 >> unused) as f64
        }
    }
}

/// Unpacks LZF, as liblzf writes it: literal runs, and copies of what was unpacked before. None where the bytes are no
/// such text of `size` bytes.
fn unpack(packed: &[u8], size: usize) -> Option<Vec<u8>> {
    // Three bytes stand for 264 at most.
    if size / 88 > packed.len() {
        return None;
    }
    let mut out = Vec::with_capacity(size);
    let mut at = 0;
    while at < packed.len() {
        let control = usize::from(packed[at]);
        at += 1;
        if control < 32 {
            out.extend_from_slice(packed.get(at..at + control + 1)?);
            at += control + 1;
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*packed.get(at)?);
                at += 1;
            }
            let back = ((control & 31) << 8) + usize::from(*packed.get(at)?) + 1;
            at += 1;
            let from = out.len().checked_sub(back)?;
            for i in from..from + length + 2 {
                out.push(out[i]);
            }
        }
        if out.len() > size {
            return None;
        }
    }
    (out.len() == size).then_some(out)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn damaged_packings_are_refused_and_never_panic(
            packed in proptest::collection::vec(any::<u8>(), 0..200), size in 0_usize..4000,
        ) {
            prop_assert!(unpack(&packed, size).is_none_or(|bytes| bytes.len() == size));
        }
    }

    #[test]
    fn packings_are_unpacked() {
        // Three letters, then nine more that repeat them.
        assert_eq!(unpack(&[2, b'a', b'b', b'c', 0xE0, 0, 2], 12).unwrap(), b"abcabcabcabc");
    }
}
