//! Every scene as a point: how long a method took, and how far its path is from the cheapest of any method.
//!
//! One panel for each world, type and level, a sign for each method. `points.js` leads from a point to its scene.

use std::fmt::Write;

use serde::Serialize;

use super::super::metrics::Group;
use super::super::table::{figures, kind_name, part_name};
use super::axis::{Axis, seconds};
use super::filter::{Setting, level_name, world};
use super::gallery::{Gallery, Run, SceneView};
use super::marks::{CROSS, points};
use super::plots::{PanelView, num};
use super::{escape, family};

/// Sizes, in the panel's own units (about a pixel).
const WIDTH: f64 = 400.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 44.0;
const RIGHT: f64 = 22.0;
/// Above the axes: the strip of failures.
const TOP: f64 = 26.0;
const FAILED: f64 = 12.0;
const BOTTOM: f64 = 40.0;

/// Signs of the methods of one family, around where they begin; in turn.
const SIGNS: [&str; 5] = [
    "h0",                                // a dot
    "m-2.5-2.5h5v5h-5z",                 // a square
    "m0-3.5l3.3 6h-6.6z",                // a triangle
    "m-3.2 0h6.4m-3.2-3.2v6.4",          // a plus
    "m0-3.6l3.3 3.6l-3.3 3.6l-3.3-3.6z", // a diamond
];

/// A method and its sign, for the legend.
#[derive(Serialize)]
pub struct Key {
    /// Index in the gallery.
    pub index: usize,
    pub method: String,
    pub family: &'static str,
    /// Class and path of the sign, in a box of 12 × 12.
    pub class: &'static str,
    pub path: String,
}

/// The signs of the methods that have any point.
pub fn keys(gallery: &Gallery) -> Vec<Key> {
    let key = |(index, method): (usize, &String)| {
        let (class, sign) = sign(gallery, index);
        let (method, family) = (method.clone(), family(method));
        Key { index, method, family, class, path: format!("M6 6{sign}") }
    };
    let runs = || gallery.scenes.iter().flat_map(|s| &s.runs).filter(|r| r.applies);
    let has_any = |(index, _): &(usize, &String)| runs().any(|r| r.method == *index);
    gallery.methods.iter().enumerate().filter(has_any).map(key).collect()
}

/// Class and sign of a method: the colour is its family's.
fn sign(gallery: &Gallery, method: usize) -> (&'static str, &'static str) {
    let is_same = |other: &&String| family(other) == family(&gallery.methods[method]);
    let before = gallery.methods[..method].iter().filter(is_same).count();
    let sign = SIGNS[before % SIGNS.len()];
    (if sign == SIGNS[0] { "dots" } else { "sign" }, sign)
}

/// The panels of `groups`, from the scenes of the gallery.
pub fn panels(groups: &[Group], gallery: &Gallery) -> Vec<PanelView> {
    let runs = || gallery.scenes.iter().flat_map(|s| &s.runs).filter(|r| r.applies);
    let axes = Axes {
        time: Axis::decades(
            "planning time",
            false,
            seconds,
            |v| format!("{} ms", figures(v * 1e3)),
            runs().map(|r| r.time),
        ),
        cost: Axis::over_one("cost / cheapest", runs().filter_map(|r| r.over)),
    };
    let panel = |g: &Group| {
        let is_of = |s: &&(usize, &SceneView)| {
            let scene = s.1;
            scene.world == world(&g.set)
                && scene.kind == kind_name(g.kind)
                && scene.level == level_name(g.level)
        };
        let all: Vec<(usize, &SceneView)> = gallery.scenes.iter().enumerate().collect();
        let scenes: Vec<(usize, &SceneView)> = all.iter().filter(is_of).copied().collect();
        let heading = format!("{}, {}", part_name(&g.set, g.level), kind_name(g.kind));
        PanelView {
            attributes: Setting::new(&g.set, g.kind, g.level).attributes(),
            svg: axes.draw(&heading, &scenes, gallery),
            heading,
        }
    };
    groups.iter().map(panel).collect()
}

struct Axes {
    time: Axis,
    cost: Axis,
}

impl Axes {
    fn x(&self, seconds: f64) -> f64 {
        LEFT + self.time.share(seconds) * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, cost: f64) -> f64 {
        let bottom = HEIGHT - BOTTOM;
        bottom - self.cost.share(cost) * (bottom - TOP)
    }

    fn draw(&self, heading: &str, scenes: &[(usize, &SceneView)], gallery: &Gallery) -> String {
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Time and cost of every scene, {}\">\n",
            escape(heading)
        );
        self.draw_axes(&mut svg);
        // Later methods on top.
        for (method, name) in gallery.methods.iter().enumerate() {
            let runs: Vec<(usize, &Run)> = scenes
                .iter()
                .filter_map(|&(index, scene)| {
                    let run = scene.runs.iter().find(|r| r.method == method && r.applies)?;
                    Some((index, run))
                })
                .collect();
            if runs.is_empty() {
                continue;
            }
            let _ = write!(
                svg,
                "<g class=\"f-{}\" data-method=\"{method}\" data-name=\"{}\">",
                family(name),
                escape(name)
            );
            let (class, sign) = sign(gallery, method);
            let at = |(index, run): &(usize, &Run)| {
                run.over.map(|cost| (self.x(run.time), self.y(cost), Some(*index)))
            };
            points(&mut svg, class, sign, runs.iter().filter_map(at));
            let failed = runs.iter().filter(|(_, run)| !run.ok);
            let failed = failed.map(|(i, run)| (self.x(run.time), FAILED, Some(*i)));
            points(&mut svg, "failed", CROSS, failed);
            svg += "</g>\n";
        }
        svg + "</svg>"
    }

    fn draw_axes(&self, svg: &mut String) {
        let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        for (value, label) in self.time.ticks(40.0 / (right - LEFT)) {
            let x = num(self.x(value));
            let _ = write!(svg, "<path class=\"grid\" d=\"M{x} {TOP}V{bottom}\"/>");
            let _ =
                write!(svg, "<text class=\"t\" x=\"{x}\" y=\"{}\">{label}</text>", bottom + 15.0);
        }
        for (value, label) in self.cost.ticks(14.0 / (bottom - TOP)) {
            let y = num(self.y(value));
            let _ = write!(svg, "<path class=\"grid\" d=\"M{LEFT} {y}H{right}\"/>");
            let _ = write!(
                svg,
                "<text class=\"m t\" x=\"{}\" y=\"{y}\" dy=\"4\">{label}</text>",
                LEFT - 6.0
            );
        }
        let _ = write!(
            svg,
            "<text class=\"m t\" x=\"{}\" y=\"{FAILED}\" dy=\"4\">failed</text>",
            LEFT - 6.0
        );
        let middle = (LEFT + right) / 2.0;
        let (below, beside) = (HEIGHT - 8.0, TOP - 3.0);
        let _ = write!(
            svg,
            "<text class=\"t\" x=\"{middle}\" y=\"{below}\">{}</text>",
            self.time.title
        );
        let _ = writeln!(
            svg,
            "<text class=\"t start\" x=\"{}\" y=\"{beside}\">{}</text>",
            LEFT + 3.0,
            self.cost.title
        );
    }
}
