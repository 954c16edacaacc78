//! Clouds of points: `.csv` with columns x, y and perhaps z, and `.pcd`.
//!
//! Every point is an obstacle, seen from above; which heights count is for [`MapOptions::heights`] to say. Points that are
//! not finite, as sensors have them where nothing came back, are passed over. A point that repeats the one before it is
//! dropped, which changes no collision.

use super::{Map, MapFile, MapOptions};
use crate::world::scene::SceneError;

/// The points that count, while they are read.
struct Cloud {
    points: Vec<[f64; 2]>,
    heights: [f64; 2],
    /// Least and largest z seen.
    seen: [f64; 2],
    not_finite: usize,
    outside: usize,
}

impl Cloud {
    fn new(options: &MapOptions, capacity: usize) -> Self {
        let (points, seen) = (Vec::with_capacity(capacity), [f64::INFINITY, f64::NEG_INFINITY]);
        Self { points, heights: options.heights, seen, not_finite: 0, outside: 0 }
    }

    fn add(&mut self, x: f64, y: f64, z: Option<f64>) {
        let z = z.unwrap_or(0.0);
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            self.not_finite += 1;
            return;
        }
        self.seen = [self.seen[0].min(z), self.seen[1].max(z)];
        if !(self.heights[0]..=self.heights[1]).contains(&z) {
            self.outside += 1;
        } else if self.points.last() != Some(&[x, y]) {
            self.points.push([x, y]);
        }
    }

    fn map(self, has_z: bool, file: MapFile) -> Result<Map, SceneError> {
        let [low, high] = self.heights;
        let is_limited = low > f64::NEG_INFINITY || high < f64::INFINITY;
        if is_limited && !has_z {
            return Err(
                file.invalid("z", "is missing, and heights are limited; expected a column z")
            );
        }
        if self.not_finite > 0 {
            tracing::warn!(
                "{}: {} points that are not finite are passed over",
                file.path.display(),
                self.not_finite
            );
        }
        if self.points.is_empty() {
            let why = match (self.outside, self.not_finite) {
                (0, _) => "that is finite".to_owned(),
                _ => format!(
                    "from z = {low} to {high} m; those there lie from {} to {}",
                    self.seen[0], self.seen[1]
                ),
            };
            return Err(file.format(format!("has no point {why}")));
        }
        if has_z && !is_limited && self.seen[1] - self.seen[0] > 0.05 {
            tracing::info!(
                "{}: heights from {} to {} m all count as obstacles; limit them (--z-min, --z-max) if the ground is among them",
                file.path.display(),
                self.seen[0],
                self.seen[1]
            );
        }
        let source = format!("cloud of {} points", self.points.len());
        Ok(Map { source, points: self.points, ..Map::default() })
    }
}

/// Whether the text of a `.csv` file is a cloud: it begins with names of columns, or every line has 2 numbers, or every line
/// has 3. Anything else is a TPCAP scene, whose numbers stand in one line as a rule.
pub(super) fn is_cloud(text: &str) -> bool {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let Some(first) = lines.next() else { return false };
    if header(first).is_some() {
        return true;
    }
    // The lines of a damaged cloud are still those of one.
    let count = |line: &str| line.split(',').count();
    let is_row = |line: &&str| count(line) == count(first);
    (2..=3).contains(&count(first)) && lines.take(3).all(|line| is_row(&line))
}

/// The names of columns, in lower case and without units, if the line has any: `x_m`, `X [m]` and `x` are the same.
fn header(line: &str) -> Option<Vec<String>> {
    let name = |field: &str| {
        let field = field.trim().trim_matches('"').to_ascii_lowercase();
        let end = field.find([' ', '[', '(', '_']).unwrap_or(field.len());
        field[..end].to_owned()
    };
    let is_name = |field: &str| field.trim().parse::<f64>().is_err() && !field.trim().is_empty();
    line.split(',').all(is_name).then(|| line.split(',').map(name).collect())
}

pub(super) fn csv(text: &str, options: &MapOptions, file: MapFile) -> Result<Map, SceneError> {
    // Blank lines before the first count as lines.
    let head = text.len() - text.trim_start().len();
    let mut at = text[..head].rfind('\n').map_or(0, |end| end + 1);
    let first = text[at..].lines().next().unwrap_or_default();
    let names = header(first);
    let (columns, count) = match &names {
        Some(names) => {
            at += first.len();
            let column = |name: &str| names.iter().position(|n| n == name);
            let needed = |name: &str| {
                let text = format!("is no column among {}; expected x and y", names.join(", "));
                column(name).ok_or_else(|| file.invalid(name, text))
            };
            ([needed("x")?, needed("y")?, column("z").unwrap_or(usize::MAX)], names.len())
        }
        None => ([0, 1, 2], first.split(',').count()),
    };
    let has_z = columns[2] < count;
    let mut cloud = Cloud::new(options, text.len() / 16);
    let mut values = vec![0.0; count];
    while at < text.len() {
        if let Some(end) = plain_row(text.as_bytes(), at, b',', &mut values) {
            at = end;
        } else {
            let line = text[at..].lines().next().unwrap_or_default();
            let number = || text[..at].matches('\n').count() + 1;
            at += line.len();
            // The line break, which may be two characters.
            at += text[at..].find('\n').map_or(text.len() - at, |end| end + 1);
            if line.trim().is_empty() {
                continue;
            }
            let fields: Vec<&str> = line.split(',').collect();
            if fields.len() != count {
                let text =
                    format!("line {} has {} fields; expected {count}", number(), fields.len());
                return Err(file.format(text));
            }
            for column in columns.into_iter().filter(|&column| column < count) {
                let field = fields[column].trim();
                values[column] = field.parse().map_err(|_| {
                    file.format(format!("line {} has {field:?}; expected a number", number()))
                })?;
            }
        }
        cloud.add(values[columns[0]], values[columns[1]], has_z.then(|| values[columns[2]]));
    }
    cloud.map(has_z, file)
}

/// Reads a line of plain numbers, as many as there are `values`, and says where the next begins; `None` where a number is not
/// plain. Those are of so few decimal digits that both the digits and the power of ten are exact, and so is their quotient
/// but for one rounding: the same result as the library's, in a third of the time.
fn plain_row(bytes: &[u8], from: usize, separator: u8, values: &mut [f64]) -> Option<usize> {
    const POWERS: [f64; 16] =
        [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (mut at, last) = (from, values.len().checked_sub(1)?);
    for (i, value) in values.iter_mut().enumerate() {
        let is_negative = bytes.get(at) == Some(&b'-');
        at += usize::from(is_negative);
        let begin = at;
        let (mut digits, mut point) = (0_u64, None);
        loop {
            match *bytes.get(at)? {
                b @ b'0'..=b'9' => {
                    digits = digits.wrapping_mul(10).wrapping_add(u64::from(b - b'0'))
                }
                b'.' if point.is_none() && at > begin => point = Some(at),
                _ => break,
            }
            at += 1;
        }
        if !(1..=16).contains(&(at - begin)) || digits >= 1 << 53 {
            return None;
        }
        let after = point.map_or(0, |point| at - point - 1);
        let size = digits as f64 / POWERS[after];
        *value = if is_negative { -size } else { size };
        match (i == last, bytes[at]) {
            (false, b) if b == separator => at += 1,
            (true, b'\n') => at += 1,
            (true, b'\r') if bytes.get(at + 1) == Some(&b'\n') => at += 2,
            _ => return None,
        }
    }
    Some(at)
}

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

pub(super) fn pcd(bytes: &[u8], options: &MapOptions, file: MapFile) -> Result<Map, SceneError> {
    let (head, from) = pcd_head(bytes, file)?;
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
fn pcd_head<'a>(bytes: &'a [u8], file: MapFile) -> Result<(Head<'a>, usize), SceneError> {
    let (mut lists, mut at) = (std::collections::HashMap::new(), 0);
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
        fn plain_numbers_are_read_as_the_library_reads_them(
            texts in proptest::collection::vec("-?[0-9]{1,9}(\\.[0-9]{0,9})?", 1..5),
        ) {
            let mut values = vec![0.0; texts.len()];
            let line = texts.join(",") + "\r\n";
            if let Some(end) = plain_row(line.as_bytes(), 0, b',', &mut values) {
                prop_assert_eq!(end, line.len());
                let bits: Vec<u64> = values.iter().map(|v| v.to_bits()).collect();
                let parsed = texts.iter().map(|text| text.parse::<f64>().unwrap().to_bits());
                prop_assert_eq!(bits, parsed.collect::<Vec<_>>());
            } else {
                prop_assert!(texts.iter().any(|text| text.trim_start_matches('-').len() > 15));
            }
        }

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
        // What is not plain is left to the library.
        for line in ["1e3\n", " 2.5\n", ".5\n", "nan\n", "1", "1,2\n", "\n", "-\n", "1..2\n"] {
            assert_eq!(plain_row(line.as_bytes(), 0, b',', &mut [0.0]), None, "{line}");
        }
    }

    #[test]
    fn clouds_and_scenes_are_told_apart() {
        for cloud in [
            "x,y\n1,2",
            "X [m], Y [m], Z [m]\n",
            "id,x_m,y_m,note\n",
            "1,2\n3,4",
            "1,2,3\n",
            "\n1,2\n",
        ] {
            assert!(is_cloud(cloud), "{cloud}");
        }
        for scene in ["1,2,3,4,5,6,0", "1\n2\n3", "1,2,3\n4,5,6\n0\n", "1,2,3\n4,5,6,0"] {
            assert!(!is_cloud(scene), "{scene}");
        }
    }
}
