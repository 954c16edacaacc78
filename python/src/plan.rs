//! `n3p.Plan`.

use std::sync::OnceLock;

use numpy::ndarray::Dimension;
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use n3p::curves::trajectory::Moment;
use n3p::curves::{Clothoid, Segment, TrajectoryLimits};
use n3p::output::PathFile;
use n3p::world::{ParkingType, PreviousPath};

use crate::errors::{Fault, guarded};
use crate::json;

/// A path that has passed the exact swept collision check, and how it came about.
///
/// Arrays are read-only and made when first asked for.
#[pyclass(frozen, module = "n3p", name = "Plan")]
pub struct Plan {
    plan: n3p::Plan,
    file: OnceLock<PathFile>,
    poses: PyOnceLock<Py<PyArray2<f64>>>,
    gears: PyOnceLock<Py<PyArray1<i8>>>,
    steer: PyOnceLock<Py<PyArray1<f64>>>,
    steer_ends: [PyOnceLock<Py<PyArray1<f64>>>; 2],
    segments: PyOnceLock<Py<PyArray2<f64>>>,
}

impl Plan {
    pub fn new(plan: n3p::Plan) -> Self {
        Self {
            plan,
            file: OnceLock::new(),
            poses: PyOnceLock::new(),
            gears: PyOnceLock::new(),
            steer: PyOnceLock::new(),
            steer_ends: [PyOnceLock::new(), PyOnceLock::new()],
            segments: PyOnceLock::new(),
        }
    }

    /// The path for a request that is to keep to it.
    pub fn previous(&self) -> PreviousPath {
        self.plan.previous()
    }

    fn file(&self) -> &PathFile {
        self.file.get_or_init(|| self.plan.poses())
    }
}

/// Rows as an array (N, `W`).
pub fn rows<'py, T: Element + Copy, const W: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [T; W]>,
) -> Bound<'py, PyArray2<T>> {
    let count = rows.len();
    let flat: Vec<T> = rows.flatten().collect();
    table(py, flat, count, W)
}

/// Values, row by row, as an array (`count`, `width`).
pub fn table<T: Element>(
    py: Python<'_>,
    flat: Vec<T>,
    count: usize,
    width: usize,
) -> Bound<'_, PyArray2<T>> {
    PyArray1::from_vec(py, flat).reshape([count, width]).expect("as many values")
}

/// Name and value of a column.
type Column = (&'static str, fn(&Moment) -> f64);

fn frozen<T: Element, D: Dimension>(array: Bound<'_, PyArray<T, D>>) -> Py<PyArray<T, D>> {
    array.readwrite().make_nonwriteable();
    array.unbind()
}

#[pymethods]
impl Plan {
    /// Rear-axle poses at most 5 cm apart, float64 (N, 3): x, y (metres), heading (radians).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let make = || frozen(rows(py, self.file().poses.iter().copied()));
        self.poses.get_or_init(py, make).bind(py).clone()
    }

    /// Gear of the motion that follows each pose, int8 (N,): 1 forward, -1 backward. The last one is
    /// that of the motion that led there.
    #[getter]
    fn gears<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i8>> {
        let make = || frozen(PyArray1::from_slice(py, &self.file().gears));
        self.gears.get_or_init(py, make).bind(py).clone()
    }

    /// Angle of the front wheels of the motion that follows each pose, float64 (N,): radians,
    /// positive to the left.
    #[getter]
    fn steer<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let make = || frozen(PyArray1::from_slice(py, &self.file().steer));
        self.steer.get_or_init(py, make).bind(py).clone()
    }

    /// Angle of the front wheels at each pose, of the motion that follows it, float64 (N,). On the way to the next
    /// pose the curvature changes steadily to that of `steer_to`; both are `steer` for arcs.
    #[getter]
    fn steer_from<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let file = self.file();
        let make =
            || frozen(PyArray1::from_slice(py, file.steer_from.as_deref().unwrap_or(&file.steer)));
        self.steer_ends[0].get_or_init(py, make).bind(py).clone()
    }

    /// Angle of the front wheels with which the motion that follows each pose ends, float64 (N,).
    #[getter]
    fn steer_to<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let file = self.file();
        let make =
            || frozen(PyArray1::from_slice(py, file.steer_to.as_deref().unwrap_or(&file.steer)));
        self.steer_ends[1].get_or_init(py, make).bind(py).clone()
    }

    /// The path as motions of constant curvature, float64 (M, 2): curvature (1/m, positive to the
    /// left) and length (metres, negative backward). Driven one after the other from ``poses[0]``
    /// they lead to ``poses[-1]``, as exactly as numbers add up. Where the steering is continuous they are arcs from
    /// which the path is nowhere farther than half of the margin: see `motions`.
    #[getter]
    fn segments<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let row = |segment: &Segment| [segment.curvature, segment.length];
        let make = || frozen(rows(py, self.plan.path().segments.iter().map(row)));
        self.segments.get_or_init(py, make).bind(py).clone()
    }

    /// The path as motions of steadily changing curvature, float64 (M, 3): curvature where each begins and
    /// ends (1/m, positive to the left) and length (metres, negative backward).
    #[getter]
    fn motions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let row = |motion: &Clothoid| [motion.from, motion.to, motion.length];
        rows(py, self.plan.smooth_path().motions.iter().map(row))
    }

    /// Driven length, metres.
    #[getter]
    fn length(&self) -> f64 {
        self.plan.length()
    }

    /// Changes of gear on the way.
    #[getter]
    fn direction_changes(&self) -> usize {
        self.plan.direction_changes()
    }

    /// Node expansions that it took.
    #[getter]
    fn expansions(&self) -> usize {
        self.plan.expansions()
    }

    /// How guided planning came to it ("library", "direct", "searched", …); None for plain searches.
    #[getter]
    fn route(&self) -> Option<&'static str> {
        self.plan.route().map(n3p::planners::Route::name)
    }

    /// Which of the goals it leads to, from 0.
    #[getter]
    fn goal_index(&self) -> usize {
        self.plan.goal_index()
    }

    /// Clearance kept from what is next to start or goal, metres; from everything else at least what
    /// was asked for.
    #[getter]
    fn margin(&self) -> f64 {
        self.plan.margin()
    }

    /// How the goal lies in its spot, given or found; None where it is neither.
    #[getter]
    fn parking_type(&self) -> Option<&'static str> {
        self.plan.parking_type().map(ParkingType::name)
    }

    /// The method that planned it.
    #[getter]
    fn method(&self) -> &'static str {
        self.plan.method().name()
    }

    /// The path in time.
    ///
    /// Parameters
    /// ----------
    /// acceleration : float
    ///     Largest acceleration and braking, m/s².
    /// backward_acceleration : float, optional
    ///     The same in backward gear, where it differs.
    /// lateral_acceleration : float
    ///     Largest v²·|κ| at the rear axle, m/s².
    /// jerk : float
    ///     How fast the acceleration changes at most, m/s³.
    /// steer_rate : float, optional
    ///     How fast the front wheels turn, rad/s; the vehicle's where it is left out.
    /// stop_to_steer : bool
    ///     Whether the car stops wherever the steering angle jumps, and turns its wheels there.
    ///
    /// Returns
    /// -------
    /// Trajectory
    ///     A dict of columns, each (N,), with the unit in the name: ``time_s``, ``x_m``, ``y_m``,
    ///     ``heading_rad``, ``speed_mps``, ``acceleration_mps2``, ``steer_rad``,
    ///     ``curvature_per_m``, ``distance_m`` and ``gear``. Moments are 0.05 s apart.
    ///
    /// Raises
    /// ------
    /// n3p.BadInput
    ///     For a limit outside its range.
    #[pyo3(signature = (*, acceleration=1.0, backward_acceleration=None, lateral_acceleration=2.0, jerk=2.0, steer_rate=None, stop_to_steer=false))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn trajectory<'py>(
        &self,
        py: Python<'py>,
        acceleration: f64,
        backward_acceleration: Option<f64>,
        lateral_acceleration: f64,
        jerk: f64,
        steer_rate: Option<f64>,
        stop_to_steer: bool,
    ) -> Result<Bound<'py, PyAny>, Fault> {
        let limits = TrajectoryLimits {
            forward_acceleration: acceleration,
            backward_acceleration: backward_acceleration.unwrap_or(acceleration),
            lateral_acceleration,
            jerk,
            steer_rate: steer_rate.unwrap_or(self.plan.vehicle().steer_rate),
            stop_to_steer,
        };
        let driven = guarded(|| self.plan.trajectory(&limits))?.map_err(Fault::bad)?;
        let columns = PyDict::new(py);
        let numbers: [Column; 9] = [
            ("time_s", |m| m.time),
            ("x_m", |m| m.pose.x),
            ("y_m", |m| m.pose.y),
            ("heading_rad", |m| m.pose.heading),
            ("speed_mps", |m| m.speed),
            ("acceleration_mps2", |m| m.acceleration),
            ("steer_rad", |m| m.steer),
            ("curvature_per_m", |m| m.curvature),
            ("distance_m", |m| m.distance),
        ];
        for (name, value) in numbers {
            columns.set_item(name, PyArray1::from_iter(py, driven.moments.iter().map(value)))?;
        }
        let gears = driven.moments.iter().map(|m| m.gear.sign() as i8);
        columns.set_item("gear", PyArray1::from_iter(py, gears))?;
        let report = serde_json::to_string(&driven.report).expect("plain numbers");
        static TRAJECTORY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
        let class = TRAJECTORY.import(py, "n3p.columns", "Trajectory")?;
        Ok(class.call1((columns, json::loaded(py, &report)?))?)
    }

    /// The path file of ``n3p-plan --out`` (docs/formats.md), to the byte.
    fn to_json(&self) -> String {
        self.file().to_json()
    }

    /// How many poses there are.
    fn __len__(&self) -> usize {
        self.file().poses.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<Plan by {}: {:.2} m, {} direction changes>",
            self.plan.method(),
            self.plan.length(),
            self.plan.direction_changes()
        )
    }
}
