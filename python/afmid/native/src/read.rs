//! `afmid.read`.

use std::path::PathBuf;

use afmid_pipeline::recording::{FoundChannel, InputFiles, Reading, WholeFile};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors;

/// The channels of a file of any format: samples in their units, NaN where one is missing, clock and names. Errors: as
/// the readers.
#[pyfunction]
pub fn read<'py>(py: Python<'py>, path: PathBuf, format: &str) -> PyResult<Bound<'py, PyDict>> {
    let opened = py.detach(|| {
        let file = WholeFile::open(&InputFiles::new(), &path, &Reading::of(format, None))?;
        let channels = file.contents().channels.clone();
        let values = channels.iter().map(|channel| file.read(channel)).collect::<Result<Vec<_>, _>>()?;
        Ok((file, channels, values))
    });
    let (file, channels, values) =
        opened.map_err(|error: afmid_pipeline::StageError| errors::stage(error.at(&path)))?;
    let all = PyList::empty(py);
    for (channel, values) in channels.iter().zip(values) {
        all.append(described(py, channel, values)?)?;
    }
    let found = PyDict::new(py);
    found.set_item("format", &file.contents().format)?;
    found.set_item("started_at", &file.contents().started_at)?;
    found.set_item("remarks", &file.contents().remarks)?;
    found.set_item("channels", all)?;
    Ok(found)
}

fn described<'py>(py: Python<'py>, channel: &FoundChannel, values: Vec<f64>) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("location", &channel.location)?;
    found.set_item("long_name", &channel.long_name)?;
    found.set_item("units", &channel.unit)?;
    found.set_item("is_axis", channel.is_axis)?;
    found.set_item("gaps", &channel.gaps)?;
    found.set_item("start_s", channel.start_s)?;
    found.set_item("sample_rate_hz", channel.sample_rate_hz)?;
    found.set_item("rate_relative_std", channel.rate_relative_std)?;
    found.set_item("rate_is_guess", channel.rate_is_guess)?;
    found.set_item("values", values.into_pyarray(py))?;
    Ok(found)
}
