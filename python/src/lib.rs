//! The Python package `n3p`, as far as it is Rust: `n3p._n3p`.
//!
//! What users see is documented in `docs/python.md` and in the docstrings below, which are the
//! comments of the items. [`inputs`] takes numbers in whatever form Python has them, [`json`] dicts;
//! whatever is wrong with them becomes a [`errors::Fault`], and that an exception of `n3p/errors.py`.
//! While Rust plans or steps environments, other Python threads run.

mod environments;
mod errors;
mod evaluate;
mod inputs;
mod json;
mod parker;
mod plan;
mod scene;
mod vehicle;

use pyo3::prelude::*;

/// What of the package n3p is Rust. Use it through `n3p`.
#[pymodule]
fn _n3p(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("METHODS", parker::methods().map(n3p::Method::name).collect::<Vec<_>>())?;
    m.add_class::<vehicle::Vehicle>()?;
    m.add_class::<scene::Scene>()?;
    m.add_class::<parker::Parker>()?;
    m.add_class::<plan::Plan>()?;
    m.add_class::<environments::Environments>()?;
    m.add_function(wrap_pyfunction!(scene::load_map, m)?)?;
    m.add_function(wrap_pyfunction!(scene::load_scene, m)?)?;
    m.add_function(wrap_pyfunction!(scene::generate, m)?)?;
    m.add_function(wrap_pyfunction!(evaluate::evaluate, m)?)
}
