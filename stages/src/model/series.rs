//! The series of a pair that a model is fitted to.

use afmid_pipeline::{Array, StageError};

use super::pem::DataSet;

/// Inputs and output of one set, from a first sample on.
pub(super) struct PairSeries {
    /// Inputs, one after the other.
    pub input: Vec<f64>,
    pub output: Vec<f64>,
    pub time: Vec<f64>,
    pub unit: String,
    pub rate: f64,
}

impl PairSeries {
    /// Of a set that may have a time axis of its own. Errors: a variable that is not there, or lengths that do not fit.
    pub fn new(pair: &Array, set: DataSet, first: usize) -> Result<Self, StageError> {
        let suffix = set.suffix();
        let response = pair.variable(&format!("response{suffix}"))?;
        let output = pair.real(&response.name)?;
        let force = pair.real(&format!("force{suffix}"))?;
        let samples = output.len();
        if samples == 0 || !force.len().is_multiple_of(samples) || force.is_empty() {
            return Err(StageError::new(format!("the force has {} samples, the response {samples}", force.len())));
        }
        let axis = response.dims.last().ok_or_else(|| StageError::new("the response has no time axis"))?;
        let time = &pair.axis(axis)?.values;
        if first >= samples || time.len() != samples {
            return Err(StageError::new(format!("the pair has {samples} samples, wanted more than {first}")));
        }
        Ok(Self {
            input: force.chunks_exact(samples).flat_map(|u| u[first..].to_vec()).collect(),
            output: output[first..].to_vec(),
            time: time[first..].to_vec(),
            unit: response.unit.clone(),
            rate: pair.number("sample_rate_hz")?,
        })
    }
}
