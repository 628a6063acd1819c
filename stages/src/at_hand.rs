//! Artifacts made of arrays at hand, for stages that are run by themselves, without a file.

use std::sync::Arc;

use afmid_kernels::spectra::{resonance_segment, segment_samples};
use afmid_pipeline::recording::Raw;
use afmid_pipeline::{Array, Channel, Recording, StageError};
use num_complex::Complex64;

pub use crate::artifacts::Sensor as Named;
use crate::artifacts::{bare_transfer, decay_array};
pub use crate::io::columns::{Recorded, pair_of_series as pair};
pub use crate::io::density_of_values as density;
pub use crate::io::frf::{ResponseAtHand, frf_of_responses as frf};
use crate::io::{MemorySource, ascending, memory_record};

/// What `io.records` hands on: records of as many samples in each of these channels. Errors: a record with another
/// number of channels than names.
pub fn recording(
    records: Vec<Vec<Vec<f64>>>,
    channels: &[Named],
    sample_rate_hz: f64,
) -> Result<Recording, StageError> {
    let channel = |(named, values): (&Named, Vec<f64>)| Channel {
        role: crate::artifacts::DEFLECTION.to_owned(),
        location: named.name.clone(),
        samples: values.len(),
        unit: named.unit.clone(),
        long_name: String::new(),
        scale_factor: 1.0,
        add_offset: 0.0,
        fill_code: None,
        source: Arc::new(MemorySource(Raw::Float64(values))),
    };
    let mut made = Vec::with_capacity(records.len());
    for (number, record) in records.into_iter().enumerate() {
        as_many(record.len(), channels)?;
        let channels = channels.iter().zip(record).map(channel).collect();
        made.push(memory_record(&format!("record {number}"), sample_rate_hz, channels));
    }
    Ok(Recording { records: made })
}

/// What `events.decay` hands on: free decays from their first sample on, NaN where one is missing. Errors: as
/// [`recording`].
pub fn decays(hits: &[Vec<Vec<f64>>], channels: &[Named], sample_rate_hz: f64) -> Result<Array, StageError> {
    hits.iter().try_for_each(|hit| as_many(hit.len(), channels))?;
    decay_array(hits, &[], channels, sample_rate_hz)
}

/// What `spectrum.etfe` hands on: a frequency response of one input and output with the expected squared errors. Errors:
/// frequencies that do not ascend, lengths that do not fit.
pub fn transfer(
    frequency_hz: Vec<f64>,
    transfer: Vec<Complex64>,
    variance: Vec<f64>,
    sample_rate_hz: f64,
) -> Result<Array, StageError> {
    ascending(&frequency_hz)?;
    bare_transfer(frequency_hz, transfer, variance, sample_rate_hz)
}

/// Samples of the segments over which the spectrum of a record of noise is averaged, as `new pipeline` takes them: so that
/// its resonance is resolved; where it has none, at least 30 in the record.
pub fn noise_segment_samples(values: &[f64]) -> usize {
    resonance_segment(values).unwrap_or_else(|| segment_samples(values.len()))
}

fn as_many(found: usize, channels: &[Named]) -> Result<(), StageError> {
    match found == channels.len() {
        true => Ok(()),
        false => Err(StageError::new(format!("{found} channels, wanted {} as there are names", channels.len()))),
    }
}
