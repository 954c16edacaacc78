//! A picture of a scene and of what a planner did in it, as SVG.
//!
//! [`scene_svg`] draws in the scene's own (world) frame, y axis up, and shows what
//! matters: start, goal, path, and the obstacles near them. The picture is one
//! self-contained `<svg>` without ids, so several may stand in one page.

use crate::curves::Path;
use crate::geometry::{Aabb, Polygon, Pose, Vec2};
use crate::vehicle::{Gear, Vehicle};
use crate::world::{Outline, Scene, Shape};

/// What to draw over a scene. Everything is optional and in the scene's frame; the
/// default draws the scene alone.
#[derive(Clone, Debug, Default)]
pub struct Drawing<'a> {
    /// Name of the method, for the title.
    pub method: Option<&'a str>,
    /// The path, with its length and direction changes in the title.
    pub path: Option<&'a Path>,
    /// The abstraction: the lane's and the spot's rectangle.
    pub regions: Option<[Polygon; 2]>,
    /// The preparatory pose (rear axle).
    pub preparatory: Option<Pose>,
    /// Goals that the scene has besides the one drawn as such.
    pub other_goals: Vec<Pose>,
    /// One more remark for the title, such as why there is no path.
    pub note: Option<&'a str>,
    /// Marked places to park in.
    pub spots: Vec<Polygon>,
    /// Whether the scene is a place alone, without start and goal.
    pub is_place_alone: bool,
}

/// Width of the picture, px.
const WIDTH: f64 = 960.0;
/// Least and largest height of the map, px.
const MAP_HEIGHT: [f64; 2] = [400.0, 720.0];
/// Height of the title above the map, px.
const TITLE: f64 = 58.0;
/// Height of a line of the legend, px.
const LEGEND_LINE: f64 = 24.0;
/// Free space around start, goal and path, metres.
const PADDING: f64 = 3.0;
/// The most of it without a path, where the picture is about the surroundings.
const PADDING_ALONE: f64 = 12.0;
/// Distance between the points of a drawn path, metres.
const STEP: f64 = 0.2;
/// Distance between the drawn footprints along a path, metres.
const FOOTPRINT_STEP: f64 = 0.8;

const INK: &str = "#1f2933";
const START: &str = "#1d4ed8";
const GOAL: &str = "#15803d";
const OTHER_GOAL: &str = r##"fill="none" stroke="#15803d" stroke-dasharray="3 4""##;
const TOLERANCE: &str = r##"fill="#15803d" fill-opacity=".25" stroke="#15803d""##;
const PREPARATORY: &str = "#8b2fc9";
const FORWARD: &str = "#2f7de1";
const BACKWARD: &str = "#e8710a";
/// Areas, lines and points that a car must keep off, and those that only wheels must.
const HIGH: [&str; 3] = [
    r##"fill="#aab2bd" stroke="#6b7684""##,
    r##"stroke="#6b7684" stroke-width="1.5""##,
    r##"fill="#52606d""##,
];
const LOW: [&str; 3] = [
    r##"fill="#e3d5b8" stroke="#a8894f""##,
    r##"stroke="#a8894f" stroke-width="1.5""##,
    r##"fill="#a8894f""##,
];
const BOUNDS: &str = r##"fill="none" stroke="#b4bdc8" stroke-dasharray="6 5""##;
const LANE: &str = r##"fill="#22c55e" fill-opacity=".13" stroke="#22a052" stroke-opacity=".6""##;
const SPOT: &str = r##"fill="#facc15" fill-opacity=".3" stroke="#ca9a04" stroke-opacity=".7""##;
const CHANGE: &str = r##"fill="#ffffff" stroke="#1f2933" stroke-width="2""##;

/// The picture of `scene` with `drawing` on it, as one SVG document.
pub fn scene_svg(scene: &Scene, drawing: &Drawing) -> String {
    let view = view(scene, drawing);
    let mut map = Map { view, scale: WIDTH / (view.max.x - view.min.x), svg: String::new() };
    map.scene(scene, drawing);
    let map_height = map.scale * (view.max.y - view.min.y);

    let legend = legend(scene, drawing);
    let legend_top = TITLE + map_height + 8.0;
    let (entries, lines) = place(&legend, legend_top);
    let height = num(legend_top + LEGEND_LINE * lines as f64 + 6.0);

    let name = escape(&scene.name);
    let facts = escape(&facts(drawing));
    let (width, map_height) = (num(WIDTH), num(map_height));
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="system-ui, sans-serif" font-size="13" fill="{INK}" role="img">
<title>{name}</title>
<rect width="{width}" height="{height}" fill="#ffffff"/>
<text x="14" y="25" font-size="18" font-weight="600">{name}</text>
<text x="14" y="46" fill="#52606d">{facts}</text>
<svg y="{TITLE}" width="{width}" height="{map_height}">
<rect width="{width}" height="{map_height}" fill="#f5f7fa"/>
{map}</svg>
{entries}</svg>
"##,
        map = map.svg,
    )
}

/// The title's second line.
fn facts(drawing: &Drawing) -> String {
    let mut facts: Vec<String> = drawing.method.map(str::to_owned).into_iter().collect();
    if let Some(path) = drawing.path {
        let changes = path.direction_changes();
        facts.push(format!("{:.1} m", path.length()));
        facts.push(format!("{changes} direction change{}", if changes == 1 { "" } else { "s" }));
    }
    facts.extend(drawing.note.map(str::to_owned));
    facts.join(" · ")
}

/// The part of the world to show, in the proportions of the picture.
fn view(scene: &Scene, drawing: &Drawing) -> Aabb {
    let corners = |pose| scene.vehicle.footprint_at(pose).vertices().to_vec();
    let mut shown = corners(scene.start);
    shown.extend(corners(scene.goal));
    shown.extend(drawing.other_goals.iter().flat_map(|&goal| corners(goal)));
    shown.extend(drawing.preparatory.into_iter().flat_map(corners));
    shown.extend(
        drawing.path.into_iter().flat_map(|p| p.sample(STEP)).flat_map(|s| corners(s.pose)),
    );
    shown.extend(drawing.regions.iter().flatten().flat_map(|r| r.vertices().to_vec()));
    let view = if drawing.is_place_alone {
        let spots = drawing.spots.iter().flat_map(|spot| spot.vertices().to_vec());
        let outlines: Vec<Outline> = scene.outlines().collect();
        Aabb::around(outlines.iter().flat_map(Outline::points).chain(spots)).inflated(PADDING)
    } else if drawing.path.is_some() {
        Aabb::around(shown).inflated(PADDING)
    } else {
        let near = Aabb::around(shown.iter().copied()).inflated(PADDING_ALONE);
        let outlines: Vec<Outline> = scene.outlines().collect();
        let all = Aabb::around(outlines.iter().flat_map(Outline::points).chain(shown));
        let all = all.inflated(PADDING / 2.0);
        Aabb { min: near.min.sup(&all.min), max: near.max.inf(&all.max) }
    };
    let (w, h) = (view.max.x - view.min.x, view.max.y - view.min.y);
    let more_width = (h * WIDTH / MAP_HEIGHT[1] - w).max(0.0) / 2.0;
    let more_height = ((w + 2.0 * more_width) * MAP_HEIGHT[0] / WIDTH - h).max(0.0) / 2.0;
    let more = Vec2::new(more_width, more_height);
    Aabb { min: view.min - more, max: view.max + more }
}

/// The map under construction; pixels run right and down from the view's upper left.
struct Map {
    view: Aabb,
    /// Pixels per metre.
    scale: f64,
    svg: String,
}

impl Map {
    fn scene(&mut self, scene: &Scene, drawing: &Drawing) {
        let (vehicle, view) = (&scene.vehicle, self.view);
        if let Some([x0, y0, x1, y1]) = scene.bounds {
            self.polygon(&Aabb::new(x0, y0, x1, y1).corners(), BOUNDS);
        }
        if let Some([lane, spot]) = &drawing.regions {
            self.polygon(lane.vertices(), LANE);
            self.polygon(spot.vertices(), SPOT);
        }
        let is_near = |o: &Outline| Aabb::around(o.points()).intersects(&view);
        for outline in scene.outlines().filter(is_near) {
            let vertices: Vec<Vec2> = outline.points().collect();
            let [area, line, dot] = if outline.is_low { LOW } else { HIGH };
            match outline.shape {
                Shape::Point => self.dot(vertices[0], 2.2, dot),
                Shape::Solid => self.polygon(&vertices, area),
                Shape::Chain => self.line(&vertices, line),
                Shape::Border => self.polygon(&vertices, &format!("fill=\"none\" {line}")),
            }
        }
        for spot in &drawing.spots {
            self.polygon(spot.vertices(), SPOT);
        }
        if drawing.is_place_alone {
            self.scale_bar();
            return;
        }
        if let Some(path) = drawing.path {
            self.footprints(path, vehicle);
        }
        for goal in &drawing.other_goals {
            self.polygon(vehicle.footprint_at(*goal).vertices(), OTHER_GOAL);
        }
        self.car(scene.goal, vehicle, GOAL, "");
        if let Some(tolerance) = scene.goal_tolerance {
            let radius = self.scale * tolerance.position_m;
            self.dot(scene.goal.position(), radius, TOLERANCE);
        }
        if let Some(pose) = drawing.preparatory {
            self.car(pose, vehicle, PREPARATORY, r#" stroke-dasharray="7 4""#);
        }
        self.car(scene.start, vehicle, START, "");
        if let Some(path) = drawing.path {
            self.path(path);
        }
        self.scale_bar();
    }

    fn point(&self, p: Vec2) -> (f64, f64) {
        (self.scale * (p.x - self.view.min.x), self.scale * (self.view.max.y - p.y))
    }

    /// The points as SVG coordinates.
    fn points(&self, points: impl IntoIterator<Item = Vec2>) -> String {
        let pairs = points.into_iter().map(|p| self.point(p));
        pairs.map(|(x, y)| format!("{},{}", num(x), num(y))).collect::<Vec<_>>().join(" ")
    }

    fn polygon(&mut self, vertices: &[Vec2], style: &str) {
        let points = self.points(vertices.iter().copied());
        self.svg += &format!("<polygon points=\"{points}\" {style}/>\n");
    }

    fn line(&mut self, points: &[Vec2], style: &str) {
        let points = self.points(points.iter().copied());
        self.svg += &format!("<polyline points=\"{points}\" fill=\"none\" {style}/>\n");
    }

    fn dot(&mut self, p: Vec2, radius: f64, style: &str) {
        let (x, y) = self.point(p);
        self.svg += &format!(r#"<circle cx="{}" cy="{}" r="{radius}" {style}/>"#, num(x), num(y));
        self.svg.push('\n');
    }

    /// A footprint with an arrow from the rear axle along the heading.
    fn car(&mut self, pose: Pose, vehicle: &Vehicle, colour: &str, dashes: &str) {
        let body = vehicle.footprint_at(pose);
        let style =
            format!(r#"fill="{colour}" fill-opacity=".1" stroke="{colour}" stroke-width="2""#);
        self.polygon(body.vertices(), &format!("{style}{dashes}"));
        let tip = 0.8 * vehicle.front_extent();
        let (head, half) = (0.2 * vehicle.length, 0.16 * vehicle.width);
        let at = |x, y| pose.point_to_parent(Vec2::new(x, y));
        let shaft = format!(r#"stroke="{colour}" stroke-width="2""#);
        self.line(&[pose.position(), at(tip - 0.8 * head, 0.0)], &shaft);
        let arrow = [at(tip, 0.0), at(tip - head, half), at(tip - head, -half)];
        self.polygon(&arrow, &format!(r#"fill="{colour}""#));
        self.dot(pose.position(), 3.0, &format!(r#"fill="{colour}""#));
    }

    /// Where the car has been, faintly.
    fn footprints(&mut self, path: &Path, vehicle: &Vehicle) {
        let mut driven = 0.0;
        let mut last: Option<Pose> = None;
        for sample in path.sample(STEP) {
            driven += last.map_or(0.0, |p| p.distance(sample.pose));
            last = Some(sample.pose);
            if driven >= FOOTPRINT_STEP {
                driven = 0.0;
                let colour = colour(sample.gear);
                let style = format!(
                    r#"fill="{colour}" fill-opacity=".04" stroke="{colour}" stroke-opacity=".28""#
                );
                self.polygon(vehicle.footprint_at(sample.pose).vertices(), &style);
            }
        }
    }

    /// The rear axle's way, and where the direction changes.
    fn path(&mut self, path: &Path) {
        let samples = path.sample(STEP);
        let mut changes = Vec::new();
        let mut from = 0;
        for i in 1..samples.len() {
            let gear = samples[i - 1].gear;
            let ends = i + 1 == samples.len();
            if ends || samples[i].gear != gear {
                let run: Vec<Vec2> = samples[from..=i].iter().map(|s| s.pose.position()).collect();
                let style = format!(
                    r#"stroke="{}" stroke-width="3" stroke-linejoin="round""#,
                    colour(gear)
                );
                self.line(&run, &style);
                from = i;
                if !ends {
                    changes.push(samples[i].pose.position());
                }
            }
        }
        for p in changes {
            self.dot(p, 4.5, CHANGE);
        }
    }

    fn scale_bar(&mut self) {
        let y = self.scale * (self.view.max.y - self.view.min.y) - 16.0;
        let (a, b) = (16.0, 16.0 + 5.0 * self.scale);
        let (top, left, right) = (num(y - 5.0), num(a), num(b));
        let middle = num((a + b) / 2.0);
        let (box_top, box_width) = (num(y - 20.0), num(b - a + 16.0));
        self.svg += &format!(
            r##"<rect x="{}" y="{box_top}" width="{box_width}" height="28" rx="4" fill="#ffffff" fill-opacity=".85"/>
<path d="M{left} {top}v5H{right}v-5" fill="none" stroke="{INK}" stroke-width="1.5"/>
<text x="{middle}" y="{top}" text-anchor="middle" font-size="12">5 m</text>
"##,
            num(a - 8.0),
        );
    }
}

fn colour(gear: Gear) -> &'static str {
    match gear {
        Gear::Forward => FORWARD,
        Gear::Backward => BACKWARD,
    }
}

/// One line of the legend: its sign, 26 × 14 px, and what it means.
type Entry = (String, &'static str);

/// What the picture shows, and only that.
fn legend(scene: &Scene, drawing: &Drawing) -> Vec<Entry> {
    let area = |style: &str| format!(r#"<rect x="1" y="1" width="24" height="12" {style}/>"#);
    let car = |colour: &str, dashes: &str| {
        let style =
            format!(r#"fill="{colour}" fill-opacity=".1" stroke="{colour}" stroke-width="2""#);
        area(&format!("{style}{dashes}"))
            + &format!(r#"<path d="M5 7h10" stroke="{colour}" stroke-width="2"/>"#)
            + &format!(r#"<path d="M21 7l-7 3.5v-7z" fill="{colour}"/>"#)
    };
    let line = |colour: &str| format!(r#"<path d="M0 7h26" stroke="{colour}" stroke-width="3"/>"#);
    let dot = |style: &str| format!(r#"<circle cx="13" cy="7" r="4.5" {style}/>"#);

    let mut entries = vec![(car(START, ""), "start"), (car(GOAL, ""), "goal")];
    if drawing.is_place_alone {
        entries.clear();
    }
    if !drawing.other_goals.is_empty() {
        entries.push((area(OTHER_GOAL), "other goals"));
    }
    if scene.goal_tolerance.is_some() {
        entries.push((dot(TOLERANCE), "goal tolerance"));
    }
    if drawing.preparatory.is_some() {
        entries.push((car(PREPARATORY, r#" stroke-dasharray="5 3""#), "preparatory pose"));
    }
    if let Some(path) = drawing.path {
        let drives = |gear| path.segments.iter().any(|s| s.gear() == gear);
        for (gear, what) in [(Gear::Forward, "forward"), (Gear::Backward, "backward")] {
            if drives(gear) {
                entries.push((line(colour(gear)), what));
            }
        }
        if path.direction_changes() > 0 {
            entries.push((dot(CHANGE), "direction change"));
        }
    }
    if drawing.regions.is_some() {
        entries.push((area(LANE), "lane"));
    }
    if drawing.regions.is_some() || !drawing.spots.is_empty() {
        entries.push((area(SPOT), "spot"));
    }
    for (style, what, is_low) in [(HIGH[0], "obstacle", false), (LOW[0], "low: wheels only", true)]
    {
        if scene.outlines().any(|o| o.is_low == is_low) {
            entries.push((area(style), what));
        }
    }
    if scene.bounds.is_some() {
        entries.push((area(BOUNDS), "bounds"));
    }
    entries
}

/// The legend's lines from y = `top` px, and how many there are.
fn place(entries: &[Entry], top: f64) -> (String, usize) {
    let (mut svg, mut x, mut line) = (String::new(), 14.0, 0);
    for (sign, what) in entries {
        let width = 46.0 + 6.8 * what.len() as f64;
        if x + width > WIDTH {
            (x, line) = (14.0, line + 1);
        }
        let y = top + LEGEND_LINE * line as f64;
        svg += &format!(
            "<g transform=\"translate({} {})\">{sign}<text x=\"33\" y=\"11.5\">{what}</text></g>\n",
            num(x),
            num(y)
        );
        x += width;
    }
    (svg, line + 1)
}

/// A coordinate to a tenth of a pixel, as short as possible.
fn num(v: f64) -> String {
    let tenths = (v * 10.0).round() / 10.0;
    // Adding zero turns −0 into 0.
    (tenths + 0.0).to_string()
}

/// `text` as XML text.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
