//! Simulations with the model of a diagnosis.

use afmid_pipeline::StageError;
use afmid_stages::causes::find;
use afmid_stages::diagnosis::{Drive, Simulation};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::cause::{OwnCause, with_causes};
use crate::errors;
use crate::stage::listed;

/// The response, channel by channel, of a model (the JSON that `diagnosis.causes` hands on) to an input, or its free
/// motion over so many samples; from a state of deflection and rate / omega by section; `causes`: those of Python that it
/// has. Without the interpreter's lock.
///
/// Errors: an input that does not fit, a state of another size, a cause that is not there.
#[pyfunction]
#[pyo3(signature = (model, input, samples, state, causes = Vec::new()))]
pub fn simulate<'py>(
    py: Python<'py>,
    model: &str,
    input: Option<PyReadonlyArray1<'py, f64>>,
    samples: usize,
    state: Option<PyReadonlyArray1<'py, f64>>,
    causes: Vec<Py<OwnCause>>,
) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
    let model: Simulation = serde_json::from_str(model).map_err(errors::config)?;
    let owned = |array: PyReadonlyArray1<'_, f64>| array.as_array().to_vec();
    let (input, state) = (input.map(owned), state.map(owned));
    let causes = listed(&causes);
    let output = py.detach(|| {
        with_causes(&causes, || {
            let drive = input.as_deref().map_or(Drive::Free(samples), Drive::Input);
            let output = model.simulate(drive, state.as_deref(), find);
            output.map_err(|error| errors::stage(StageError::from_error(error)))
        })
    })?;
    Ok(output.into_iter().map(|channel| channel.into_pyarray(py)).collect())
}
