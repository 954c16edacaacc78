//! The gallery's data: scenes and what every method did in them, as JSON for the page.
//!
//! Paths are stored as their motions, bit for bit; the page drives them itself. Everything
//! else is for looking at and is rounded to millimetres.

use std::collections::{HashMap, HashSet};

use serde::{Deserialize, Serialize};

use super::super::table::part_name;
use super::super::trace::{Trace, mm};
use crate::curves::{Path, Segment};
use crate::episode::Case;
use crate::episode::Row;
use crate::geometry::{Aabb, Pose, Vec2};
use crate::vehicle::Vehicle;
use crate::world::{Outline, Scene, Shape};

/// Scenes shown of each type and level, the first ones.
pub const FIRST: usize = 10;
/// Further scenes shown of each type and level because a method failed there; at most.
pub const FAILED: usize = 20;

/// Free space around what is shown, metres.
const PADDING: f64 = 2.5;

/// The scenes of a run that the page shows: the first few of every type and level, and those
/// in which a method failed, as long as there are not too many.
pub fn chosen<'a>(cases: &'a [Case], rows: &[Row]) -> Vec<&'a Case> {
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
    /// Its parking type, or `–`.
    #[serde(rename = "type")]
    pub kind: String,
    /// Its level, or its set where that has none.
    pub level: String,
    /// Index of its vehicle.
    pub vehicle: usize,
    /// Rear-axle start.
    pub start: Pose,
    /// Rear-axle goal.
    pub goal: Pose,
    /// What to show: least x and y, greatest x and y.
    pub view: [f64; 4],
    /// Polygons near what is shown.
    pub obstacles: Vec<Vec<[f64; 2]>>,
    /// Walls near what is shown.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// The border of the drivable area.
    pub borders: Vec<Vec<[f64; 2]>>,
    /// Points near what is shown.
    pub points: Vec<[f64; 2]>,
    /// The scene's bounds.
    pub bounds: Option<[f64; 4]>,
    /// What the methods did, in the order of the rows.
    pub runs: Vec<Run>,
}

/// One method in one scene: its row, and its trace if there is one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Index of the method.
    pub method: usize,
    /// As in the row.
    pub ok: bool,
    /// Whether the method is made for such a scene.
    pub applies: bool,
    /// Why there is no accepted path.
    pub why: String,
    /// Planning time, seconds.
    pub time: f64,
    /// Node expansions.
    pub nodes: u32,
    /// Driven length, metres.
    pub length: Option<f64>,
    /// Gear changes.
    pub changes: Option<u32>,
    /// Smallest clearance, metres.
    pub clearance: Option<f64>,
    /// How a guided planner came to its path.
    pub route: String,
    /// Where the path begins.
    pub start: Option<Pose>,
    /// Its motions: curvature (1/m) and signed length (m).
    pub segments: Vec<[f64; 2]>,
    /// The abstraction's rectangles.
    pub regions: Option<[Vec<[f64; 2]>; 2]>,
    /// The preparatory pose.
    pub preparatory: Option<Pose>,
    /// Where the car was when the path was driven.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub driven: Vec<[f64; 3]>,
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

impl Run {
    fn new(method: usize, row: &Row, trace: Option<&Trace>) -> Self {
        Self {
            method,
            ok: row.ok,
            applies: row.applies(),
            why: row.why(),
            time: row.plan_time_s,
            nodes: row.nodes,
            length: row.length_m.map(mm),
            changes: row.direction_changes,
            clearance: row.min_clearance_m.map(mm),
            route: row.route.clone(),
            start: trace.and_then(|t| t.start),
            segments: trace.map(|t| t.segments.clone()).unwrap_or_default(),
            regions: trace.and_then(|t| t.regions.clone()),
            preparatory: trace.and_then(|t| t.preparatory),
            driven: trace.map(|t| t.driven.clone()).unwrap_or_default(),
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
        let of = |shapes: &[Shape]| -> Vec<Vec<[f64; 2]>> {
            let chosen = near.iter().filter(|o| shapes.contains(&o.shape));
            chosen.map(|o| o.points().map(|v| [mm(v.x), mm(v.y)]).collect()).collect()
        };
        Self {
            name: scene.name.clone(),
            kind: case.kind.map_or("–", |k| k.name()).to_owned(),
            level: part_name(&case.set, case.level),
            vehicle,
            start: scene.start,
            goal: scene.goal,
            view: [view.min.x, view.min.y, view.max.x, view.max.y].map(mm),
            obstacles: of(&[Shape::Solid]),
            lines: of(&[Shape::Chain]),
            borders: of(&[Shape::Border]),
            points: of(&[Shape::Point]).concat(),
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
