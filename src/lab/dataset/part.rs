//! Sharing a collection among processes: `--shard 2/3`.

use std::fmt;
use std::str::FromStr;

/// A share of the shards: every `of`-th, from the `number`-th on; written `2/3`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    number: usize,
    of: usize,
}

impl Default for Part {
    fn default() -> Self {
        Self::ALL
    }
}

impl Part {
    /// All shards.
    pub const ALL: Part = Part { number: 1, of: 1 };

    /// Whether the shard with this index belongs to the part.
    pub fn contains(self, shard: usize) -> bool {
        shard % self.of == self.number - 1
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.split_once('/')
            .and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)))
            .filter(|(number, of)| (1..=*of).contains(number))
            .map(|(number, of)| Part { number, of })
            .ok_or_else(|| "expected i/n with 1 ≤ i ≤ n, such as 2/3".to_owned())
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_the_shards() {
        let parts: Vec<Part> = ["1/3", "2/3", "3/3"].map(|p| p.parse().unwrap()).to_vec();
        for shard in 0..10 {
            assert_eq!(parts.iter().filter(|p| p.contains(shard)).count(), 1);
        }
        for bad in ["", "0/3", "4/3", "1", "1/0", "a/b", "1/3/5", "-1/3"] {
            assert!(bad.parse::<Part>().is_err(), "{bad}");
        }
        assert_eq!(parts[1].to_string(), "2/3");
    }
}
