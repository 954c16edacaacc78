//! `n3p.evaluate`: methods on scenes, as rows.

use std::collections::HashSet;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyString};

use n3p::episode::{self, CERTIFICATE, Case, EpisodeConfig, Row};
use n3p::n3p::MethodSettings;
use n3p::planners::goals::Terms;
use n3p::{Method, Models, world};

use crate::errors::{Fault, guarded};
use crate::inputs;
use crate::parker::{Settings, method};
use crate::scene::scene;

/// Runs methods on scenes: one row for each scene and method.
///
/// Times are medians of up to six runs, on one thread unless told otherwise. Every path has passed
/// the exact swept check of the planner; ``n3p-eval`` has a second check, written apart from it.
///
/// Parameters
/// ----------
/// scenes : iterable of Scene, dict or path
///     Their names must differ.
/// methods : iterable of str
///     Of ``n3p.METHODS``.
/// models : list of path, optional
///     Trained models of your own; those of the package where it is left out.
/// margin, allow_contact, effort, max_expansions, standstill_steering
///     As in `Parker`.
/// threads : int
///     More than one disturbs the times, never the results.
///
/// Returns
/// -------
/// Rows
///     A dict of columns, each (N,), in the order of docs/formats.md, which ``pandas.DataFrame``,
///     ``polars.DataFrame`` and ``pyarrow.table`` take. Numbers that describe a path are NaN where
///     there is none.
///
/// Raises
/// ------
/// n3p.BadInput
///     A method or a scene cannot be used.
#[pyfunction]
#[pyo3(signature = (scenes, methods=None, *, models=None, margin=0.0, allow_contact=0.0, effort="usual", max_expansions=200_000, standstill_steering="anywhere", threads=1))]
#[expect(clippy::too_many_arguments, reason = "they have names in Python")]
pub fn evaluate<'py>(
    py: Python<'py>,
    scenes: &Bound<'py, PyAny>,
    methods: Option<&Bound<'py, PyAny>>,
    models: Option<&Bound<'py, PyAny>>,
    margin: f64,
    allow_contact: f64,
    effort: &str,
    max_expansions: i64,
    standstill_steering: &str,
    threads: i64,
) -> Result<Bound<'py, PyAny>, Fault> {
    let cases = cases(scenes)?;
    let methods = self::methods(methods)?;
    let settings = Settings { models, effort, max_expansions };
    let standstill = inputs::standstill(standstill_steering)?;
    let config = EpisodeConfig {
        terms: Terms { margin, contact: allow_contact, standstill, ..Terms::default() },
        ..EpisodeConfig::new(settings.budget()?)
    };
    config.terms.check().map_err(Fault::bad)?;
    let Some(threads) = usize::try_from(threads).ok().filter(|n| (1..=1024).contains(n)) else {
        return Err(Fault::bad(format!("threads: is {threads}; expected 1 to 1024")));
    };
    let models = fitting(&cases, &methods, &settings)?;
    let mut rows = py.detach(|| guarded(|| run(&cases, &methods, &models, &config, threads)))??;
    episode::fill(&mut rows);
    columns(py, &rows)
}

fn cases(scenes: &Bound<'_, PyAny>) -> Result<Vec<Case>, Fault> {
    let wrong = || Fault::bad("scenes: expected a list of scenes");
    if scenes.is_instance_of::<PyString>() || scenes.is_instance_of::<PyDict>() {
        return Err(wrong());
    }
    let mut cases = Vec::new();
    let mut names = HashSet::new();
    for (index, item) in scenes.try_iter().map_err(|_| wrong())?.enumerate() {
        let (scene, level) = self::scene(&item?)?;
        let mut scene = world::Scene::clone(&scene);
        if scene.name.is_empty() {
            scene.name = format!("scene-{index:04}");
        }
        if !names.insert(scene.name.clone()) {
            let text =
                format!("scene name {:?} occurs twice; give every scene its own", scene.name);
            return Err(Fault::bad(text));
        }
        cases.push(Case { kind: scene.parking_type, level, set: String::new(), scene });
    }
    Ok(cases)
}

fn methods(methods: Option<&Bound<'_, PyAny>>) -> Result<Vec<Method>, Fault> {
    let Some(methods) = methods else { return Ok(vec![Method::N3P]) };
    let wrong = || Fault::bad("methods: expected a list of names, such as [\"n3p\", \"ha-rs\"]");
    if methods.is_instance_of::<PyString>() {
        return Err(wrong());
    }
    let mut all: Vec<Method> = Vec::new();
    for name in methods.try_iter().map_err(|_| wrong())? {
        let name: String = crate::inputs::text(&name?, "methods")?;
        let method = method(&name, "methods")?;
        if all.contains(&method) {
            return Err(Fault::bad(format!("methods: names {method} twice; once is enough")));
        }
        all.push(method);
    }
    Ok(all)
}

/// Models that serve the vehicle of every scene.
fn fitting(
    cases: &[Case],
    methods: &[Method],
    settings: &Settings<'_, '_>,
) -> Result<Models, Fault> {
    let first = cases.first().map_or_else(Default::default, |c| c.scene.vehicle);
    let mut models = settings.models(methods, &first)?;
    // The package has a model for any vehicle besides those of some: it is added where one needs it.
    let unserved = |c: &&Case| models.selector(Method::N3P, &c.scene.vehicle).is_none();
    if let Some(case) = cases.iter().find(unserved) {
        models = settings.models(methods, &case.scene.vehicle)?;
    }
    for method in methods {
        method.build(&models, &MethodSettings::default()).map_err(Fault::bad)?;
        for Case { scene, kind, .. } in cases {
            models.check_vehicle(*method, &scene.name, &scene.vehicle).map_err(Fault::bad)?;
            if let (Some(kind), true) = (kind, method.needs_model()) {
                models.check_kind(*method, &scene.vehicle, *kind).map_err(Fault::bad)?;
            }
        }
    }
    Ok(models)
}

/// Scene after scene, its methods in their order; each thread has planners of its own.
fn run(
    cases: &[Case],
    methods: &[Method],
    models: &Models,
    config: &EpisodeConfig,
    threads: usize,
) -> Result<Vec<Row>, Fault> {
    let next = AtomicUsize::new(0);
    let work = || -> Result<Vec<(usize, Row)>, Fault> {
        let build = |m: &Method| m.build(models, &MethodSettings::default());
        let mut planners: Vec<_> =
            methods.iter().map(build).collect::<Result<_, _>>().map_err(Fault::bad)?;
        let mut done = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(i) else { return Ok(done) };
            for planner in &mut planners {
                let episode = episode::run(case, planner.as_mut(), config, &CERTIFICATE)
                    .map_err(|e| Fault::bad(format!("scene {}: {e}", case.scene.name)))?;
                done.push((i, episode.row));
            }
        }
    };
    let mut rows = thread::scope(|scope| {
        let others: Vec<_> = (1..threads.min(cases.len())).map(|_| scope.spawn(work)).collect();
        let mut rows = work()?;
        for other in others {
            rows.extend(other.join().expect("episodes do not panic")?);
        }
        Ok::<_, Fault>(rows)
    })?;
    rows.sort_by_key(|(i, _)| *i);
    Ok(rows.into_iter().map(|(_, row)| row).collect())
}

fn columns<'py>(py: Python<'py>, rows: &[Row]) -> Result<Bound<'py, PyAny>, Fault> {
    let columns = PyDict::new(py);
    for name in Row::COLUMNS {
        let text = |value: fn(&Row) -> &str| -> PyResult<Bound<'py, PyAny>> {
            rows.iter().map(value).collect::<Vec<_>>().into_pyobject(py)
        };
        let number = |value: fn(&Row) -> Option<f64>| {
            PyArray1::from_iter(py, rows.iter().map(|r| value(r).unwrap_or(f64::NAN))).into_any()
        };
        let flag =
            |value: fn(&Row) -> bool| PyArray1::from_iter(py, rows.iter().map(value)).into_any();
        let column = match name {
            "scene" => text(|r| &r.scene)?,
            "type" => text(|r| r.kind.map_or("", world::ParkingType::name))?,
            "level" => text(|r| r.level.map_or("", world::Level::name))?,
            "method" => text(|r| &r.method)?,
            "ok" => flag(|r| r.ok),
            "reason" => text(|r| &r.reason)?,
            "plan_time_s" => number(|r| Some(r.plan_time_s)),
            "length_m" => number(|r| r.length_m),
            "direction_changes" => number(|r| r.direction_changes.map(f64::from)),
            "max_abs_steer_rad" => number(|r| r.max_abs_steer_rad),
            "mean_abs_steer_change_rad" => number(|r| r.mean_abs_steer_change_rad),
            "nodes" => PyArray1::from_iter(py, rows.iter().map(|r| i64::from(r.nodes))).into_any(),
            "min_clearance_m" => number(|r| r.min_clearance_m),
            "fallback" => flag(|r| r.fallback),
            "checked" => text(|r| &r.checked)?,
            "route" => text(|r| &r.route)?,
            "cost_over_best" => number(|r| r.cost_over_best),
            "changes_over_fewest" => number(|r| r.changes_over_fewest.map(f64::from)),
            "way_clearance_m" => number(|r| r.way_clearance_m),
            "set" => text(|r| &r.set)?,
            other => return Err(Fault::Bug(format!("column {other} is not known here"))),
        };
        columns.set_item(name, column)?;
    }
    static ROWS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    Ok(ROWS.import(py, "n3p.columns", "Rows")?.call1((columns,))?)
}
