//! A picture of a trajectory: speed, steering angle and curvature over time, as an SVG document.

use std::fmt::Write;

use super::TrajectoryFile;
use super::drawing::escape;
use crate::curves::trajectory::Moment;

const WIDTH: f64 = 900.0;
const PANEL: f64 = 150.0;
const GAP: f64 = 34.0;
const TOP: f64 = 72.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 20.0;
const INK: &str = "#1f2933";
const FAINT: &str = "#cbd2d9";

/// One curve over time and what bounds it.
struct Panel {
    title: &'static str,
    colour: &'static str,
    value: fn(&Moment) -> f64,
    /// What the value keeps between.
    limits: [f64; 2],
}

/// The picture of a trajectory; where the car stands its time is shaded.
pub fn trajectory_svg(file: &TrajectoryFile) -> String {
    let vehicle = &file.vehicle;
    let (steer, curvature) = (vehicle.max_steer, vehicle.max_curvature());
    let panels = [
        Panel {
            title: "speed, m/s",
            colour: "#2563eb",
            value: |m| m.speed,
            limits: [-vehicle.backward_speed, vehicle.forward_speed],
        },
        Panel {
            title: "steering angle, rad",
            colour: "#c2410c",
            value: |m| m.steer,
            limits: [-steer, steer],
        },
        Panel {
            title: "curvature, 1/m",
            colour: "#15803d",
            value: |m| m.curvature,
            limits: [-curvature, curvature],
        },
    ];
    let moments = &file.moments;
    let end = moments.last().map_or(0.0, |m| m.time).max(1e-3);
    let across = |time: f64| LEFT + (WIDTH - LEFT - RIGHT) * time / end;
    let mut svg = String::new();
    for (i, panel) in panels.iter().enumerate() {
        let top = TOP + i as f64 * (PANEL + GAP);
        let [low, high] = panel.limits;
        let down = |value: f64| top + PANEL * (high - value) / (high - low);
        for still in moments.chunk_by(|a, b| a.distance == b.distance) {
            let [begin, end] = [&still[0], &still[still.len() - 1]].map(|m| across(m.time));
            let width = end - begin;
            if width > 0.0 {
                let _ = write!(
                    svg,
                    r##"<rect x="{begin:.2}" y="{top:.1}" width="{width:.2}" height="{PANEL}" fill="#e4e7eb"/>"##
                );
            }
        }
        for (value, dash) in [(low, "4 4"), (0.0, "none"), (high, "4 4")] {
            let y = down(value);
            let _ = write!(
                svg,
                r#"<line x1="{LEFT}" x2="{}" y1="{y:.1}" y2="{y:.1}" stroke="{FAINT}" stroke-dasharray="{dash}"/><text x="{}" y="{:.1}" text-anchor="end">{value:.2}</text>"#,
                WIDTH - RIGHT,
                LEFT - 8.0,
                y + 4.0,
            );
        }
        let _ = write!(
            svg,
            r#"<text x="{LEFT}" y="{:.1}" font-weight="600">{}</text>"#,
            top - 8.0,
            panel.title
        );
        let mut points = String::new();
        let mut before: Option<f64> = None;
        for m in moments {
            let (x, y) = (across(m.time), down((panel.value)(m)));
            // What jumps is drawn as a step.
            let jumps = before.is_some_and(|b| (b - y).abs() > 0.1 * PANEL);
            if let Some(b) = before.filter(|_| jumps) {
                let _ = write!(points, "{x:.2},{b:.2} ");
            }
            let _ = write!(points, "{x:.2},{y:.2} ");
            before = Some(y);
        }
        let _ = write!(
            svg,
            r#"<polyline points="{}" fill="none" stroke="{}" stroke-width="2"/>"#,
            points.trim_end(),
            panel.colour
        );
    }
    let bottom = TOP + panels.len() as f64 * (PANEL + GAP) - GAP;
    // Whole seconds, about ten of them.
    let step = (end / 10.0).ceil().max(1.0);
    for i in 0..=(end / step) as u32 {
        let time = f64::from(i) * step;
        let x = across(time);
        let _ = write!(
            svg,
            r#"<line x1="{x:.1}" x2="{x:.1}" y1="{bottom:.1}" y2="{:.1}" stroke="{INK}"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{time:.0} s</text>"#,
            bottom + 5.0,
            bottom + 20.0,
        );
    }
    let height = bottom + 34.0;
    let facts = format!(
        "{} · {:.1} m in {:.1} s, {:.1} s of it at standstill · limits are dashed",
        file.method, file.report.distance_m, file.report.duration_s, file.report.standing_s
    );
    let (name, facts) = (escape(&file.scene), escape(&facts));
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" font-family="system-ui, sans-serif" font-size="12" fill="{INK}" role="img">
<title>{name}</title>
<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>
<text x="14" y="22" font-size="16" font-weight="600">{name}</text>
<text x="14" y="40" fill="#52606d">{facts}</text>
{svg}
</svg>
"##
    )
}
