//! Errors of stages and readers as exceptions of the package.

use std::fmt::Display;

use afmid_pipeline::StageError;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// An exception `afmid.errors.NAME`: what was found, where, what to do. Errors: the package is not whole.
fn exception(name: &str, problem: &str, file: Option<String>, help: Option<String>) -> PyErr {
    Python::attach(|py| {
        let made = || -> PyResult<PyErr> {
            let class = py.import("afmid.errors")?.getattr(name)?.cast_into::<PyType>()?;
            Ok(PyErr::from_value(class.call1((problem, file, help))?))
        };
        made().unwrap_or_else(|error| error)
    })
}

/// Data that cannot be used.
pub fn stage(error: StageError) -> PyErr {
    let file = error.place.as_ref().map(|place| place.display().to_string());
    exception("DataError", &error.problem, file, error.help)
}

/// A parameter that is wrong.
pub fn config(problem: impl Display) -> PyErr {
    exception("ConfigError", &problem.to_string(), None, None)
}
