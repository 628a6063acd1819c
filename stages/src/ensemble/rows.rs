//! A borrowed, checked view of an ensemble.

use afmid_pipeline::StageError;
use afmid_pipeline::rows::{RowSource, RowView, in_blocks};

use super::EnsembleError;
use crate::artifacts::Ensemble;

/// Aligned events in memory, row-major `[event, time]`; every value is finite.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    values: &'a [f64],
    samples: usize,
}

impl<'a> Rows<'a> {
    /// Views `values` as rows of `samples` each.
    ///
    /// # Errors
    /// A ragged or empty array, or a value that is not finite.
    pub fn new(values: &'a [f64], samples: usize) -> Result<Self, EnsembleError> {
        if samples == 0 || values.is_empty() || !values.len().is_multiple_of(samples) {
            return Err(EnsembleError::Ragged { values: values.len(), samples });
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(EnsembleError::NotFinite { event: at / samples, sample: at % samples });
        }
        Ok(Self { values, samples })
    }

    /// The events of an ensemble. Errors: as [`Rows::new`]; there are none.
    pub(crate) fn of(ensemble: &Ensemble<'a>) -> Result<Self, StageError> {
        Self::new(ensemble.signal()?, ensemble.samples()?).map_err(StageError::from_error)
    }

    /// Number of events.
    pub fn count(&self) -> usize {
        self.values.len() / self.samples
    }

    /// Samples per event.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// One event.
    pub fn row(&self, event: usize) -> &'a [f64] {
        &self.values[event * self.samples..(event + 1) * self.samples]
    }

    /// All event indices in order.
    pub fn all(&self) -> Vec<usize> {
        (0..self.count()).collect()
    }
}

impl RowSource for Rows<'_> {
    fn rows(&self) -> usize {
        self.count()
    }

    fn row_length(&self) -> usize {
        self.samples
    }

    fn borrowed(&self, row: usize) -> Option<&[f64]> {
        (row < self.count()).then(|| self.row(row))
    }

    fn read(&self, row: usize, into: &mut [f64]) -> Result<(), StageError> {
        RowView::Memory(self.values, self.samples).read(row, into)
    }
}

/// Refuses rows without values and values that are not finite, wherever they lie.
///
/// # Errors
/// As [`Rows::new`]; a file that cannot be read.
pub(super) fn check_rows(rows: &dyn RowSource) -> Result<(), EnsembleError> {
    let samples = rows.row_length();
    if samples == 0 || rows.rows() == 0 {
        return Err(EnsembleError::Ragged { values: 0, samples });
    }
    in_blocks(rows, &all(rows), |first, block| {
        for (event, row) in (first..).zip(block) {
            if let Some(sample) = row.iter().position(|value| !value.is_finite()) {
                return Err(EnsembleError::NotFinite { event, sample });
            }
        }
        Ok(())
    })
}

/// All event indices in order.
pub(super) fn all(rows: &dyn RowSource) -> Vec<usize> {
    (0..rows.rows()).collect()
}

/// Refuses indices that point outside.
pub(super) fn check_chosen(rows: &dyn RowSource, chosen: &[usize]) -> Result<(), EnsembleError> {
    match chosen.iter().find(|&&index| index >= rows.rows()) {
        Some(&index) => Err(EnsembleError::NoSuchEvent { index, count: rows.rows() }),
        None => Ok(()),
    }
}
