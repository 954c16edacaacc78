//! Columns scaled to mean 0 and standard deviation 1.

use serde::{Deserialize, Serialize};

/// Per-column affine scaling `(v − mean) / std`, stored with every network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normaliser {
    /// Mean of each column, in the column's own unit.
    pub mean: Vec<f32>,
    /// Standard deviation of each column, in the column's own unit; positive.
    pub std: Vec<f32>,
}

impl Normaliser {
    /// Below this spread a column counts as constant and is only centred.
    const CONSTANT: f64 = 1e-6;

    /// Fits means and standard deviations to `rows`, summed in double precision.
    ///
    /// # Panics
    ///
    /// When `rows` is empty.
    pub fn fit<const N: usize>(rows: &[[f32; N]]) -> Self {
        assert!(!rows.is_empty(), "a normaliser needs rows");
        let n = rows.len() as f64;
        let column = |c: usize| rows.iter().map(move |row| f64::from(row[c]));
        let mean: Vec<f64> = (0..N).map(|c| column(c).sum::<f64>() / n).collect();
        let std = (0..N).map(|c| {
            let std = (column(c).map(|v| (v - mean[c]).powi(2)).sum::<f64>() / n).sqrt();
            if std > Self::CONSTANT { std as f32 } else { 1.0 }
        });
        Self { std: std.collect(), mean: mean.iter().map(|&v| v as f32).collect() }
    }

    /// Raw values → normalised values.
    pub fn normalise<const N: usize>(&self, mut row: [f32; N]) -> [f32; N] {
        for ((v, mean), std) in row.iter_mut().zip(&self.mean).zip(&self.std) {
            *v = (*v - mean) / std;
        }
        row
    }

    /// Normalised values → raw values.
    pub fn restore<const N: usize>(&self, mut row: [f32; N]) -> [f32; N] {
        for ((v, mean), std) in row.iter_mut().zip(&self.mean).zip(&self.std) {
            *v = *v * std + mean;
        }
        row
    }

    /// Checks one read from a file against the number of columns it must have.
    pub fn check(&self, columns: usize) -> Result<(), String> {
        if self.mean.len() != columns || self.std.len() != columns {
            let (means, stds) = (self.mean.len(), self.std.len());
            return Err(format!(
                "normaliser: expected {columns} columns, got {means} means and {stds} stds"
            ));
        }
        if let Some(v) = self.mean.iter().find(|v| !v.is_finite()) {
            return Err(format!("normaliser: a mean is {v}; expected a finite number"));
        }
        if let Some(v) = self.std.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            return Err(format!("normaliser: a std is {v}; expected a positive number"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_to_unit_spread_and_back() {
        let rows = [[1.0, 5.0], [3.0, 5.0], [5.0, 5.0], [7.0, 5.0_f32]];
        let n = Normaliser::fit(&rows);
        assert_eq!(n.mean, [4.0, 5.0]);
        assert!((n.std[0] - 5.0_f32.sqrt()).abs() < 1e-6);
        assert_eq!(n.std[1], 1.0, "a constant column is only centred");
        for row in rows {
            let back = n.restore(n.normalise(row));
            assert!((back[0] - row[0]).abs() < 1e-6 && back[1] == row[1]);
        }
    }

    #[test]
    fn refuses_wrong_columns() {
        let n = Normaliser { mean: vec![0.0; 3], std: vec![1.0; 3] };
        assert!(n.check(4).unwrap_err().contains("expected 4 columns, got 3"));
        let n = Normaliser { mean: vec![0.0; 2], std: vec![1.0, 0.0] };
        assert!(n.check(2).is_err());
    }
}
