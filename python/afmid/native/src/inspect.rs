//! `afmid.inspect`.

use pyo3::prelude::*;

/// What `afmid inspect --json` says of a file, as JSON.
#[pyfunction]
pub fn inspect(py: Python<'_>, path: std::path::PathBuf) -> String {
    py.detach(|| afmid::inspect_json(&path))
}
