//! Windows of noise alone from the records.

use afmid_pipeline::{Record, Recording, StageError};
use rayon::prelude::*;

use crate::artifacts::deflection;
use crate::calibration::FreeSettings;
use crate::calibration::reading::{common_rate, read_blocks, read_free};

/// Windows that are used of all records together: their variances are known to some per cent then, and they fit in
/// memory.
const WINDOWS: usize = 256;

/// Windows of `samples` samples from the free stretches of the records, as many of each record, evenly spread over it.
pub(crate) fn windows(
    recording: &Recording,
    settings: FreeSettings,
    samples: usize,
    rate: f64,
) -> Result<Vec<Vec<f64>>, StageError> {
    let records = &recording.records;
    let found = common_rate(records)?;
    if found != rate {
        return Err(StageError::new(format!(
            "the records have {found} samples per second, the events {rate}: wanted the records that the events are from"
        )));
    }
    let each = WINDOWS.div_ceil(records.len().max(1));
    let all: Vec<Vec<Vec<f64>>> = records
        .par_iter()
        .map(|record| of_record(record, settings, samples, each))
        .collect::<Result<_, StageError>>()?;
    let all: Vec<Vec<f64>> = all.into_iter().flatten().collect();
    if all.is_empty() {
        return Err(StageError::new(format!("no free stretch of {samples} samples in {} records", records.len()))
            .help("lower `free.settle_s`, cut shorter windows, or leave the port `free` open"));
    }
    Ok(all)
}

fn of_record(
    record: &Record,
    settings: FreeSettings,
    samples: usize,
    most: usize,
) -> Result<Vec<Vec<f64>>, StageError> {
    let rule = settings.rule(record.sample_rate_hz, samples);
    let free = read_free(record, &read_blocks(record, settings.block_samples)?, rule)?;
    let starts: Vec<usize> = free
        .stretches
        .iter()
        .flat_map(|stretch| (0..stretch.len() / samples.max(1)).map(|i| stretch.start + i * samples))
        .collect();
    let deflection = deflection(record)?;
    let count = most.min(starts.len());
    let mut windows = Vec::new();
    for i in 0..count {
        let window = deflection.read(starts[i * starts.len() / count], samples)?;
        if window.iter().all(|value| value.is_finite()) {
            windows.push(window);
        }
    }
    Ok(windows)
}
