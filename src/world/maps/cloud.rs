//! Clouds of points, and those of `.csv` files with columns x, y and perhaps z.
//!
//! Every point is an obstacle, seen from above; which heights count is for [`MapOptions::heights`] to say. Points that are
//! not finite, as sensors have them where nothing came back, are passed over. A point that repeats the one before it is
//! dropped, which changes no collision.

use super::{Map, MapFile, MapOptions};
use crate::world::scene::SceneError;

/// The points that count, while they are read.
pub(super) struct Cloud {
    points: Vec<[f64; 2]>,
    heights: [f64; 2],
    /// Least and largest z seen.
    seen: [f64; 2],
    not_finite: usize,
    outside: usize,
}

impl Cloud {
    pub fn new(options: &MapOptions, capacity: usize) -> Self {
        let (points, seen) = (Vec::with_capacity(capacity), [f64::INFINITY, f64::NEG_INFINITY]);
        Self { points, heights: options.heights, seen, not_finite: 0, outside: 0 }
    }

    pub fn add(&mut self, x: f64, y: f64, z: Option<f64>) {
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

    pub fn map(self, has_z: bool, file: MapFile) -> Result<Map, SceneError> {
        let [low, high] = self.heights;
        let is_limited = low > f64::NEG_INFINITY || high < f64::INFINITY;
        if is_limited && !has_z {
            return Err(
                file.invalid("z", "is missing, and heights are limited; expected a column z")
            );
        }
        if self.not_finite > 0 {
            log::warn!(
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
            log::info!(
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
            let begin = at;
            let number = || text[..begin].matches('\n').count() + 1;
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
pub(super) fn plain_row(
    bytes: &[u8],
    from: usize,
    separator: u8,
    values: &mut [f64],
) -> Option<usize> {
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
    }

    #[test]
    fn what_is_not_plain_is_left_to_the_library() {
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
