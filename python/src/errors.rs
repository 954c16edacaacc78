//! What goes wrong, and the exceptions that it becomes.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

use n3p::{ParkerError, PlanError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;

/// Anything that ends a call; an exception once Python hears of it.
pub enum Fault {
    /// `n3p.BadInput`: what was given cannot be used.
    BadInput(String),
    /// `n3p.NoPath`, with its reason.
    NoPath(String),
    /// `n3p.N3PError` itself: a bug of ours.
    Bug(String),
    /// An exception of Python's own.
    Python(PyErr),
}

impl Fault {
    pub fn bad(message: impl Display) -> Self {
        Self::BadInput(message.to_string())
    }
}

impl From<PyErr> for Fault {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

impl From<PlanError> for Fault {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::NoPath(reason) => Self::NoPath(reason.to_string()),
            other => Self::bad(other),
        }
    }
}

impl From<ParkerError> for Fault {
    fn from(error: ParkerError) -> Self {
        Self::bad(error)
    }
}

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> PyErr {
        static BAD_INPUT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        static NO_PATH: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        static N3P_ERROR: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let (class, name, text) = match fault {
            Fault::Python(error) => return error,
            Fault::BadInput(text) => (&BAD_INPUT, "BadInput", text),
            Fault::NoPath(text) => (&NO_PATH, "NoPath", text),
            Fault::Bug(text) => (&N3P_ERROR, "N3PError", text),
        };
        Python::attach(|py| match class.import(py, "n3p.errors", name) {
            Ok(class) => PyErr::from_type(class.clone(), (text,)),
            Err(error) => error,
        })
    }
}

/// Does `work`; a panic in it, which would be a bug, becomes an exception that `except Exception`
/// catches, not PyO3's own, which it lets through.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, Fault> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
        Fault::Bug(format!("a bug of n3p, please report it: {text}"))
    })
}
