//! What a stage takes and hands on.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::content::content;

/// An artifact, as the stages share it.
#[pyclass(frozen, module = "afmid._native")]
pub struct Artifact(pub afmid_pipeline::Artifact);

#[pymethods]
impl Artifact {
    /// `array`, `table`, `state-space model`, `document` or `recording`.
    #[getter]
    fn shape(&self) -> &'static str {
        self.0.shape().name()
    }

    /// Its parts as NumPy arrays, numbers and text. Errors: a recording has none; rows in a file that cannot be read.
    fn content<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        content(py, &self.0)
    }
}
