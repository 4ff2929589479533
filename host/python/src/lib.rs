//! The extension behind the Python package `jointwatch`: the library's own functions on numpy's
//! arrays.
//!
//! The package in `python/jointwatch` is what users see. It describes their arrays, and it turns
//! the JSON texts from here into objects. Everything that takes long lets go of Python's lock, and
//! ends at Ctrl-C ([`follow`]).

mod errors;
mod follow;
mod model;
mod results;
mod study;
mod sums;

use pyo3::prelude::*;

/// The extension module `jointwatch._native`, which the Python package builds on.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<sums::Plan>()?;
    module.add_function(wrap_pyfunction!(sums::merge_sums, module)?)?;
    module.add_function(wrap_pyfunction!(sums::describe_sums, module)?)?;
    module.add_function(wrap_pyfunction!(sums::identify_sums, module)?)?;
    module.add_class::<study::Study>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<results::Comparison>()?;
    module.add_class::<results::Diagnosis>()?;
    module.add_class::<results::Added>()?;
    module.add_class::<results::Response>()
}
