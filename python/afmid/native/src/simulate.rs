//! Simulations with the model of a diagnosis.

use afmid_stages::causes::find;
use afmid_stages::diagnosis::{Drive, Simulation};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::errors;

/// The response, channel by channel, of a model (the JSON that `diagnosis.causes` hands on) to an input, or its free
/// motion over so many samples; from a state of deflection and rate / omega by section. Without the interpreter's lock.
///
/// Errors: an input that does not fit, a state of another size, a cause that is not there.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    model: &str,
    input: Option<PyReadonlyArray1<'py, f64>>,
    samples: usize,
    state: Option<PyReadonlyArray1<'py, f64>>,
) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
    let model: Simulation = serde_json::from_str(model).map_err(errors::config)?;
    let owned = |array: PyReadonlyArray1<'_, f64>| array.as_array().to_vec();
    let (input, state) = (input.map(owned), state.map(owned));
    let output = py.detach(|| {
        let drive = input.as_deref().map_or(Drive::Free(samples), Drive::Input);
        model.simulate(drive, state.as_deref(), find)
    });
    let output = output.map_err(|error| errors::stage(afmid_pipeline::StageError::from_error(error)))?;
    Ok(output.into_iter().map(|channel| channel.into_pyarray(py)).collect())
}
