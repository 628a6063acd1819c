//! Why a signal cannot be tapered or averaged.

use thiserror::Error;

/// Why a signal cannot be tapered or averaged.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SignalError {
    /// Tapered share of a window.
    #[error("alpha is {0}, wanted 0 to 1")]
    Alpha(f64),
    /// Length of a segment.
    #[error("segment: got {0}, wanted an even number of at least 16 samples")]
    Segment(usize),
    /// No segment was added.
    #[error("found 0 segments, wanted at least 1; free stretches are shorter than segment_samples: lower it")]
    NoSegment,
}
