//! What a fit sees of the data.

use super::gaps::Gaps;

/// Events of one length with their gaps, and stretches of noise alone.
pub(super) struct Records<'a> {
    /// Finite throughout; what stands in a gap is never used.
    pub events: &'a [&'a [f64]],
    pub gaps: &'a Gaps,
    pub free: &'a [&'a [f64]],
    pub interval_s: f64,
}

impl Records<'_> {
    /// Samples of an event, missing ones included.
    pub fn samples(&self) -> usize {
        self.events.first().map_or(0, |event| event.len())
    }

    /// Samples of all events that are there.
    pub fn observed(&self) -> usize {
        self.events.len() * self.samples() - self.gaps.total()
    }
}
