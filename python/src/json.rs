//! Between Python's dicts and JSON values.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde::de::DeserializeOwned;
use serde_json::{Map, Number, Value};

use crate::errors::Fault;

/// Lists within lists beyond this are none of ours; one may even hold itself.
const DEEPEST: usize = 16;

/// `object` as JSON. Arrays of numpy count as lists, its numbers as numbers. What JSON cannot say is
/// a fault that names the place, beginning with `name`.
pub fn value(object: &Bound<'_, PyAny>, name: &str) -> Result<Value, Fault> {
    convert(object, DEEPEST).map_err(|Unfit { place, what }| {
        let place = place.trim_start_matches('.');
        let dot = if place.is_empty() || place.starts_with('[') { "" } else { "." };
        Fault::bad(format!("{name}{dot}{place}: {what}"))
    })
}

/// Something of ours that a dict or a list is.
pub fn read<T: DeserializeOwned>(object: &Bound<'_, PyAny>, name: &str) -> Result<T, Fault> {
    let value = value(object, name)?;
    serde_json::from_value(value).map_err(|e| Fault::bad(format!("{name}: {e}")))
}

struct Unfit {
    place: String,
    what: String,
}

impl Unfit {
    fn new(what: impl Into<String>) -> Self {
        Self { place: String::new(), what: what.into() }
    }

    fn inside(self, place: String) -> Self {
        Self { place: place + &self.place, ..self }
    }
}

fn convert(object: &Bound<'_, PyAny>, depth: usize) -> Result<Value, Unfit> {
    let Some(depth) = depth.checked_sub(1) else {
        return Err(Unfit::new("lists or dicts lie too deep within each other"));
    };
    let list = |items: &mut dyn Iterator<Item = Bound<'_, PyAny>>| {
        let item = |(i, item)| convert(&item, depth).map_err(|u| u.inside(format!("[{i}]")));
        items.enumerate().map(item).collect::<Result<Vec<_>, _>>().map(Value::Array)
    };
    if let Ok(float) = object.cast::<PyFloat>() {
        let finite = Number::from_f64(float.value());
        return finite.map(Value::Number).ok_or_else(|| {
            Unfit::new(format!("is {}; every value must be finite", float.value()))
        });
    }
    if let Ok(items) = object.cast::<PyList>() {
        return list(&mut items.iter());
    }
    if let Ok(items) = object.cast::<PyTuple>() {
        return list(&mut items.iter());
    }
    if object.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(flag) = object.cast::<PyBool>() {
        return Ok(Value::Bool(flag.is_true()));
    }
    if let Ok(integer) = object.cast::<PyInt>() {
        return match integer.extract::<i64>() {
            Ok(integer) => Ok(integer.into()),
            Err(_) => {
                let float = integer.extract().ok().and_then(Number::from_f64);
                float.map(Value::Number).ok_or_else(|| Unfit::new("is too large a number"))
            }
        };
    }
    if let Ok(text) = object.cast::<PyString>() {
        return Ok(Value::String(text.to_string_lossy().into_owned()));
    }
    if let Ok(dict) = object.cast::<PyDict>() {
        let mut map = Map::new();
        for (key, item) in dict {
            let Ok(key) = key.extract::<String>() else {
                return Err(Unfit::new("has a key that is no text"));
            };
            let item = convert(&item, depth).map_err(|u| u.inside(format!(".{key}")))?;
            map.insert(key, item);
        }
        return Ok(Value::Object(map));
    }
    // Arrays and numbers of numpy.
    match object.call_method0("tolist") {
        Ok(plain) => convert(&plain, depth),
        Err(_) => {
            let kind = object.get_type().name().map_or("?".to_owned(), |n| n.to_string());
            Err(Unfit::new(format!("is a {kind}; expected a number, text, a list or a dict")))
        }
    }
}

/// JSON text as Python sees it.
pub fn loaded<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    static LOADS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    LOADS.import(py, "json", "loads")?.call1((text,))
}
