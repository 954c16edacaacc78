//! `n3p.Scene`, and where scenes come from.

use std::fmt;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::Value;

use n3p::geometry::Pose;
use n3p::world;
use n3p::world::generate::GeneratorConfig;
use n3p::world::{Level, Map, MapOptions, MapRequest, ParkingType};

use crate::errors::{Fault, guarded};
use crate::inputs::{self, LotArguments, RequestArguments, text};
use crate::vehicle::{Vehicle, vehicle};
use crate::{json, plan};

/// A parking scene: a start, one goal or several, a vehicle, and what stands around. Immutable.
///
/// Metres and radians, in any frame that all of it shares; headings are counter-clockwise from +x,
/// and a pose is that of the rear-axle centre. A scene also reads like the dict of the scene format
/// (docs/formats.md): ``scene["obstacles"]``, ``dict(scene)``.
///
/// Parameters
/// ----------
/// start : array_like, shape (3,)
///     Pose to start from: x, y (metres), heading (radians).
/// goal : array_like, shape (3,), optional
///     Pose to park at.
/// polygons : iterable of array_like, shape (N, 2), optional
///     Solid simple polygons, closed implicitly; two vertices are a wall.
/// polylines : iterable of array_like, shape (N, 2), optional
///     Lines without thickness, such as fences.
/// points : array_like, shape (N, 2), optional
///     Points, as a range sensor sees them.
/// grid : tuple (cells, resolution, origin), optional
///     Occupied cells: an array (rows, columns) that is True, or not 0, where occupied, its first
///     row at the lowest y; the side of a cell, metres; and the corner (x, y) of the first cell.
/// bounds : array_like, shape (4,), optional
///     The rear axle stays in xmin, ymin, xmax, ymax.
/// goals : array_like, shape (N, 3), optional
///     Instead of ``goal``: poses of which the cheapest is taken.
/// tolerance : (float, float), optional
///     How far from a goal the car may stop: metres (up to 1), radians (up to 0.5).
/// parking_type : {"forward", "reverse", "parallel", "angled"}, optional
///     How the goal lies in its spot, where that is known; it is found otherwise.
/// low : dict, optional
///     What only wheels must keep off, such as kerbs: ``obstacles``, ``polylines`` and ``points``.
/// drivable_area : dict, optional
///     The body stays within the polygon ``outer`` and out of the polygons ``holes``.
/// contour : array_like, shape (N, 2), optional
///     The car's outline in its own frame, within the rectangle of its sizes, where it is not all of that.
/// margins : dict, optional
///     Clearance on each side, ``front``, ``rear``, ``left`` and ``right``, and around the ``mirrors`` of the contour,
///     metres, up to 1.
/// start_steer : float
///     Angle of the front wheels at the start, radians.
/// previous : Plan or dict, optional
///     The path that the car follows already: kept while it is free and near the best.
/// vehicle : Vehicle or dict, optional
///     The car; the default one where it is left out.
/// name : str, optional
///     Name, used in rows.
///
/// Raises
/// ------
/// n3p.BadInput
///     Says which argument is wrong, and what would be right.
#[pyclass(frozen, mapping, module = "n3p", name = "Scene")]
pub struct Scene {
    pub scene: Arc<world::Scene>,
    /// Of generated scenes.
    pub level: Option<Level>,
    entries: OnceLock<Entries>,
}

/// What makes a scene again: `_unpickled`, and its arguments.
type Remade<'py> = (Bound<'py, PyAny>, (String, Option<&'static str>));

impl Scene {
    fn new_from(scene: world::Scene, level: Option<Level>) -> Self {
        Self { scene: Arc::new(scene), level, entries: OnceLock::new() }
    }

    fn entries(&self) -> &Entries {
        self.entries.get_or_init(|| {
            serde_json::from_str(&self.to_json()).expect("a scene is a map with text for keys")
        })
    }
}

/// What the scene format has of a scene, in its order: keys, and the JSON of each value.
struct Entries(Vec<(String, String)>);

impl Entries {
    /// The JSON of the value of `key`, which may be anything of Python's.
    fn get(&self, key: &Bound<'_, PyAny>) -> Option<&str> {
        let key = key.cast::<PyString>().ok()?;
        let key = key.to_cow().ok()?;
        self.0.iter().find(|(own, _)| *own == key).map(|(_, json)| json.as_str())
    }
}

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;

        impl<'de> Visitor<'de> for InOrder {
            type Value = Entries;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries, A::Error> {
                let mut entries = Vec::new();
                while let Some((key, value)) = map.next_entry::<_, Value>()? {
                    entries.push((key, value.to_string()));
                }
                Ok(Entries(entries))
            }
        }

        deserializer.deserialize_map(InOrder)
    }
}

/// `scene`, where it is one.
fn checked(scene: world::Scene) -> Result<world::Scene, Fault> {
    let name = if scene.name.is_empty() { "scene" } else { &scene.name };
    scene.validate(Path::new(name)).map_err(Fault::bad)?;
    Ok(scene)
}

/// The scene that `object` is: a `Scene`, a dict of the scene format, or a path.
pub fn scene(object: &Bound<'_, PyAny>) -> Result<(Arc<world::Scene>, Option<Level>), Fault> {
    if let Ok(scene) = object.cast::<Scene>() {
        return Ok((scene.get().scene.clone(), scene.get().level));
    }
    if object.is_instance_of::<PyDict>() {
        return Ok((Arc::new(of_dict(object)?), None));
    }
    let Some(path) = inputs::path(object) else {
        let kind = object.get_type().name()?;
        let text =
            format!("scene: is a {kind}; expected a Scene, a dict of the scene format, or a path");
        return Err(Fault::bad(text));
    };
    Ok((Arc::new(world::Scene::read(&path).map_err(Fault::bad)?), None))
}

fn of_dict(object: &Bound<'_, PyAny>) -> Result<world::Scene, Fault> {
    let value = json::value(object, "scene")?;
    match world::Scene::deserialize(&value) {
        Ok(scene) => checked(scene),
        // The reader of files knows how to say what is wrong.
        Err(_) => of_json(&value.to_string()),
    }
}

fn of_json(text: &str) -> Result<world::Scene, Fault> {
    world::Scene::from_json(text, Path::new("scene")).map_err(Fault::bad)
}

/// Reads one scene from a ``.json`` file (docs/formats.md) or a TPCAP ``.csv``.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///
/// Returns
/// -------
/// Scene
///
/// Raises
/// ------
/// n3p.BadInput
///     Says what is wrong with the file, and where.
#[pyfunction]
pub fn load_scene(path: &Bound<'_, PyAny>) -> Result<Scene, Fault> {
    let Some(path) = inputs::path(path) else {
        return Err(Fault::bad("path: expected text or an os.PathLike"));
    };
    Ok(Scene::new_from(world::Scene::read(&path).map_err(Fault::bad)?, None))
}

/// Reads a map of any kind (docs/formats.md) and makes it a scene.
///
/// Occupancy grids (``.yaml``), points (``.csv``, ``.pcd``), ``.geojson``, CommonRoad (``.xml``), OpenDRIVE
/// (``.xodr``) and scenes.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
/// start : array_like, shape (3,), optional
///     Pose to start from; the map's where it is left out.
/// goal : array_like, shape (3,), optional
///     Pose to park at; the map's, or both ways into its parking spaces.
/// goals : array_like, shape (N, 3), optional
///     Instead of ``goal``: poses of which the cheapest is taken.
/// vehicle : Vehicle or dict, optional
///     The car; the map's where it is left out, else the default one.
/// unknown : {"free", "occupied"}
///     What cells of an occupancy grid are of which nothing is known.
/// heights : (float, float), optional
///     Least and largest z of the points that count, metres.
/// borders : bool
///     Whether the borders of CommonRoad's lanelets are walls.
/// metres : bool
///     Whether coordinates of GeoJSON are metres, also where the file does not say so.
///
/// Returns
/// -------
/// Scene
///
/// Raises
/// ------
/// n3p.BadInput
///     Says what is wrong with the file, and where, or what is missing.
#[pyfunction]
#[pyo3(signature = (path, *, start=None, goal=None, goals=None, vehicle=None, unknown="free", heights=None, borders=false, metres=false))]
#[expect(clippy::too_many_arguments, reason = "they have names in Python")]
pub fn load_map(
    path: &Bound<'_, PyAny>,
    start: Option<&Bound<'_, PyAny>>,
    goal: Option<&Bound<'_, PyAny>>,
    goals: Option<&Bound<'_, PyAny>>,
    vehicle: Option<&Bound<'_, PyAny>>,
    unknown: &str,
    heights: Option<(f64, f64)>,
    borders: bool,
    metres: bool,
) -> Result<Scene, Fault> {
    let Some(path) = inputs::path(path) else {
        return Err(Fault::bad("path: expected text or an os.PathLike"));
    };
    let unknown_is_occupied = match unknown {
        "free" => false,
        "occupied" => true,
        other => {
            let text = format!("unknown: is {other:?}; expected \"free\" or \"occupied\"");
            return Err(Fault::bad(text));
        }
    };
    let (low, high) = heights.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let options = MapOptions { unknown_is_occupied, heights: [low, high], borders, metres };
    let pose = |object: &Bound<'_, PyAny>, name| {
        inputs::numbers::<3>(object).map(Pose::from).map_err(|w| w.of(name))
    };
    let goals = match (goal, goals) {
        (Some(goal), None) => vec![pose(goal, "goal")?],
        (None, Some(goals)) => {
            let rows = inputs::rows::<3>(goals).map_err(|w| w.of("goals"))?;
            rows.into_iter().map(Into::into).collect()
        }
        (None, None) => Vec::new(),
        (Some(_), Some(_)) => return Err(Fault::bad("goal and goals: give one of them")),
    };
    let start = start.map(|start| pose(start, "start")).transpose()?;
    let map = Map::read_with(&path, &options).map_err(Fault::bad)?;
    // Without one anywhere the car is the default one, as everywhere in this package.
    let vehicle = match (vehicle, map.vehicle) {
        (None, Some(_)) => None,
        (given, _) => Some(self::vehicle(given)?),
    };
    let scene = map.scene(&MapRequest { start, goals, vehicle }).map_err(Fault::bad)?;
    Ok(Scene::new_from(scene, None))
}

/// Makes scenes as in the paper's evaluation; the same arguments give the same scenes, and those of
/// ``n3p-eval``.
///
/// Parameters
/// ----------
/// type : {"forward", "reverse", "parallel", "angled"}
///     Parking type.
/// level : {"easy", "complex", "extreme"}
///     Difficulty.
/// count : int
///     How many, up to 100,000.
/// seed : int
///     Seed, from 0.
/// vehicle : Vehicle or dict, optional
///     The car that parks.
/// first : int
///     Index of the first one.
///
/// Returns
/// -------
/// list of Scene
#[pyfunction]
#[pyo3(signature = (r#type, level, count=1, seed=1, vehicle=None, *, first=0))]
pub fn generate(
    py: Python<'_>,
    r#type: &Bound<'_, PyAny>,
    level: &Bound<'_, PyAny>,
    count: i64,
    seed: i128,
    vehicle: Option<&Bound<'_, PyAny>>,
    first: i64,
) -> Result<Vec<Scene>, Fault> {
    let kind: ParkingType = text(r#type, "type")?;
    let level: Level = text(level, "level")?;
    let vehicle = self::vehicle(vehicle)?;
    if !(0..=100_000).contains(&count) {
        return Err(Fault::bad(format!("count: is {count}; expected 0 to 100000")));
    }
    let seed = seed_of(seed)?;
    let first = u64::try_from(first).map_err(|_| Fault::bad(format!("first: is {first}")))?;
    let config = GeneratorConfig::default();
    config.validate(&vehicle).map_err(|e| Fault::bad(format!("vehicle: {e}")))?;
    let made = |index| world::generate::generate(&config, &vehicle, kind, level, seed, index);
    let indices = first..first.saturating_add(count as u64);
    let scenes: Vec<_> = py.detach(|| guarded(|| indices.map(made).collect()))?;
    Ok(scenes.into_iter().map(|scene| Scene::new_from(scene, Some(level))).collect())
}

/// A seed of Rust's.
pub fn seed_of(seed: i128) -> Result<u64, Fault> {
    u64::try_from(seed).map_err(|_| Fault::bad(format!("seed: is {seed}; expected 0 to 2**64 - 1")))
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (start, goal=None, *, polygons=None, polylines=None, points=None, grid=None, bounds=None, goals=None, tolerance=None, parking_type=None, low=None, drivable_area=None, contour=None, margins=None, start_steer=0.0, previous=None, vehicle=None, name=String::new()))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn new(
        start: &Bound<'_, PyAny>,
        goal: Option<&Bound<'_, PyAny>>,
        polygons: Option<&Bound<'_, PyAny>>,
        polylines: Option<&Bound<'_, PyAny>>,
        points: Option<&Bound<'_, PyAny>>,
        grid: Option<&Bound<'_, PyAny>>,
        bounds: Option<&Bound<'_, PyAny>>,
        goals: Option<&Bound<'_, PyAny>>,
        tolerance: Option<&Bound<'_, PyAny>>,
        parking_type: Option<&Bound<'_, PyAny>>,
        low: Option<&Bound<'_, PyAny>>,
        drivable_area: Option<&Bound<'_, PyAny>>,
        contour: Option<&Bound<'_, PyAny>>,
        margins: Option<&Bound<'_, PyAny>>,
        start_steer: f64,
        previous: Option<&Bound<'_, PyAny>>,
        vehicle: Option<&Bound<'_, PyAny>>,
        name: String,
    ) -> Result<Self, Fault> {
        let lot = LotArguments { polygons, polylines, points, grid, low, drivable_area, bounds };
        let lot = lot.lot()?;
        let request = RequestArguments {
            start,
            goal,
            goals,
            tolerance,
            parking_type,
            contour,
            margins,
            start_steer,
            previous,
        };
        let request = request.request()?;
        let scene = lot.scene(self::vehicle(vehicle)?, &request);
        Ok(Self::new_from(checked(world::Scene { name, ..scene })?, None))
    }

    /// The scene of a dict of the scene format (docs/formats.md). Arrays count as lists.
    #[staticmethod]
    fn from_dict(scene: &Bound<'_, PyAny>) -> Result<Self, Fault> {
        if !scene.is_instance_of::<PyDict>() {
            return Err(Fault::bad("scene: expected a dict"));
        }
        Ok(Self::new_from(of_dict(scene)?, None))
    }

    /// The scene of the text of a JSON scene file.
    #[staticmethod]
    fn from_json(text: &str) -> Result<Self, Fault> {
        Ok(Self::new_from(of_json(text)?, None))
    }

    /// What `__reduce__` told.
    #[staticmethod]
    fn _unpickled(text: &str, level: Option<&str>) -> Result<Self, Fault> {
        let level = level.map(str::parse).transpose().map_err(Fault::bad)?;
        Ok(Self::new_from(of_json(text)?, level))
    }

    /// Name, used in rows and file names.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// Where it comes from, for people.
    #[getter]
    fn source(&self) -> &str {
        &self.scene.source
    }

    /// Difficulty of a generated scene, else None.
    #[getter]
    fn level(&self) -> Option<&'static str> {
        self.level.map(Level::name)
    }

    /// The car.
    #[getter]
    fn vehicle(&self) -> Vehicle {
        Vehicle(self.scene.vehicle)
    }

    /// Pose to start from, float64 (3,): x, y (metres), heading (radians).
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &<[f64; 3]>::from(self.scene.start))
    }

    /// Pose to park at, of several the first, float64 (3,): x, y (metres), heading (radians).
    #[getter]
    fn goal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &<[f64; 3]>::from(self.scene.goal))
    }

    /// All poses to park at, float64 (N, 3).
    #[getter]
    fn goals<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        plan::rows(py, self.scene.all_goals().iter().map(|&goal: &Pose| goal.into()))
    }

    /// How the goal lies in its spot, where that is given, else None.
    #[getter]
    fn parking_type(&self) -> Option<&'static str> {
        self.scene.parking_type.map(ParkingType::name)
    }

    /// Polygons and walls, each float64 (N, 2), metres.
    #[getter]
    fn obstacles<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray2<f64>>> {
        self.scene.obstacles.iter().map(|o| plan::rows(py, o.iter().copied())).collect()
    }

    /// Obstacle points, float64 (N, 2), metres.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        plan::rows(py, self.scene.points.iter().copied())
    }

    /// The dict of the scene format (docs/formats.md).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::loaded(py, &self.to_json())
    }

    /// The text of a JSON scene file.
    fn to_json(&self) -> String {
        serde_json::to_string(&*self.scene).expect("plain numbers and strings")
    }

    /// The keys of the scene format, so that ``dict(scene)`` works.
    fn keys<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let keys = PyDict::new(py);
        for (key, _) in &self.entries().0 {
            keys.set_item(key, ())?;
        }
        keys.call_method0("keys")
    }

    fn __getitem__<'py>(&self, key: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        match self.entries().get(key) {
            Some(json) => json::loaded(key.py(), json),
            None => Err(PyKeyError::new_err(key.clone().unbind())),
        }
    }

    fn __contains__(&self, key: &Bound<'_, PyAny>) -> bool {
        self.entries().get(key).is_some()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.keys(py)?.call_method0("__iter__")
    }

    fn __len__(&self) -> usize {
        self.entries().0.len()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        match other.cast::<Scene>() {
            Ok(other) => *other.get().scene == *self.scene,
            Err(_) => {
                other.is_instance_of::<PyDict>()
                    && of_dict(other).is_ok_and(|other| other == *self.scene)
            }
        }
    }

    fn __hash__(&self) -> u64 {
        // 0.0 and -0.0 are equal, and so must be what is made of them here: adding 0.0 makes them so.
        let [x, y, heading] = <[f64; 3]>::from(self.scene.start).map(|v| (v + 0.0).to_bits());
        x ^ y.rotate_left(21) ^ heading.rotate_left(42) ^ self.scene.obstacles.len() as u64
    }

    fn __repr__(&self) -> String {
        let world::Scene { name, obstacles, points, .. } = &*self.scene;
        format!("<Scene {name:?}: {} obstacles, {} points>", obstacles.len(), points.len())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Remade<'py>> {
        let scene = slf.get();
        Ok((slf.get_type().getattr("_unpickled")?, (scene.to_json(), scene.level())))
    }
}
