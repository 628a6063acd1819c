//! Events as the diagnosis takes them: raw samples round a release, never shifted by fractions.

use crate::effects::Instant;

/// One event with room to move its window.
#[derive(Debug, Clone, PartialEq)]
pub struct EventWindow {
    /// Samples, V.
    pub values: Vec<f64>,
    /// Where the release was seen, samples after the first value; may lie between two.
    pub onset: f64,
    /// Where and when the first value was taken.
    pub first: Instant,
}

/// How an event's window is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Samples before the release that are compared.
    pub before: usize,
    /// Samples in all.
    pub samples: usize,
    /// Interval of the samples, s.
    pub interval_s: f64,
}

impl EventWindow {
    /// First value of the window for a release at `onset`, so that sample `before` is the first one after it; none
    /// where values are missing.
    pub fn start(&self, onset: f64, cut: &Cut) -> Option<usize> {
        let first_after = onset.ceil();
        if !(first_after.is_finite() && first_after >= cut.before as f64) {
            return None;
        }
        let start = first_after as usize - cut.before;
        (start + cut.samples <= self.values.len()).then_some(start)
    }
}
