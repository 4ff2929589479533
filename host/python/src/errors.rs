//! The library's errors as Python's exceptions, with the sentences of the command line.

use jointwatch::Error;
use jointwatch::text::error::Kind;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// The exception of the package that goes with an error's kind.
pub(crate) fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let name = match error.kind {
        Kind::Usage => "UsageError",
        Kind::Data => "DataError",
        Kind::Failed | Kind::Found => "FailedError",
    };
    let made = py
        .import("jointwatch._errors")
        .and_then(|module| module.getattr(name))
        .and_then(|class| class.call1((error.line(),)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        // Without its package the extension still says what is wrong.
        Err(_) => PyRuntimeError::new_err(error.line()),
    }
}

/// What the library gave, or its error as an exception.
pub(crate) fn raised<T>(py: Python<'_>, result: jointwatch::Result<T>) -> PyResult<T> {
    result.map_err(|error| exception(py, &error))
}
