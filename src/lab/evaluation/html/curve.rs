//! The learning curve as SVG: one panel for each parking type.

use std::fmt::Write;

use super::super::learning_curve::CurvePoint;
use super::filter::Setting;
use super::plots::{PanelView, num};
use super::{escape, family};

/// Sizes, in the panel's own units (about a pixel).
const WIDTH: f64 = 400.0;
const HEIGHT: f64 = 250.0;
const LEFT: f64 = 46.0;
const RIGHT: f64 = 66.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 44.0;

/// The panels, in the order in which the types first occur.
pub fn panels(points: &[CurvePoint]) -> Vec<PanelView> {
    let mut kinds = Vec::new();
    for p in points {
        if !kinds.contains(&p.kind) {
            kinds.push(p.kind);
        }
    }
    let panel = |kind| {
        let mine: Vec<&CurvePoint> = points.iter().filter(|p| p.kind == kind).collect();
        let heading = kind.to_string();
        let attributes = Setting::of_kind(heading.clone()).attributes();
        PanelView { svg: draw(&heading, &mine), heading, attributes }
    };
    kinds.into_iter().map(panel).collect()
}

/// Where a panel's samples lie: whole decades around them.
struct Scale {
    low: i32,
    high: i32,
}

impl Scale {
    fn around(points: &[&CurvePoint]) -> Self {
        let logs = points.iter().map(|p| (p.samples.max(1) as f64).log10());
        let (low, high) =
            logs.fold((f64::MAX, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
        let low = low.min(high).floor() as i32;
        Self { low, high: (high.ceil() as i32).max(low + 1) }
    }

    fn x(&self, samples: f64) -> f64 {
        let share =
            (samples.max(1.0).log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        LEFT + share * (WIDTH - LEFT - RIGHT)
    }
}

/// Where a share lies, per cent.
fn y(percent: f64) -> f64 {
    TOP + (1.0 - percent / 100.0) * (HEIGHT - TOP - BOTTOM)
}

fn draw(kind: &str, points: &[&CurvePoint]) -> String {
    let scale = Scale::around(points);
    let mut methods: Vec<&str> = points.iter().map(|p| p.method.as_str()).collect();
    methods.sort_unstable();
    methods.dedup();
    // The finest grid makes the line; the others stand beside it.
    let finest = |p: &CurvePoint| [p.lane_step_m, p.spot_step_m, p.dead_end_step_m];
    let least = |i: usize| points.iter().map(|p| finest(p)[i]).fold(f64::MAX, f64::min);
    let least = [0, 1, 2].map(least);

    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\"><title>Learning curve, {kind}</title>\n"
    );
    let bottom = HEIGHT - BOTTOM;
    for decade in scale.low..=scale.high {
        let (x, label) = (num(scale.x(10f64.powi(decade))), 10u64.pow(decade.clamp(0, 18) as u32));
        let _ = write!(svg, "<path class=\"grid\" d=\"M{x} {TOP}V{bottom}\"/>");
        let _ = write!(svg, "<text class=\"t\" x=\"{x}\" y=\"{}\">{label}</text>", bottom + 15.0);
    }
    for percent in [0.0, 25.0, 50.0, 75.0, 100.0] {
        let (y, right) = (num(y(percent)), WIDTH - RIGHT);
        let _ = write!(svg, "<path class=\"grid\" d=\"M{LEFT} {y}H{right}\"/>");
        let _ = write!(
            svg,
            "<text class=\"t\" x=\"{}\" y=\"{y}\" dy=\"4\">{percent} %</text>",
            LEFT - 20.0
        );
    }
    let (x, below) = ((LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 10.0);
    let _ = writeln!(svg, "<text class=\"t\" x=\"{x}\" y=\"{below}\">solved samples</text>");
    for method in methods {
        let _ = write!(svg, "<g class=\"f-{}\">", family(method));
        let mine = || points.iter().filter(|p| p.method == method);
        let (mut line, others): (Vec<&CurvePoint>, Vec<&CurvePoint>) =
            mine().copied().partition(|p| finest(p) == least);
        line.sort_by_key(|p| p.samples);
        let at = |p: &CurvePoint| (scale.x(p.samples as f64), y(p.without_search_percent()));
        let d: String = line
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let (x, y) = at(p);
                format!("{}{} {}", if i == 0 { 'M' } else { 'L' }, num(x), num(y))
            })
            .collect();
        let _ = write!(svg, "<path class=\"ci\" d=\"{d}\"/>");
        for p in &line {
            let (x, y) = at(p);
            let (x, y, title) = (num(x), num(y), escape(&describe(p)));
            let _ = write!(
                svg,
                "<circle class=\"mean\" cx=\"{x}\" cy=\"{y}\" r=\"4\"><title>{title}</title></circle>"
            );
        }
        for p in &others {
            let (x, y) = at(p);
            let (d, title) = (format!("M{} {}", num(x), num(y - 5.0)), escape(&describe(p)));
            let _ = write!(
                svg,
                "<path class=\"mean ref\" d=\"{d}l5 5l-5 5l-5-5z\"><title>{title}</title></path>"
            );
        }
        if let Some((x, y)) = line.last().or(others.last()).map(|p| at(p)) {
            let (x, y, name) = (num(x + 9.0), num(y + 4.0), escape(method));
            let _ = write!(svg, "<text class=\"label\" x=\"{x}\" y=\"{y}\">{name}</text>");
        }
        svg += "</g>\n";
    }
    svg + "</svg>"
}

fn describe(p: &CurvePoint) -> String {
    format!(
        "{}: {} samples, {} in each cell, grid steps {} m: {:.1} % without search, {:.1} nodes on \
         average, {} failures",
        p.method,
        p.samples,
        p.samples_per_cell,
        p.steps(),
        p.without_search_percent(),
        p.mean_nodes,
        p.failures
    )
}

#[cfg(test)]
mod tests {
    use super::super::super::learning_curve::tests::point;
    use super::*;

    #[test]
    fn lines_join_the_finest_grid_and_others_stand_apart() {
        let mut coarse = point("n3p", 500);
        coarse.spot_step_m = 0.5;
        let points = [point("n3p", 100), point("n3p", 1000), coarse, point("knn-n3p", 10)];
        let panels = panels(&points);
        assert_eq!((panels.len(), &panels[0].heading[..]), (1, "reverse"));
        let svg = &panels[0].svg;
        assert_eq!(svg.matches("<circle").count(), 3);
        assert_eq!(svg.matches("mean ref").count(), 1);
        assert!(svg.contains(">1000<") && svg.contains("50.0 % without search"), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn no_points_no_panels() {
        assert!(super::panels(&[]).is_empty());
    }
}
