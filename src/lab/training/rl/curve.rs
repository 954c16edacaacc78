//! The curve of a training as a picture.

use plotters::prelude::*;

use super::log::{Point, RlLog};
use crate::environment::courses::Stratum;
use crate::lab::training::TrainingError;

/// An SVG: share parked in training and in validation over the episodes.
pub(super) fn svg(log: &RlLog) -> Result<String, TrainingError> {
    let mut text = String::new();
    draw(&mut text, log).map_err(|e| TrainingError::Curve(e.to_string()))?;
    Ok(text)
}

fn draw(text: &mut String, log: &RlLog) -> Result<(), Box<dyn std::error::Error>> {
    let problems = (Stratum::COUNT * log.config.validation_count) as f64;
    let root = SVGBackend::with_string(text, (800, 500)).into_drawing_area();
    root.fill(&WHITE)?;
    let last = log.points.last().map_or(1, |p| p.episodes).max(1);
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("rl-{}: share parked", log.course.name()), ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d(0..last, 0.0..1.0)?;
    let percent = |v: &f64| format!("{:.0} %", 100.0 * v);
    chart.configure_mesh().x_desc("episodes").y_label_formatter(&percent).draw()?;
    type Line<'a> = (&'a str, RGBColor, &'a dyn Fn(&Point) -> f64);
    let lines: [Line; 3] = [
        ("training, since the point before", BLACK, &Point::success),
        ("validation, drawn actions", BLUE, &|p| f64::from(p.sampled.total()) / problems),
        ("validation, mean within the mask", RED, &|p| f64::from(p.mean.total()) / problems),
    ];
    for (name, colour, value) in lines {
        let points = log.points.iter().map(|p| (p.episodes, value(p)));
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    root.present()?;
    Ok(())
}
