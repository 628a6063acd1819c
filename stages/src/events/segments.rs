//! The segments of all records: put away whole, with what the alignment looks at in memory.

use std::sync::{Mutex, PoisonError};

use afmid_pipeline::artifact::RowWriter;
use afmid_pipeline::{StageError, Values};

use super::extraction::{Extraction, Found, Refused};
use afmid_kernels::events::{AveragingSettings, REACH};

/// A found event: its segment lies elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Seen {
    /// Sample of the record at which the segment begins.
    pub(super) start: usize,
    /// Samples at the end of the converter's range.
    pub(super) saturated: usize,
    /// Number of its segment. Which event has which depends on the order in which threads come by: nothing else may
    /// depend on it.
    pub(super) segment: usize,
    /// What the alignment looks at.
    pub(super) stretch: Vec<f64>,
}

/// What a record holds, its segments put away.
#[derive(Debug, Default)]
pub(super) struct Searched {
    pub(super) seen: Vec<Seen>,
    pub(super) refused: Vec<Refused>,
}

/// The stretch of a segment that the alignment looks at, and where the onset lies in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    from: usize,
    to: usize,
    pub(super) onset: usize,
}

impl Stretch {
    /// Of segments with so many samples before and after the onset.
    ///
    /// An event is moved by twice the largest shift at most (its own, less the mean of all), and interpolated from some
    /// samples to either side: with these the alignment has the same bits as with whole segments.
    pub(super) fn new(averaging: &AveragingSettings, before: usize, after: usize) -> Self {
        let spare = 2 * averaging.max_shift_samples.max(1) + 2 * REACH + 4;
        let ahead = before.min(averaging.lead_samples() + spare);
        Self { from: before - ahead, to: before + after.min(averaging.correlation_samples + spare), onset: ahead }
    }

    /// Of this segment.
    pub(super) fn of(&self, segment: &[f64]) -> Vec<f64> {
        segment.get(self.from..self.to).unwrap_or(segment).to_vec()
    }
}

/// Takes segments from all threads.
pub(super) struct Segments {
    writer: Mutex<RowWriter>,
    stretch: Stretch,
}

impl Segments {
    pub(super) fn new(writer: RowWriter, stretch: Stretch) -> Self {
        Self { writer: Mutex::new(writer), stretch }
    }

    /// Puts the segments of a record away. Errors: they cannot be written.
    pub(super) fn put(&self, extraction: Extraction) -> Result<Searched, StageError> {
        let put = |found: Found| {
            let segment = self.writer.lock().unwrap_or_else(PoisonError::into_inner).push(&found.segment)?;
            let stretch = self.stretch.of(&found.segment);
            Ok(Seen { start: found.start, saturated: found.saturated, segment, stretch })
        };
        let seen = extraction.found.into_iter().map(put).collect::<Result<_, StageError>>()?;
        Ok(Searched { seen, refused: extraction.refused })
    }

    /// All segments, as rows.
    pub(super) fn finish(self) -> Values {
        self.writer.into_inner().unwrap_or_else(PoisonError::into_inner).finish()
    }
}
