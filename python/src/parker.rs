//! `n3p.Parker`.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use n3p::planners::cost::CostModel;
use n3p::planners::{Budget, Effort, Shape};
use n3p::{Method, Models, world};

use crate::errors::{Fault, guarded};
use crate::inputs::{self, LotArguments, RequestArguments};
use crate::json;
use crate::plan::Plan;
use crate::scene::{Scene, scene};
use crate::vehicle::{Vehicle, vehicle};

/// Plans for one vehicle; made once, asked as often as one likes, from any number of threads.
///
/// Equal questions have equal answers, in whatever order and from whichever thread they are asked.
///
/// Parameters
/// ----------
/// vehicle : Vehicle or dict, optional
///     The car; the paper's 2024 Honda Accord where it is left out.
/// method : str
///     One of ``n3p.METHODS``. ``"n3p"`` takes known manoeuvres and searches where none fits,
///     ``"ha-rs"`` always searches.
/// models : list of path, optional
///     Trained models of your own; those of the package where it is left out.
/// margin : float
///     Clearance to obstacles, metres, 0 to 1; less than 5 mm means 5 mm. Where start or goal is
///     nearer to an obstacle, less is kept from that one.
/// allow_contact : float
///     How deep start and goal may reach into obstacles, metres, 0 to 0.2.
/// effort : {"first", "usual", "most"}
///     What becomes of a first path: "first" takes it as it is.
/// max_expansions : int
///     Work that a plan may take, in node expansions.
/// standstill_steering : {"anywhere", "at-changes", "never"}
///     Where the steering wheel may be turned while the car stands: "anywhere" plans arcs and straights, the
///     others paths on which the steering angle is continuous while the car drives.
/// least_move, last_straight : float, optional
///     The least length between changes of gear and of the straight at the end, metres, where there is room;
///     0.3 and 0.5 for a usual car where the steering is continuous, else 0.
/// cost : dict, optional
///     Weights of the costs by which plans are chosen, such as ``{"gear_change": 6.0}``: ``forward``,
///     ``backward``, ``gear_change``, ``steer``, ``steer_change``, ``clearance``, ``near``.
///
/// Raises
/// ------
/// n3p.BadInput
///     Says which argument is wrong, and what would be right.
#[pyclass(frozen, module = "n3p", name = "Parker")]
pub struct Parker(n3p::Parker);

/// The methods that this package can plan by: all but policies, for which it has no engine.
pub fn methods() -> impl Iterator<Item = Method> {
    Method::all().filter(|method| !method.is_policy())
}

/// The one of this name; `argument` is where it was given.
pub fn method(name: &str, argument: &str) -> Result<Method, Fault> {
    methods().find(|method| method.name() == name).ok_or_else(|| {
        let what = match name.parse::<Method>() {
            Ok(policy) => format!("{policy} is a policy, which this package cannot drive"),
            Err(_) => format!("unknown method {name:?}"),
        };
        let expected: Vec<_> = methods().map(Method::name).collect();
        Fault::bad(format!("{argument}: {what}; expected one of {}", expected.join(", ")))
    })
}

/// How a planner is to work, as keyword arguments.
pub struct Settings<'a, 'py> {
    pub models: Option<&'a Bound<'py, PyAny>>,
    pub effort: &'a str,
    pub max_expansions: i64,
}

impl Settings<'_, '_> {
    /// The models for `methods` with a car: given files, or those of the package.
    pub fn models(&self, methods: &[Method], vehicle: &n3p::Vehicle) -> Result<Models, Fault> {
        let Some(files) = self.models else {
            // Only the paper's own row of the network needs more than `n3p` does.
            return match methods.contains(&Method::MLP_N3P) {
                true => Models::usual(methods, Some(vehicle)).map_err(Fault::bad),
                false => Models::compiled_in(vehicle).map_err(Fault::bad),
            };
        };
        let wrong = || Fault::bad("models: expected a list of paths");
        if files.is_instance_of::<PyString>() {
            return Err(wrong());
        }
        let file = |file: PyResult<Bound<'_, PyAny>>| inputs::path(&file?).ok_or_else(wrong);
        let files: Vec<PathBuf> =
            files.try_iter().map_err(|_| wrong())?.map(file).collect::<Result<_, _>>()?;
        Models::load(&files).map_err(Fault::bad)
    }

    pub fn budget(&self) -> Result<Budget, Fault> {
        let effort: Effort = self
            .effort
            .parse()
            .map_err(|e| Fault::bad(format!("effort: {:?}: {e}", self.effort)))?;
        let max_expansions = usize::try_from(self.max_expansions).map_err(|_| {
            Fault::bad(format!("max_expansions: is {}; expected 0 or more", self.max_expansions))
        })?;
        Ok(Budget { max_expansions, effort })
    }
}

#[pymethods]
impl Parker {
    #[new]
    #[pyo3(signature = (vehicle=None, method="n3p", models=None, margin=0.0, allow_contact=0.0, effort="usual", max_expansions=200_000, standstill_steering="anywhere", least_move=None, last_straight=None, cost=None))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn new(
        py: Python<'_>,
        vehicle: Option<&Bound<'_, PyAny>>,
        method: &str,
        models: Option<&Bound<'_, PyAny>>,
        margin: f64,
        allow_contact: f64,
        effort: &str,
        max_expansions: i64,
        standstill_steering: &str,
        least_move: Option<f64>,
        last_straight: Option<f64>,
        cost: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Fault> {
        let vehicle = self::vehicle(vehicle)?;
        let standstill = inputs::standstill(standstill_steering)?;
        let method = self::method(method, "method")?;
        let settings = Settings { models, effort, max_expansions };
        let (models, budget) = (settings.models(&[method], &vehicle)?, settings.budget()?);
        let made = py.detach(|| guarded(|| n3p::Parker::by(method, vehicle, models)))?;
        let mut made = made?.margin(margin)?.allow_contact(allow_contact)?.budget(budget);
        made = made.standstill_steering(standstill);
        made = made.shape(Shape { least_move, last_straight })?;
        if let Some(cost) = cost {
            let value = json::value(cost, "cost")?;
            let cost: CostModel =
                serde_json::from_value(value).map_err(|e| Fault::bad(format!("cost: {e}")))?;
            made = py.detach(|| guarded(|| made.cost(cost)))??;
        }
        Ok(Self(made))
    }

    /// Plans from ``start`` to ``goal`` among what is given.
    ///
    /// Parameters
    /// ----------
    /// start, goal, polygons, polylines, points, grid, bounds, goals, tolerance, parking_type, low, drivable_area, contour, margins, start_steer, previous
    ///     As in `Scene`: metres and radians, in any frame that all share.
    ///
    /// Returns
    /// -------
    /// Plan
    ///
    /// Raises
    /// ------
    /// n3p.BadInput
    ///     What is given makes no sense, or start or goal is not free.
    /// n3p.NoPath
    ///     There is no path, or none was found; its ``reason`` says which.
    #[pyo3(signature = (start, goal=None, *, polygons=None, polylines=None, points=None, grid=None, bounds=None, goals=None, tolerance=None, parking_type=None, low=None, drivable_area=None, contour=None, margins=None, start_steer=0.0, previous=None))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn plan(
        &self,
        py: Python<'_>,
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
    ) -> Result<Plan, Fault> {
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
        let plan = py.detach(|| guarded(|| self.0.plan_request(&request, &lot)))??;
        Ok(Plan::new(plan))
    }

    /// Plans a scene, whose vehicle must be the one planned for.
    ///
    /// Parameters
    /// ----------
    /// scene : Scene, dict or path
    ///     A scene, a dict of the scene format (docs/formats.md), or a file.
    ///
    /// Returns
    /// -------
    /// Plan
    ///
    /// Raises
    /// ------
    /// n3p.BadInput
    ///     It is no scene, has another vehicle, or its start or goal is not free.
    /// n3p.NoPath
    ///     There is no path, or none was found; its ``reason`` says which.
    fn plan_scene(&self, py: Python<'_>, scene: &Bound<'_, PyAny>) -> Result<Plan, Fault> {
        let (scene, _) = self::scene(scene)?;
        let plan = py.detach(|| guarded(|| self.0.plan_scene(&scene)))??;
        Ok(Plan::new(plan))
    }

    /// Plans many by all cores, while other Python threads run; the same plans as one by one.
    ///
    /// Parameters
    /// ----------
    /// requests : iterable
    ///     Scenes (`Scene`, dict of the scene format, path), and dicts of the arguments of `plan`.
    ///     `Scene` objects are fastest: nothing is converted.
    ///
    /// Returns
    /// -------
    /// list of Plan or n3p.N3PError
    ///     One for each, in order: its plan, or the exception that `plan` would raise.
    fn plan_batch<'py>(
        slf: &Bound<'py, Self>,
        requests: &Bound<'py, PyAny>,
    ) -> Result<Vec<Py<PyAny>>, Fault> {
        let py = slf.py();
        let wrong = || Fault::bad("requests: expected a list of scenes");
        if requests.is_instance_of::<PyString>() || requests.is_instance_of::<PyDict>() {
            return Err(wrong());
        }
        let items = requests.try_iter().map_err(|_| wrong())?;
        let mut scenes = Vec::new();
        let mut faults = Vec::new();
        for (index, item) in items.enumerate() {
            match Self::requested(slf, &item?) {
                Ok(scene) => scenes.push(scene),
                // Python's own, such as KeyboardInterrupt, end it all.
                Err(Fault::Python(error)) => return Err(error.into()),
                Err(fault) => faults.push((index, fault)),
            }
        }
        let parker = &slf.get().0;
        let plans = py.detach(|| guarded(|| parker.plan_scenes(&scenes)))?;
        drop(scenes);
        let exception = |fault: Fault| PyErr::from(fault).into_value(py).into_any();
        let mut all = Vec::with_capacity(plans.len() + faults.len());
        let mut faults = faults.into_iter().peekable();
        for plan in plans {
            while let Some((_, fault)) = faults.next_if(|(index, _)| *index == all.len()) {
                all.push(exception(fault));
            }
            all.push(match plan {
                Ok(plan) => Py::new(py, Plan::new(plan))?.into_any(),
                Err(error) => exception(error.into()),
            });
        }
        all.extend(faults.map(|(_, fault)| exception(fault)));
        Ok(all)
    }

    /// The scene of a request for this parker's vehicle: made once, planned often.
    ///
    /// Parameters
    /// ----------
    /// start, goal, polygons, polylines, points, grid, bounds, goals, tolerance, parking_type, name
    ///     As in `Scene`.
    ///
    /// Returns
    /// -------
    /// Scene
    #[pyo3(signature = (start, goal=None, **arguments))]
    fn scene<'py>(
        &self,
        py: Python<'py>,
        start: &Bound<'py, PyAny>,
        goal: Option<&Bound<'py, PyAny>>,
        arguments: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let all = arguments.map_or_else(|| Ok(PyDict::new(py)), |given| given.copy())?;
        all.set_item("vehicle", Vehicle(*self.0.vehicle()))?;
        py.get_type::<Scene>().call((start, goal), Some(&all))
    }

    /// The vehicle planned for.
    #[getter]
    fn vehicle(&self) -> Vehicle {
        Vehicle(*self.0.vehicle())
    }

    /// The method planned by.
    #[getter]
    fn method(&self) -> &'static str {
        self.0.method().name()
    }

    fn __repr__(&self) -> String {
        format!("<Parker by {}>", self.0.method())
    }
}

impl Parker {
    /// The scene of one item of a batch.
    fn requested(
        slf: &Bound<'_, Self>,
        item: &Bound<'_, PyAny>,
    ) -> Result<Arc<world::Scene>, Fault> {
        let Ok(dict) = item.cast::<PyDict>() else { return Ok(scene(item)?.0) };
        if dict.contains("obstacles")? || dict.contains("vehicle")? {
            return Ok(scene(item)?.0);
        }
        let made = slf.call_method("scene", (), Some(dict));
        let made = made.map_err(|error| {
            // Names of arguments that are missing or that there are none of.
            let of_arguments = error.is_instance_of::<pyo3::exceptions::PyTypeError>(slf.py());
            if of_arguments { Fault::bad(error.value(slf.py())) } else { own(slf.py(), error) }
        })?;
        Ok(scene(&made)?.0)
    }
}

/// An exception of ours as the fault that it was.
fn own(py: Python<'_>, error: PyErr) -> Fault {
    let bad = py.import("n3p.errors").and_then(|m| m.getattr("BadInput"));
    match bad.is_ok_and(|bad| error.matches(py, bad).unwrap_or(false)) {
        true => Fault::bad(error.value(py)),
        false => Fault::Python(error),
    }
}
