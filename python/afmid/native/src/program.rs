//! The command line.

use afmid_pipeline::own_command::own_arguments_are_last;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Runs the program; the last `count` arguments of the process are its own. Returns its exit code. It has the process to
/// itself: signals do what they do to the program.
#[pyfunction]
pub fn main(py: Python<'_>, count: usize) -> PyResult<u8> {
    own_arguments_are_last(count);
    py.detach(|| {
        let registry = afmid::registry().map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        Ok(afmid::exit_code(&registry))
    })
}
