//! `n3p.Vehicle`.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::Fault;
use crate::json;

/// A car: dimensions, steering limit and speeds. Metres, radians, metres per second.
///
/// The default is the paper's 2024 Honda Accord. A pose is that of the rear-axle centre.
///
/// Parameters
/// ----------
/// length : float
///     Bumper to bumper, metres.
/// width : float
///     Side to side, metres.
/// wheelbase : float
///     Rear to front axle, metres.
/// rear_overhang : float
///     Rear axle to rear bumper, metres.
/// max_steer : float
///     Largest steering angle of the front wheels, radians.
/// forward_speed, backward_speed : float
///     Speeds, m/s.
/// steer_rate : float
///     How fast the front wheels turn, rad/s.
///
/// Raises
/// ------
/// n3p.BadInput
///     For a value outside its range.
#[pyclass(frozen, module = "n3p", name = "Vehicle")]
pub struct Vehicle(pub n3p::Vehicle);

/// The vehicle that `object` is: a `Vehicle`, a dict of its fields, or nothing for the default.
pub fn vehicle(object: Option<&Bound<'_, PyAny>>) -> Result<n3p::Vehicle, Fault> {
    let Some(object) = object else { return Ok(n3p::Vehicle::default()) };
    if let Ok(vehicle) = object.cast::<Vehicle>() {
        return Ok(vehicle.get().0);
    }
    if !object.is_instance_of::<PyDict>() {
        return Err(Fault::bad("vehicle: expected a Vehicle, a dict of its fields, or None"));
    }
    let value = json::value(object, "vehicle")?;
    let vehicle: n3p::Vehicle =
        serde_json::from_value(value).map_err(|e| Fault::bad(format!("vehicle: {e}")))?;
    vehicle.validate().map_err(Fault::bad)?;
    Ok(vehicle)
}

#[pymethods]
impl Vehicle {
    #[new]
    #[pyo3(signature = (*, length=4.97, width=1.86, wheelbase=2.83, rear_overhang=1.10, max_steer=None, forward_speed=2.0, backward_speed=1.0, steer_rate=0.6))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn new(
        length: f64,
        width: f64,
        wheelbase: f64,
        rear_overhang: f64,
        max_steer: Option<f64>,
        forward_speed: f64,
        backward_speed: f64,
        steer_rate: f64,
    ) -> Result<Self, Fault> {
        let max_steer = max_steer.unwrap_or(n3p::Vehicle::default().max_steer);
        let vehicle = n3p::Vehicle {
            length,
            width,
            wheelbase,
            rear_overhang,
            max_steer,
            forward_speed,
            backward_speed,
            steer_rate,
        };
        vehicle.validate().map_err(Fault::bad)?;
        Ok(Self(vehicle))
    }

    /// Bumper to bumper, metres.
    #[getter]
    fn length(&self) -> f64 {
        self.0.length
    }

    /// Side to side, metres.
    #[getter]
    fn width(&self) -> f64 {
        self.0.width
    }

    /// Rear to front axle, metres.
    #[getter]
    fn wheelbase(&self) -> f64 {
        self.0.wheelbase
    }

    /// Rear axle to rear bumper, metres.
    #[getter]
    fn rear_overhang(&self) -> f64 {
        self.0.rear_overhang
    }

    /// Largest steering angle of the front wheels, radians.
    #[getter]
    fn max_steer(&self) -> f64 {
        self.0.max_steer
    }

    /// Speed when driving forward, m/s.
    #[getter]
    fn forward_speed(&self) -> f64 {
        self.0.forward_speed
    }

    /// Speed when driving backward, m/s.
    #[getter]
    fn backward_speed(&self) -> f64 {
        self.0.backward_speed
    }

    /// How fast the front wheels turn, rad/s.
    #[getter]
    fn steer_rate(&self) -> f64 {
        self.0.steer_rate
    }

    /// Radius of the rear axle's tightest circle, metres.
    #[getter]
    fn turning_radius(&self) -> f64 {
        self.0.turning_radius()
    }

    /// The fields by name: what a scene holds as its ``vehicle``.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::loaded(py, &serde_json::to_string(&self.0).expect("plain numbers"))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Vehicle>().is_ok_and(|other| other.get().0 == self.0)
    }

    fn __hash__(&self) -> u64 {
        self.0.length.to_bits()
            ^ self.0.width.to_bits().rotate_left(21)
            ^ self.0.wheelbase.to_bits()
    }

    fn __repr__(&self) -> String {
        let n3p::Vehicle { length, width, wheelbase, rear_overhang, max_steer, .. } = self.0;
        let n3p::Vehicle { forward_speed, backward_speed, steer_rate, .. } = self.0;
        format!(
            "Vehicle(length={length}, width={width}, wheelbase={wheelbase}, \
             rear_overhang={rear_overhang}, max_steer={max_steer}, \
             forward_speed={forward_speed}, backward_speed={backward_speed}, \
             steer_rate={steer_rate})"
        )
    }

    /// Pickles, and so copies, by its fields.
    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyAny>)> {
        Ok((PyTuple::empty(py), self.to_dict(py)?))
    }
}
