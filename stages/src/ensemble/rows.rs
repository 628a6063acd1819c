//! A borrowed, checked view of an ensemble.

use super::EnsembleError;

/// Aligned events, row-major `[event, time]`; every value is finite.
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

    /// Refuses indices that point outside.
    pub(super) fn check(&self, chosen: &[usize]) -> Result<(), EnsembleError> {
        match chosen.iter().find(|&&i| i >= self.count()) {
            Some(&index) => Err(EnsembleError::NoSuchEvent { index, count: self.count() }),
            None => Ok(()),
        }
    }
}
