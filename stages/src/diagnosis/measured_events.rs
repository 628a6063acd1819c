//! Events cut out of measured records, for stages that simulate them.

use std::ops::Range;

use afmid_pipeline::{Recording, StageError};

use crate::artifacts::deflection;
use afmid_kernels::diagnosis::release::{Cut, EventWindow};
use afmid_kernels::effects::Instant;

/// Room on either side of a window, within which its onset may move.
const MARGIN: usize = 64;

/// Whether a window keeps its release in its first half.
pub(super) fn check_cut(window_samples: usize, before_samples: usize) -> Result<(), StageError> {
    if 2 * before_samples > window_samples {
        return Err(StageError::new(format!(
            "`before_samples` is {before_samples}, wanted at most half of `window_samples`, {window_samples}"
        )));
    }
    Ok(())
}

/// An event of record `number` with [`MARGIN`] on either side, and its samples in the record; none where it leaves the
/// record or has gaps.
pub(super) fn cut_out(
    recording: &Recording,
    number: usize,
    onset: f64,
    cut: &Cut,
) -> Result<Option<(EventWindow, Range<usize>)>, StageError> {
    let records = recording.records.len();
    let record = recording.records.get(number).ok_or_else(|| {
        StageError::new(format!("an event is of record {number}, and there are {records}"))
            .help("wire the records that the events were found in")
    })?;
    let channel = deflection(record)?;
    let first = onset.floor() - (MARGIN + cut.before) as f64;
    let length = cut.samples + 2 * MARGIN;
    // an onset that is no number leaves as well
    if !(first >= 0.0 && first as usize + length <= channel.samples) {
        return Ok(None);
    }
    let values = channel.read(first as usize, length)?;
    if values.iter().any(|v| !v.is_finite()) {
        return Ok(None);
    }
    let place = number as f64 / (records.max(2) - 1) as f64;
    let at = Instant { record: number, place, time_s: first * cut.interval_s, piezo_m: 0.0 };
    let range = first as usize..first as usize + length;
    Ok(Some((EventWindow { values, onset: onset - first, first: at }, range)))
}
