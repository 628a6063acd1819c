//! Why a record cannot be searched.

use thiserror::Error;

/// Why a record cannot be searched for decays.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DecaySearchError {
    /// No channel at all.
    #[error("the record has no channel")]
    NoChannel,
    /// Channels of different length.
    #[error("channel {channel} has {found} samples, the first one {wanted}")]
    Length {
        /// Number of the channel, from 0.
        channel: usize,
        /// Its samples.
        found: usize,
        /// Those of the first.
        wanted: usize,
    },
    /// Too few samples.
    #[error("the record has {found} samples, wanted at least {wanted}")]
    TooShort {
        /// Samples there are.
        found: usize,
        /// Samples needed.
        wanted: usize,
    },
    /// A NaN or an infinity.
    #[error("sample {index} of channel {channel} is not a finite number")]
    NotFinite {
        /// Number of the channel, from 0.
        channel: usize,
        /// The sample.
        index: usize,
    },
    /// A number that cannot be.
    #[error("{name} is {found}, wanted {wanted}")]
    Parameter {
        /// Which.
        name: &'static str,
        /// What it is.
        found: f64,
        /// What it may be.
        wanted: &'static str,
    },
}
