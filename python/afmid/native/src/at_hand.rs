//! Artifacts from NumPy arrays.

use afmid_pipeline::artifact::Shaped;
use afmid_stages::at_hand::{self, Named, ResponseAtHand};
use numpy::{Complex64, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::artifact::Artifact;
use crate::errors;
use crate::stage::checked;

/// Names and units of channels.
type Names = Vec<(String, String)>;

fn named(names: Names) -> Vec<Named> {
    names.into_iter().map(|(name, unit)| Named { name, unit }).collect()
}

/// Copies of the samples, which stages keep.
fn rows(arrays: &[PyReadonlyArray1<'_, f64>]) -> Vec<Vec<f64>> {
    arrays.iter().map(|array| array.as_array().to_vec()).collect()
}

/// Records of the same channels. Errors: unlike numbers of channels and names.
#[pyfunction]
pub fn recording(
    records: Vec<Vec<PyReadonlyArray1<'_, f64>>>,
    channels: Names,
    sample_rate_hz: f64,
) -> PyResult<Artifact> {
    let records = records.iter().map(|record| rows(record)).collect();
    let made = at_hand::recording(records, &named(channels), sample_rate_hz).map_err(errors::stage)?;
    Ok(Artifact(made.wrap()))
}

/// Free decays from their first sample on. Errors: as [`recording`].
#[pyfunction]
pub fn decays(hits: Vec<Vec<PyReadonlyArray1<'_, f64>>>, channels: Names, sample_rate_hz: f64) -> PyResult<Artifact> {
    let hits: Vec<Vec<Vec<f64>>> = hits.iter().map(|hit| rows(hit)).collect();
    Ok(Artifact(at_hand::decays(&hits, &named(channels), sample_rate_hz).map_err(errors::stage)?.wrap()))
}

/// Records of inputs and outputs, with the parameters `params` (JSON) of `io.columns`; and what that stage warns of.
#[pyfunction]
pub fn pair(
    records: Vec<[Vec<PyReadonlyArray1<'_, f64>>; 2]>,
    input_names: Names,
    output_names: Names,
    sample_rate_hz: f64,
    params: &str,
) -> PyResult<(Artifact, Vec<String>)> {
    let params = serde_json::from_str(params).map_err(errors::config)?;
    let names = [named(input_names), named(output_names)];
    let names = [&names[0][..], &names[1][..]];
    let records = records.iter().map(|[inputs, outputs]| [rows(inputs), rows(outputs)]).collect();
    let (pair, warnings) = at_hand::pair(records, names, sample_rate_hz, params).map_err(errors::stage)?;
    Ok((Artifact(pair.wrap()), warnings))
}

/// Name, values, variances, coherences, names of output and input.
type Response<'py> = (
    String,
    PyReadonlyArray1<'py, Complex64>,
    Option<PyReadonlyArray1<'py, f64>>,
    Option<PyReadonlyArray1<'py, f64>>,
    Option<[String; 2]>,
);

/// Frequency responses over the same frequencies, with the parameters `params` (JSON) of `io.frf`; and what that stage warns
/// of.
#[pyfunction]
pub fn frf(
    frequency_hz: PyReadonlyArray1<'_, f64>,
    responses: Vec<Response<'_>>,
    added_decay_per_s: f64,
    params: &str,
) -> PyResult<(Artifact, Vec<String>)> {
    let wanted = checked(params, ("files", serde_json::json!([""])))?;
    let row = |row: &PyReadonlyArray1<'_, f64>| row.as_array().to_vec();
    let response = |(name, values, variance, coherence, points): Response<'_>| ResponseAtHand {
        name,
        values: values.as_array().to_vec(),
        variance: variance.as_ref().map(row),
        coherence: coherence.as_ref().map(row),
        points,
    };
    let responses = responses.into_iter().map(response).collect();
    let (frf, warnings) =
        at_hand::frf(&row(&frequency_hz), responses, added_decay_per_s, &wanted).map_err(errors::stage)?;
    Ok((Artifact(frf.wrap()), warnings))
}

/// A power spectral density, with the parameters `params` (JSON) of `io.spectrum`; and what that stage warns of.
#[pyfunction]
pub fn density(
    frequency_hz: PyReadonlyArray1<'_, f64>,
    density: PyReadonlyArray1<'_, f64>,
    params: &str,
) -> PyResult<(Artifact, Vec<String>)> {
    let wanted = checked(params, ("file", "density".into()))?;
    let (frequency_hz, density) = (frequency_hz.as_array().to_vec(), density.as_array().to_vec());
    let (density, warnings) = at_hand::density(frequency_hz, density, &wanted).map_err(errors::stage)?;
    Ok((Artifact(density.wrap()), warnings))
}

/// Samples of the segments over which the spectrum of a record of noise is averaged.
#[pyfunction]
pub fn segment_samples(py: Python<'_>, values: PyReadonlyArray1<'_, f64>) -> usize {
    let values = values.as_array().to_vec();
    py.detach(|| at_hand::noise_segment_samples(&values))
}

/// The frequency response of one input and output, with the expected squared errors. Errors: unlike lengths.
#[pyfunction]
pub fn transfer(
    frequency_hz: PyReadonlyArray1<'_, f64>,
    transfer: PyReadonlyArray1<'_, Complex64>,
    variance: PyReadonlyArray1<'_, f64>,
    sample_rate_hz: f64,
) -> PyResult<Artifact> {
    let row = |row: PyReadonlyArray1<'_, f64>| row.as_array().to_vec();
    let made = at_hand::transfer(row(frequency_hz), transfer.as_array().to_vec(), row(variance), sample_rate_hz);
    Ok(Artifact(made.map_err(errors::stage)?.wrap()))
}
