//! Streams records into the kernels of this domain: chunk by chunk, never a whole record at once.

use std::ops::Range;

use afmid_pipeline::{Record, StageError};

use crate::artifacts::{deflection, piezo};
use afmid_kernels::calibration::{Blocks, FreeRule, FreeStretches, free_stretches};
use afmid_kernels::signal::Welch;

/// Blocks read at once.
const BLOCKS_AT_ONCE: usize = 256;

/// Longest part of a free stretch that is held in memory, in segments.
const SEGMENTS_AT_ONCE: usize = 64;

/// The block statistics of a record, with its piezo channel where it has one.
pub(crate) fn read_blocks(record: &Record, block_samples: usize) -> Result<Blocks, StageError> {
    let (deflection, piezo) = (deflection(record)?, piezo(record));
    if let Some(piezo) = piezo.filter(|piezo| piezo.samples != deflection.samples) {
        return Err(StageError::new(format!(
            "`piezo` has {} samples, `deflection` {}: wanted as many",
            piezo.samples, deflection.samples
        ))
        .at(&record.path));
    }
    let mut blocks = Blocks::new(block_samples);
    let step = BLOCKS_AT_ONCE * blocks.length;
    for start in (0..deflection.samples).step_by(step) {
        let count = step.min(deflection.samples - start);
        let heights = piezo.map_or(Ok(Vec::new()), |piezo| piezo.read(start, count))?;
        blocks.push(&deflection.read(start, count)?, &heights);
    }
    Ok(blocks)
}

/// The free stretches of a record.
pub(crate) fn read_free(record: &Record, blocks: &Blocks, rule: FreeRule) -> Result<FreeStretches, StageError> {
    free_stretches(blocks, rule).map_err(|error| StageError::from_error(error).at(&record.path))
}

/// Feeds the free stretches of a record to a collector of segments.
pub(crate) fn push_free(record: &Record, stretches: &[Range<usize>], welch: &mut Welch) -> Result<(), StageError> {
    let deflection = deflection(record)?;
    let segment = welch.segment_samples();
    for stretch in stretches {
        // parts overlap by half a segment, so that the segments are those of the whole stretch
        let step = SEGMENTS_AT_ONCE * segment / 2;
        for start in stretch.clone().step_by(step.max(1)) {
            let end = (start + step + segment / 2).min(stretch.end);
            if end - start >= segment {
                welch.push(&deflection.read(start, end - start)?);
            }
        }
    }
    Ok(())
}

/// The rate of all records. Errors: none, or two rates.
pub(crate) fn common_rate(records: &[Record]) -> Result<f64, StageError> {
    let Some(first) = records.first() else { return Err(StageError::new("there is no record")) };
    match records.iter().find(|record| record.sample_rate_hz != first.sample_rate_hz) {
        Some(other) => Err(StageError::new(format!(
            "{} has {} samples per second, {} has {}: wanted one rate",
            first.name, first.sample_rate_hz, other.name, other.sample_rate_hz
        ))),
        None => Ok(first.sample_rate_hz),
    }
}
