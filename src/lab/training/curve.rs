//! The loss curve as a picture.

use plotters::prelude::*;

use super::TrainingError;

/// Losses of one epoch.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EpochLoss {
    /// Mean loss over the training rows, while they were learnt.
    pub train: f32,
    /// Mean loss over the validation rows, after the epoch.
    pub validation: f32,
}

/// A line of the stream of a training ([`super::watch`]).
#[derive(serde::Serialize)]
pub(super) struct EpochLine<'a> {
    /// What is trained.
    pub name: &'a str,
    /// The epoch, from 1, and how many there may be.
    pub epoch: usize,
    pub epochs: usize,
    pub learning_rate: f64,
    #[serde(flatten)]
    pub loss: EpochLoss,
}

/// An SVG with training and validation loss over the epochs, loss logarithmic.
pub fn svg(title: &str, losses: &[EpochLoss]) -> Result<String, TrainingError> {
    let mut text = String::new();
    draw(&mut text, title, losses).map_err(|e| TrainingError::Curve(e.to_string()))?;
    Ok(text)
}

fn draw(
    text: &mut String,
    title: &str,
    losses: &[EpochLoss],
) -> Result<(), Box<dyn std::error::Error>> {
    let values = losses.iter().flat_map(|l| [l.train, l.validation]);
    let (low, high) = values.fold((f32::MAX, f32::MIN_POSITIVE), |(low, high), v| {
        (low.min(v.max(f32::MIN_POSITIVE)), high.max(v))
    });
    let (low, high) = with_a_label(low.min(high) * 0.8, high * 1.25);
    let root = SVGBackend::with_string(text, (800, 500)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(1..losses.len().max(2), (low..high).log_scale())?;
    let label = |v: &f32| {
        let digits = (-v.log10().floor()).max(0.0) as usize;
        format!("{v:.digits$}")
    };
    chart.configure_mesh().x_desc("epoch").y_desc("loss").y_label_formatter(&label).draw()?;
    for (name, colour) in [("training", BLUE), ("validation", RED)] {
        let value = |l: &EpochLoss| if name == "training" { l.train } else { l.validation };
        let points = losses.iter().enumerate().map(|(i, l)| (i + 1, value(l)));
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
    root.present()?;
    Ok(())
}

/// The range from `low` to `high`, widened to the nearest power of ten where it holds none: these
/// are what a logarithmic axis has labels at.
fn with_a_label(low: f32, high: f32) -> (f32, f32) {
    let below = 10_f32.powf(high.log10().floor());
    let above = 10_f32.powf(low.log10().ceil());
    match () {
        () if below >= low => (low, high),
        () if low / below < above / high => (0.9 * below, high),
        () => (low, 1.1 * above),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_both_lines() {
        let losses: Vec<_> = (1..=30)
            .map(|i| EpochLoss { train: 1.0 / i as f32, validation: 1.2 / i as f32 })
            .collect();
        let text = svg("mlp parallel", &losses).unwrap();
        assert!(text.starts_with("<svg") && text.contains("validation") && text.contains("epoch"));
        assert!(svg("one epoch", &losses[..1]).is_ok());
    }

    #[test]
    fn every_axis_has_a_label() {
        for (values, label) in [([0.015, 0.03], "0.01"), ([0.05, 0.07], "0.1"), ([3.0, 0.5], "1")] {
            let losses = values.map(|v| EpochLoss { train: v, validation: v });
            let text = svg("", &losses).unwrap();
            let line = text.lines().any(|l| l.trim() == label);
            assert!(line, "{values:?}: no label {label} in {text}");
        }
    }
}
