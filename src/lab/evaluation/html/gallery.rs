//! The gallery's data: scenes and what every method did in them, as JSON for the page.
//!
//! Paths are stored as their motions, to the micrometre; the page drives them itself. Everything
//! else is for looking at and is rounded to millimetres.

use std::collections::{HashMap, HashSet};

use serde::{Deserialize, Serialize};

use super::super::table::kind_name;
use super::super::trace::{Trace, mm};
use super::filter::{level_name, world};
use crate::curves::{Path, Segment};
use crate::episode::Case;
use crate::episode::Row;
use crate::geometry::{Aabb, Pose, Vec2};
use crate::vehicle::Vehicle;
use crate::world::{DrivableArea, Outline, Scene, Shape};

/// Runs of no more scenes are shown whole.
pub const ALL: usize = 1000;
/// Of longer ones these of each world, type and level: the first, and further ones in which a method failed.
pub const FIRST: usize = 10;
/// The most of those in which a method failed.
pub const FAILED: usize = 20;

/// Free space around what is shown, metres.
const PADDING: f64 = 2.5;

/// The scenes of a run that the page shows: all, or of a long one the first few of every type and level, and
/// those in which a method failed, as long as there are not too many.
pub fn chosen<'a>(cases: &'a [Case], rows: &[Row]) -> Vec<&'a Case> {
    if cases.len() <= ALL {
        return cases.iter().collect();
    }
    let failed: HashSet<&str> =
        rows.iter().filter(|r| !r.ok && r.applies()).map(|r| r.scene.as_str()).collect();
    let mut counts: HashMap<_, (usize, usize)> = HashMap::new();
    let is_chosen = |case: &&Case| {
        let (first, more) = counts.entry((case.set.clone(), case.kind, case.level)).or_default();
        if *first < FIRST {
            *first += 1;
            return true;
        }
        let chosen = *more < FAILED && failed.contains(case.scene.name.as_str());
        *more += usize::from(chosen);
        chosen
    };
    cases.iter().filter(is_chosen).collect()
}

/// All that the gallery draws.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gallery {
    /// The methods' names.
    pub methods: Vec<String>,
    /// The vehicles of the scenes.
    pub vehicles: Vec<Vehicle>,
    /// The scenes.
    pub scenes: Vec<SceneView>,
}

/// One scene, in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneView {
    /// Its name.
    pub name: String,
    /// Its world: the name of its set, or `files`.
    pub world: String,
    /// Its parking type, or `–`.
    #[serde(rename = "type")]
    pub kind: String,
    /// Its level, or `–`.
    pub level: String,
    /// Index of its vehicle.
    pub vehicle: usize,
    /// Rear-axle start.
    pub start: Pose,
    /// Rear-axle goal.
    pub goal: Pose,
    /// What to show: least x and y, greatest x and y.
    pub view: [f64; 4],
    /// What is near, named as in the format of scenes, so that pages draw both alike.
    #[serde(flatten)]
    pub around: Outlines,
    /// That of it which only wheels keep off.
    #[serde(default, skip_serializing_if = "Outlines::is_empty")]
    pub low: Outlines,
    /// The drivable area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drivable_area: Option<DrivableArea>,
    /// The scene's bounds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[f64; 4]>,
    /// What the methods did, in the order of the rows.
    pub runs: Vec<Run>,
}

/// Outlines near what is shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Outlines {
    /// Polygons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// Walls and other chains.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub polylines: Vec<Vec<[f64; 2]>>,
    /// Points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
}

impl Outlines {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// One method in one scene: its row, and its trace if there is one. What is usual is left out of the JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Run {
    /// Index of the method.
    pub method: usize,
    /// As in the row.
    #[serde(skip_serializing_if = "is_true")]
    pub ok: bool,
    /// Whether the method is made for such a scene.
    #[serde(skip_serializing_if = "is_true")]
    pub applies: bool,
    /// Why there is no accepted path.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub why: String,
    /// Planning time, seconds.
    pub time: f64,
    /// Node expansions.
    #[serde(skip_serializing_if = "is_zero")]
    pub nodes: u32,
    /// Driven length, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// Gear changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub changes: Option<u32>,
    /// Cost over that of the cheapest path in the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<f64>,
    /// Smallest clearance, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance: Option<f64>,
    /// How a guided planner came to its path.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub route: String,
    /// Where the path begins, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<Pose>,
    /// Its motions: curvature (1/m) and signed length (m).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<[f64; 2]>,
    /// The abstraction's rectangles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regions: Option<[Vec<[f64; 2]>; 2]>,
    /// The preparatory pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preparatory: Option<Pose>,
    /// Where the car was when the path was driven.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub driven: Vec<[f64; 3]>,
}

fn is_true(value: &bool) -> bool {
    *value
}

fn is_zero(value: &u32) -> bool {
    *value == 0
}

/// What is left out.
impl Default for Run {
    fn default() -> Self {
        Self {
            method: 0,
            ok: true,
            applies: true,
            why: String::new(),
            time: 0.0,
            nodes: 0,
            length: None,
            changes: None,
            over: None,
            clearance: None,
            route: String::new(),
            start: None,
            segments: Vec::new(),
            regions: None,
            preparatory: None,
            driven: Vec::new(),
        }
    }
}

impl Gallery {
    /// The gallery of `cases`, from all rows of a run and the traces of these cases.
    pub fn new(cases: &[&Case], rows: &[Row], traces: &[Trace]) -> Self {
        let traces: HashMap<_, _> = traces.iter().map(|t| (t.key(), t)).collect();
        let mut by_scene: HashMap<&str, Vec<&Row>> = HashMap::new();
        let mut gallery = Gallery { methods: vec![], vehicles: vec![], scenes: vec![] };
        for row in rows {
            by_scene.entry(&row.scene).or_default().push(row);
            place(&mut gallery.methods, &row.method);
        }
        for case in cases {
            let scene = &case.scene;
            let rows = by_scene.remove(scene.name.as_str()).unwrap_or_default();
            let run = |row: &Row| {
                let method = place(&mut gallery.methods, &row.method);
                Run::new(method, row, traces.get(&row.key()).copied())
            };
            let runs = rows.into_iter().map(run).collect();
            let vehicle = place(&mut gallery.vehicles, &scene.vehicle);
            gallery.scenes.push(SceneView::new(case, vehicle, runs));
        }
        gallery
    }
}

/// The index of `value` in `all`, put at the end if new.
fn place<T: PartialEq + Clone>(all: &mut Vec<T>, value: &T) -> usize {
    all.iter().position(|v| v == value).unwrap_or_else(|| {
        all.push(value.clone());
        all.len() - 1
    })
}

/// The poses without those that lie on the straight between two that are kept, to a centimetre and half a degree.
fn thinned(poses: &[[f64; 3]]) -> Vec<[f64; 3]> {
    const APART: [f64; 3] = [0.01, 0.01, 0.01];
    // Standing still tells nothing of the way.
    let mut moving = poses.to_vec();
    moving.dedup();
    let is_between = |from: usize, to: usize, i: usize| {
        let [a, b] = [moving[from], moving[to]];
        let share = (i - from) as f64 / (to - from) as f64;
        (0..3).all(|k| (a[k] + share * (b[k] - a[k]) - moving[i][k]).abs() <= APART[k])
    };
    let mut kept: Vec<usize> = Vec::new();
    for to in 0..moving.len() {
        let from = kept.last().copied().unwrap_or(0);
        let is_end = to == 0 || to + 1 == moving.len();
        if is_end || !(from + 1..=to).all(|i| is_between(from, to + 1, i)) {
            kept.push(to);
        }
    }
    kept.into_iter().map(|i| moving[i].map(|v| round(v, 1e2))).collect()
}

/// Rounded to one over `scale`.
fn round(v: f64, scale: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (v * scale).round() / scale + 0.0
}

fn rounded(pose: Pose, scale: f64) -> Pose {
    <[f64; 3]>::from(pose).map(|v| round(v, scale)).into()
}

/// A motion to the micrometre: its curvature, too, finely enough for 100 m.
fn motion(&[curvature, length]: &[f64; 2]) -> [f64; 2] {
    [round(curvature, 1e8), round(length, 1e6)]
}

/// With so many significant digits.
fn to_digits(v: f64, digits: usize) -> f64 {
    if v == 0.0 || !v.is_finite() {
        return v;
    }
    // Through text: the shortest number that reads so.
    format!("{v:.*e}", digits - 1).parse().expect("a number was written")
}

impl Run {
    fn new(method: usize, row: &Row, trace: Option<&Trace>) -> Self {
        Self {
            method,
            ok: row.ok,
            applies: row.applies(),
            why: row.why(),
            time: to_digits(row.plan_time_s, 4),
            nodes: row.nodes,
            length: row.length_m.map(mm),
            changes: row.direction_changes,
            over: row.cost_over_best.map(|over| to_digits(over, 5)),
            clearance: row.min_clearance_m.map(mm),
            route: row.route.clone(),
            start: trace.and_then(|t| t.start).map(|pose| rounded(pose, 1e6)),
            segments: trace.map(|t| t.segments.iter().map(motion).collect()).unwrap_or_default(),
            regions: trace.and_then(|t| t.regions.clone()),
            preparatory: trace.and_then(|t| t.preparatory).map(|pose| rounded(pose, 1e4)),
            driven: trace.map(|t| thinned(&t.driven)).unwrap_or_default(),
        }
    }

    /// The path.
    pub fn path(&self) -> Option<Path> {
        let segments = self.segments.iter();
        let segments = segments.map(|&[curvature, length]| Segment { curvature, length }).collect();
        self.start.map(|start| Path { start, segments })
    }
}

impl SceneView {
    fn new(case: &Case, vehicle: usize, runs: Vec<Run>) -> Self {
        let scene = &case.scene;
        let view = view(scene, &runs).inflated(PADDING);
        let is_near = |o: &Outline| Aabb::around(o.points()).intersects(&view);
        let near: Vec<Outline> = scene.outlines().filter(is_near).collect();
        let of = |shape: Shape, is_low: bool| -> Vec<Vec<[f64; 2]>> {
            let chosen = near.iter().filter(|o| o.shape == shape && o.is_low == is_low);
            chosen.map(|o| o.points().map(|v| [mm(v.x), mm(v.y)]).collect()).collect()
        };
        let outlines = |is_low: bool| Outlines {
            obstacles: of(Shape::Solid, is_low),
            polylines: of(Shape::Chain, is_low),
            points: of(Shape::Point, is_low).concat(),
        };
        let mut borders = of(Shape::Border, false).into_iter();
        let drivable_area =
            borders.next().map(|outer| DrivableArea { outer, holes: borders.collect() });
        Self {
            name: scene.name.clone(),
            world: world(&case.set).to_owned(),
            kind: kind_name(case.kind),
            level: level_name(case.level),
            vehicle,
            start: scene.start,
            goal: scene.goal,
            view: [view.min.x, view.min.y, view.max.x, view.max.y].map(mm),
            around: outlines(false),
            low: outlines(true),
            drivable_area,
            bounds: scene.bounds.map(|b| b.map(mm)),
            runs,
        }
    }
}

/// The box around all that happens in `scene`: start, goal, paths, abstractions.
fn view(scene: &Scene, runs: &[Run]) -> Aabb {
    /// Distance between the poses looked at along a path, metres.
    const STEP: f64 = 0.25;
    let mut shown = vec![scene.start, scene.goal];
    for run in runs {
        shown.extend(run.preparatory);
        shown.extend(run.path().iter().flat_map(|p| p.sample(STEP)).map(|s| s.pose));
    }
    let regions = runs.iter().flat_map(|r| r.regions.iter().flatten().flatten());
    let corners = regions.map(|&[x, y]| Vec2::new(x, y));
    let footprint = |pose| scene.vehicle.footprint_at(pose).vertices().to_vec();
    Aabb::around(shown.into_iter().flat_map(footprint).chain(corners))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_driven_is_thinned_to_about_a_centimetre() {
        // A quarter circle of 5 m, a stop, and back along a straight.
        let turn = |i: usize| {
            let angle = i as f64 * 0.01;
            [5.0 * angle.sin(), 5.0 - 5.0 * angle.cos(), angle].map(mm)
        };
        let mut poses: Vec<[f64; 3]> = (0..157).map(turn).collect();
        let end = *poses.last().unwrap();
        poses.extend([end; 40]);
        poses.extend((1..100).map(|i| [end[0], mm(end[1] - 0.02 * f64::from(i)), end[2]]));
        let kept = thinned(&poses);
        assert!(kept.len() < 20, "{} of {}", kept.len(), poses.len());
        let rounded = |pose: &[f64; 3]| pose.map(|v| round(v, 1e2));
        assert_eq!((kept[0], kept.last()), (poses[0], poses.last().map(rounded).as_ref()));
        assert!(kept.contains(&rounded(&end)), "where it turned back");
        let beside = |p: &[f64; 3]| {
            let along = |pair: &[[f64; 3]]| {
                let [a, b] = [pair[0], pair[1]].map(|p| Vec2::new(p[0], p[1]));
                let (p, way) = (Vec2::new(p[0], p[1]), b - a);
                let share = ((p - a).dot(&way) / way.dot(&way)).clamp(0.0, 1.0);
                (a + way * share - p).norm()
            };
            kept.windows(2).map(along).fold(f64::INFINITY, f64::min)
        };
        let worst = poses.iter().map(beside).fold(0.0, f64::max);
        assert!(worst < 0.022, "{worst} m beside");
        assert_eq!(thinned(&[]), Vec::<[f64; 3]>::new());
        assert_eq!(thinned(&poses[..1]), poses[..1]);
    }

    #[test]
    fn numbers_are_short_and_near() {
        assert_eq!([to_digits(1.0 / 3e4, 4), to_digits(-0.0, 4)], [3.333e-5, 0.0]);
        assert_eq!(to_digits(1.000_049, 5), 1.0);
        assert_eq!(motion(&[1.0 / 7.0, -1.0 / 3.0]), [0.142_857_14, -0.333_333]);
    }
}
