//! Numbers from Python: arrays of any kind, lists, tuples.

use std::fmt;

use numpy::ndarray::Dimension;
use numpy::{PyArray, PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyFloat, PyList, PyString, PyTuple, PyType};

use n3p::curves::smoothing::StandstillSteering;
use n3p::world::{GoalTolerance, LowObstacles, ParkingType, PreviousPath};
use n3p::{Lot, Request};

use crate::errors::Fault;

/// What is wrong, and where: `[3][1]`.
pub struct Wrong {
    place: String,
    what: String,
}

impl Wrong {
    pub fn new(what: impl fmt::Display) -> Self {
        Self { place: String::new(), what: what.to_string() }
    }

    /// The same as seen from outside: in item `index` of something.
    fn inside(self, index: usize) -> Self {
        Self { place: format!("[{index}]{}", self.place), ..self }
    }

    /// The fault of the argument `name`.
    pub fn of(self, name: &str) -> Fault {
        Fault::bad(format!("{name}{}: {}", self.place, self.what))
    }
}

type Found<T> = Result<T, Wrong>;

/// The text of `object` for messages, cut to a readable length.
fn shown(object: &Bound<'_, PyAny>) -> String {
    let kind = object.get_type().name().map_or_else(|_| "?".to_owned(), |n| n.to_string());
    let text = object.repr().map_or_else(|_| String::new(), |r| r.to_string_lossy().into_owned());
    let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}… ({kind})", &text[..end]),
        None => format!("{text} ({kind})"),
    }
}

fn number(object: &Bound<'_, PyAny>) -> Found<f64> {
    if let Ok(float) = object.cast_exact::<PyFloat>() {
        return Ok(float.value());
    }
    let wrong = |_| Wrong::new(format!("is {}; expected a number", shown(object)));
    object.extract().map_err(wrong)
}

/// `N` numbers in a row.
pub fn numbers<const N: usize>(object: &Bound<'_, PyAny>) -> Found<[f64; N]> {
    let wrong = || Wrong::new(format!("is {}; expected {N} numbers", shown(object)));
    let mut row = [0.0; N];
    if let Ok(list) = object.cast::<PyList>() {
        if list.len() != N {
            return Err(wrong());
        }
        for (i, value) in row.iter_mut().enumerate() {
            let item = list.get_item(i).map_err(|_| wrong())?;
            *value = number(&item).map_err(|w| w.inside(i))?;
        }
    } else if let Ok(tuple) = object.cast::<PyTuple>() {
        if tuple.len() != N {
            return Err(wrong());
        }
        for (i, value) in row.iter_mut().enumerate() {
            let item = tuple.get_item(i).map_err(|_| wrong())?;
            *value = number(&item).map_err(|w| w.inside(i))?;
        }
    } else {
        let array = floats(object, || format!("{N} numbers"))?;
        let array = array.cast::<PyArray1<f64>>().map_err(|_| wrong())?;
        if array.len() != N {
            return Err(wrong());
        }
        let array = regular(array)?;
        // SAFETY: as in `rows_of`.
        let view = unsafe { array.as_array() };
        row.iter_mut().zip(view).for_each(|(value, given)| *value = *given);
    }
    Ok(row)
}

/// Any number of rows of `N` numbers each.
pub fn rows<const N: usize>(object: &Bound<'_, PyAny>) -> Found<Vec<[f64; N]>> {
    if let Ok(list) = object.cast::<PyList>() {
        let item = |(i, item)| numbers(&item).map_err(|w| w.inside(i));
        return list.iter().enumerate().map(item).collect();
    }
    if let Ok(tuple) = object.cast::<PyTuple>() {
        let item = |(i, item)| numbers(&item).map_err(|w| w.inside(i));
        return tuple.iter().enumerate().map(item).collect();
    }
    if let Ok(array) = object.cast::<PyArray2<f64>>() {
        return rows_of(array);
    }
    let array = floats(object, || format!("rows of {N} numbers"))?;
    if array.len().is_ok_and(|len| len == 0) {
        return Ok(Vec::new());
    }
    let shape = array.getattr("shape").map_err(Wrong::new)?;
    rows_of(
        array.cast().map_err(|_| Wrong::new(format!("has shape {shape}; expected (any, {N})")))?,
    )
}

fn rows_of<const N: usize>(array: &Bound<'_, PyArray2<f64>>) -> Found<Vec<[f64; N]>> {
    let [rows, columns] = [array.shape()[0], array.shape()[1]];
    if rows == 0 {
        return Ok(Vec::new());
    }
    if columns != N {
        return Err(Wrong::new(format!("has shape ({rows}, {columns}); expected (any, {N})")));
    }
    let array = regular(array)?;
    // SAFETY: it is aligned and its strides are whole values, so that the view has its very values;
    // these are copied before anything of Python's runs that could write to them. A borrow that
    // numpy's Rust side keeps book of would cost as much as the copy.
    let view = unsafe { array.as_array() };
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|i| row[i])).collect())
}

/// `array`, or a copy of it where Rust cannot read it in place: where it is not aligned, or where its
/// strides, which count bytes, are no whole values. Views of packed records are so, and `as_array`
/// neither minds nor copes.
fn regular<'py, D: Dimension>(
    array: &Bound<'py, PyArray<f64, D>>,
) -> Found<Bound<'py, PyArray<f64, D>>> {
    let is_regular = |array: &Bound<'py, PyArray<f64, D>>| {
        let whole = |stride: &isize| stride % size_of::<f64>() as isize == 0;
        array.data().is_aligned() && array.strides().iter().all(whole)
    };
    if is_regular(array) {
        return Ok(array.clone());
    }
    static ARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let copied = ARRAY.import(array.py(), "numpy", "array").and_then(|copy| copy.call1((array,)));
    let copied = copied.map_err(Wrong::new)?.cast_into().map_err(Wrong::new)?;
    match is_regular(&copied) {
        true => Ok(copied),
        false => Err(Wrong::new("is an array that numpy cannot align")),
    }
}

/// `object` as an array of 64-bit floats, itself where it is one.
fn floats<'py>(
    object: &Bound<'py, PyAny>,
    expected: impl Fn() -> String,
) -> Found<Bound<'py, PyAny>> {
    if object.cast::<PyArray2<f64>>().is_ok() || object.cast::<PyArray1<f64>>().is_ok() {
        return Ok(object.clone());
    }
    let wrong = || Wrong::new(format!("is {}; expected {}", shown(object), expected()));
    // Arrays of text and of objects would turn into numbers where they happen to look like some.
    let array = as_array(object, &["f", "i", "u"]).ok_or_else(wrong)?;
    array.call_method1("astype", ("float64",)).map_err(|_| wrong())
}

/// `object` as numpy sees it, where its values are of one of `kinds`, or it has none.
fn as_array<'py>(object: &Bound<'py, PyAny>, kinds: &[&str]) -> Option<Bound<'py, PyAny>> {
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    if object.is_none() || object.is_instance_of::<PyString>() {
        return None;
    }
    let py = object.py();
    let array = ASARRAY.import(py, "numpy", "asarray").ok()?.call1((object,)).ok()?;
    let kind: String = array.getattr("dtype").ok()?.getattr("kind").ok()?.extract().ok()?;
    let empty = array.getattr("size").ok()?.extract().is_ok_and(|size: usize| size == 0);
    (empty || kinds.contains(&kind.as_str())).then_some(array)
}

/// Several outlines, each of rows of two numbers.
fn outlines(object: &Bound<'_, PyAny>) -> Found<Vec<Vec<[f64; 2]>>> {
    if object.is_instance_of::<PyString>() || object.is_instance_of::<PyDict>() {
        return Err(Wrong::new(format!("is {}; expected a list of arrays (N, 2)", shown(object))));
    }
    let items = object.try_iter().map_err(|_| {
        Wrong::new(format!("is {}; expected a list of arrays (N, 2)", shown(object)))
    })?;
    let outline = |(i, item): (usize, PyResult<Bound<'_, PyAny>>)| {
        rows(&item.map_err(Wrong::new)?).map_err(|w| w.inside(i))
    };
    items.enumerate().map(outline).collect()
}

/// Adds `(array, resolution, origin)` to `lot`.
fn add_grid(lot: &mut Lot, object: &Bound<'_, PyAny>) -> Found<()> {
    const EXPECTED: &str = "(occupied cells as a 2-D array, resolution in metres, (x, y))";
    let wrong = || Wrong::new(format!("is {}; expected {EXPECTED}", shown(object)));
    let parts: Vec<Bound<'_, PyAny>> = match object.cast::<PyTuple>() {
        Ok(tuple) => tuple.iter().collect(),
        Err(_) => object.cast::<PyList>().map_err(|_| wrong())?.iter().collect(),
    };
    let [cells, resolution, origin] = &parts[..] else { return Err(wrong()) };
    let resolution = number(resolution).map_err(|w| w.inside(1))?;
    if !(resolution.is_finite() && resolution > 0.0) {
        let text = format!("is {resolution}; expected metres above 0");
        return Err(Wrong::new(text).inside(1));
    }
    let origin = numbers(origin).map_err(|w| w.inside(2))?;
    let array = as_array(cells, &["b", "i", "u", "f"]);
    let of_cells = |what: String| Wrong::new(what).inside(0);
    let array = array.ok_or_else(|| {
        of_cells(format!("is {}; expected an array of bool, or of numbers", shown(cells)))
    })?;
    let python = |e: PyErr| of_cells(e.to_string());
    let kind: String =
        array.getattr("dtype").and_then(|d| d.getattr("kind")?.extract()).map_err(python)?;
    if kind == "f" {
        let sum: f64 = array.call_method0("sum").and_then(|s| s.extract()).map_err(python)?;
        if !sum.is_finite() {
            return Err(of_cells(
                "holds NaN or infinity; expected True, or not 0, where occupied".into(),
            ));
        }
    }
    let occupied =
        if kind == "b" { array } else { array.call_method1("__ne__", (0,)).map_err(python)? };
    // As bytes: in arrays of bool that are views of something else, Python keeps any values, and a
    // `bool` of Rust's is nothing but 0 or 1.
    let occupied = occupied.call_method1("view", ("uint8",)).map_err(python)?;
    let shape = || cells.getattr("shape").map_or_else(|_| shown(cells), |s| s.to_string());
    let occupied = occupied
        .cast::<PyArray2<u8>>()
        .map_err(|_| of_cells(format!("has shape {}; expected (rows, columns)", shape())))?;
    let occupied = occupied.try_readonly().map_err(|e| of_cells(e.to_string()))?;
    let view = occupied.as_array();
    let flat: Vec<bool> = view.iter().map(|&cell| cell != 0).collect();
    lot.grid(origin, resolution, view.ncols(), &flat);
    Ok(())
}

/// What a parking lot is made of, as keyword arguments.
pub struct LotArguments<'a, 'py> {
    pub polygons: Option<&'a Bound<'py, PyAny>>,
    pub polylines: Option<&'a Bound<'py, PyAny>>,
    pub points: Option<&'a Bound<'py, PyAny>>,
    pub grid: Option<&'a Bound<'py, PyAny>>,
    pub low: Option<&'a Bound<'py, PyAny>>,
    pub drivable_area: Option<&'a Bound<'py, PyAny>>,
    pub bounds: Option<&'a Bound<'py, PyAny>>,
}

impl LotArguments<'_, '_> {
    pub fn lot(&self) -> Result<Lot, Fault> {
        let mut lot = Lot::new();
        if let Some(polygons) = self.polygons {
            for polygon in outlines(polygons).map_err(|w| w.of("polygons"))? {
                lot.polygon(polygon);
            }
        }
        if let Some(polylines) = self.polylines {
            let lines = outlines(polylines).map_err(|w| w.of("polylines"))?;
            for (i, line) in lines.iter().enumerate() {
                if line.len() < 2 {
                    let few = Wrong::new("has fewer than 2 vertices; a polyline needs 2");
                    return Err(few.inside(i).of("polylines"));
                }
                lot.polyline(line);
            }
        }
        if let Some(points) = self.points {
            lot.points(rows(points).map_err(|w| w.of("points"))?);
        }
        if let Some(grid) = self.grid {
            add_grid(&mut lot, grid).map_err(|w| w.of("grid"))?;
        }
        if let Some(low) = self.low {
            let LowObstacles { obstacles, polylines, points } = crate::json::read(low, "low")?;
            obstacles.into_iter().for_each(|o| _ = lot.low_polygon(o));
            polylines.into_iter().for_each(|p| _ = lot.low_polyline(p));
            lot.low_points(points);
        }
        if let Some(area) = self.drivable_area {
            lot.drivable_area(crate::json::read(area, "drivable_area")?);
        }
        if let Some(bounds) = self.bounds {
            lot.bounds(numbers(bounds).map_err(|w| w.of("bounds"))?);
        }
        Ok(lot)
    }
}

/// What is asked of a plan, as arguments.
pub struct RequestArguments<'a, 'py> {
    pub start: &'a Bound<'py, PyAny>,
    pub goal: Option<&'a Bound<'py, PyAny>>,
    pub goals: Option<&'a Bound<'py, PyAny>>,
    pub tolerance: Option<&'a Bound<'py, PyAny>>,
    pub parking_type: Option<&'a Bound<'py, PyAny>>,
    pub contour: Option<&'a Bound<'py, PyAny>>,
    pub margins: Option<&'a Bound<'py, PyAny>>,
    pub start_steer: f64,
    pub previous: Option<&'a Bound<'py, PyAny>>,
}

impl RequestArguments<'_, '_> {
    pub fn request(&self) -> Result<Request, Fault> {
        let start = numbers::<3>(self.start).map_err(|w| w.of("start"))?;
        let goals = match (self.goal, self.goals) {
            (Some(goal), None) => vec![numbers::<3>(goal).map_err(|w| w.of("goal"))?],
            (None, Some(goals)) => rows::<3>(goals).map_err(|w| w.of("goals"))?,
            (Some(_), Some(_)) => return Err(Fault::bad("goal and goals: give one of them")),
            (None, None) => return Err(Fault::bad("goal: is missing; give (x, y, heading)")),
        };
        if goals.is_empty() {
            return Err(Fault::bad("goals: is empty; expected at least one (x, y, heading)"));
        }
        Ok(Request {
            start: start.into(),
            goals: goals.into_iter().map(Into::into).collect(),
            tolerance: self.tolerance.map(tolerance).transpose()?,
            parking_type: self
                .parking_type
                .map(|t| text::<ParkingType>(t, "parking_type"))
                .transpose()?,
            contour: match self.contour {
                Some(contour) => rows::<2>(contour).map_err(|w| w.of("contour"))?,
                None => Vec::new(),
            },
            margins: self.margins.map(|m| crate::json::read(m, "margins")).transpose()?,
            start_steer: self.start_steer,
            previous: self.previous.map(previous).transpose()?,
        })
    }
}

/// A plan, or the arrays of a path file.
fn previous(object: &Bound<'_, PyAny>) -> Result<PreviousPath, Fault> {
    if let Ok(plan) = object.cast::<crate::plan::Plan>() {
        return Ok(plan.borrow().previous());
    }
    crate::json::read(object, "previous")
}

fn tolerance(object: &Bound<'_, PyAny>) -> Result<GoalTolerance, Fault> {
    if let Ok(dict) = object.cast::<PyDict>() {
        let value = crate::json::value(dict, "tolerance")?;
        return serde_json::from_value(value).map_err(|e| Fault::bad(format!("tolerance: {e}")));
    }
    let [position_m, heading_rad] = numbers(object).map_err(|w| w.of("tolerance"))?;
    Ok(GoalTolerance { position_m, heading_rad })
}

/// A word that names something.
pub fn text<T: std::str::FromStr<Err: fmt::Display>>(
    object: &Bound<'_, PyAny>,
    name: &str,
) -> Result<T, Fault> {
    let Ok(word) = object.cast::<PyString>() else {
        return Err(Wrong::new(format!("is {}; expected text", shown(object))).of(name));
    };
    let word = word.to_string_lossy();
    word.parse().map_err(|e| Fault::bad(format!("{name}: {e}")))
}

/// The path that a `str` or an `os.PathLike` is; `None` where it is neither.
pub fn path(object: &Bound<'_, PyAny>) -> Option<std::path::PathBuf> {
    static PATH_LIKE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let path_like = PATH_LIKE.import(object.py(), "os", "PathLike").ok()?;
    let is_one = object.is_instance_of::<PyString>() || object.is_instance(path_like).ok()?;
    is_one.then(|| object.extract().ok()).flatten()
}

/// Where the steering wheel may be turned while the car stands.
pub fn standstill(name: &str) -> Result<StandstillSteering, Fault> {
    name.parse().map_err(|e| Fault::bad(format!("standstill_steering: {e}")))
}
