//! Artifacts from NumPy arrays.

use afmid_pipeline::artifact::Shaped;
use afmid_stages::at_hand::{self, Named};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::artifact::Artifact;
use crate::errors;

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

/// Inputs and outputs, with the parameters `params` (JSON) of `io.columns`; and what that stage warns of.
#[pyfunction]
pub fn pair(
    inputs: Vec<PyReadonlyArray1<'_, f64>>,
    outputs: Vec<PyReadonlyArray1<'_, f64>>,
    input_names: Names,
    output_names: Names,
    sample_rate_hz: f64,
    params: &str,
) -> PyResult<(Artifact, Vec<String>)> {
    let params = serde_json::from_str(params).map_err(errors::config)?;
    let names = [named(input_names), named(output_names)];
    let names = [&names[0][..], &names[1][..]];
    let (pair, warnings) =
        at_hand::pair(rows(&inputs), rows(&outputs), names, sample_rate_hz, params).map_err(errors::stage)?;
    Ok((Artifact(pair.wrap()), warnings))
}
