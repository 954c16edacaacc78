//! The axes of plots: where values lie, and what is written beside them.

/// Share of a logarithmic axis that the value zero gets at its low end.
const ZERO: f64 = 0.1;

/// An axis with its title.
pub struct Axis {
    pub title: &'static str,
    /// A value in words.
    pub value: fn(f64) -> String,
    scale: Scale,
}

/// What lies where.
enum Scale {
    /// Logarithmic, over whole decades from 10^low to 10^high. With `zero` this has a place of its own.
    Decades { low: i32, high: i32, zero: bool, tick: fn(i32) -> String },
    /// From 1 to `top`, by the square root of the logarithm: what is near 1 is spread out.
    Over { top: f64 },
    /// From 0 to `top`, evenly, in per cent.
    Percent { top: f64 },
}

impl Axis {
    /// Logarithmic over the decades of `values`; one at least.
    pub fn decades(
        title: &'static str,
        zero: bool,
        tick: fn(i32) -> String,
        value: fn(f64) -> String,
        values: impl Iterator<Item = f64>,
    ) -> Self {
        let logs = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
        let range = logs.fold(None, |range: Option<(f64, f64)>, v| {
            Some(range.map_or((v, v), |(low, high)| (low.min(v), high.max(v))))
        });
        let (low, high) = range.unwrap_or((0.0, 1.0));
        let low = if zero { 0 } else { low.floor() as i32 };
        let high = (high.ceil() as i32).max(low + 1);
        Self { title, value, scale: Scale::Decades { low, high, zero, tick } }
    }

    /// For ratios of 1 and more.
    pub fn over_one(title: &'static str, values: impl Iterator<Item = f64>) -> Self {
        let top = values.filter(|v| v.is_finite()).fold(1.1, f64::max);
        Self { title, value: |v| format!("{v:.3}"), scale: Scale::Over { top } }
    }

    /// For shares in per cent.
    pub fn percent(title: &'static str, values: impl Iterator<Item = f64>) -> Self {
        let most = values.fold(0.0, f64::max);
        let top = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0].into_iter().find(|top| *top >= most);
        let scale = Scale::Percent { top: top.unwrap_or(100.0) };
        Self { title, value: |v| format!("{v:.1} %"), scale }
    }

    /// Where `v` lies, from 0 to 1.
    pub fn share(&self, v: f64) -> f64 {
        let share = match self.scale {
            Scale::Decades { zero, .. } if v <= 0.0 => return if zero { ZERO / 4.0 } else { 0.0 },
            Scale::Decades { low, high, zero, .. } => {
                let share = (v.log10() - f64::from(low)) / f64::from(high - low);
                let least = if zero { ZERO } else { 0.0 };
                least + (1.0 - least) * share.clamp(0.0, 1.0)
            }
            Scale::Over { top } => (v.max(1.0).ln() / top.ln()).sqrt(),
            Scale::Percent { top } => v / top,
        };
        share.clamp(0.0, 1.0)
    }

    /// Values to mark with their labels, which are `apart` from each other, as a share of the axis; where they
    /// would not be, the label is empty.
    pub fn ticks(&self, apart: f64) -> Vec<(f64, String)> {
        let values: Vec<(f64, String)> = match self.scale {
            Scale::Decades { low, high, zero, tick } => {
                let zero = zero.then(|| (0.0, "0".to_owned()));
                let decades = (low..=high).map(|d| (10f64.powi(d), tick(d)));
                zero.into_iter().chain(decades).collect()
            }
            Scale::Over { top } => {
                let marks =
                    [1.0, 1.01, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0, 100.0, 1e3, 1e6];
                marks.into_iter().filter(|v| *v <= top).map(|v| (v, v.to_string())).collect()
            }
            Scale::Percent { top } => {
                [0.0, 0.5, 1.0].map(|share| (share * top, format!("{} %", share * top))).to_vec()
            }
        };
        let mut last = f64::NEG_INFINITY;
        let spaced = |(value, label)| {
            let share = self.share(value);
            if share - last < apart - 1e-9 {
                return (value, String::new());
            }
            last = share;
            (value, label)
        };
        values.into_iter().map(spaced).collect()
    }
}

/// A power of ten in seconds.
pub fn seconds(decade: i32) -> String {
    let (unit, base) = match decade {
        ..-6 => ("ns", -9),
        -6..-3 => ("µs", -6),
        -3..0 => ("ms", -3),
        _ => ("s", 0),
    };
    format!("{} {unit}", 10i64.pow((decade - base).clamp(0, 18) as u32))
}

/// A power of ten as a count.
pub fn count(decade: i32) -> String {
    match decade {
        0..4 => 10u32.pow(decade as u32).to_string(),
        4..6 => format!("{}k", 10u32.pow(decade as u32 - 3)),
        _ => format!("{}M", 10u64.pow((decade - 6).clamp(0, 18) as u32)),
    }
}

/// A power of ten as a factor.
pub fn factor(decade: i32) -> String {
    10f64.powi(decade).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_keep_apart_and_values_within() {
        let values = [1.0, 1.003, 1.4, 2.57];
        let axis = Axis::over_one("cost", values.into_iter());
        let shares: Vec<f64> = values.iter().map(|v| axis.share(*v)).collect();
        assert!(shares[0] == 0.0 && shares[3] == 1.0 && shares.is_sorted(), "{shares:?}");
        let labels: Vec<(f64, String)> = axis.ticks(0.12);
        let named: Vec<f64> =
            labels.iter().filter(|l| !l.1.is_empty()).map(|l| axis.share(l.0)).collect();
        assert!(named.len() >= 4 && named.windows(2).all(|w| w[1] - w[0] >= 0.12), "{named:?}");
        let axis =
            Axis::decades("nodes", true, count, |v| v.to_string(), [3.0, 0.0, 2e4].into_iter());
        assert!(axis.share(0.0) < axis.share(1.0) && axis.share(2e5) == 1.0);
        assert_eq!(axis.ticks(0.0).last().unwrap().1, "100k");
        let axis = Axis::percent("failed", [0.0, 8.0].into_iter());
        assert_eq!(
            axis.ticks(0.1).iter().map(|t| &t.1[..]).collect::<Vec<_>>(),
            ["0 %", "5 %", "10 %"]
        );
        let nothing = Axis::decades("time", false, seconds, |v| v.to_string(), [].into_iter());
        assert_eq!(nothing.ticks(0.0).len(), 2);
    }
}
