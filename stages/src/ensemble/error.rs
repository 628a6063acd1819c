//! What an ensemble can be refused for.

use afmid_pipeline::StageError;
use thiserror::Error;

/// Why an ensemble cannot be averaged or compared.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EnsembleError {
    /// The flat array is no whole number of rows.
    #[error("{values} values are no whole number of events of {samples} samples")]
    Ragged {
        /// Values in the array.
        values: usize,
        /// Samples per event.
        samples: usize,
    },
    /// Too few events for the quantity asked for.
    #[error("{got} events, but {purpose} needs at least {wanted}")]
    TooFewEvents {
        /// Events given.
        got: usize,
        /// Events needed.
        wanted: usize,
        /// What needs them.
        purpose: &'static str,
    },
    /// Too few samples for the regression.
    #[error("{got} samples per event, but {purpose} needs at least {wanted}")]
    TooFewSamples {
        /// Samples given.
        got: usize,
        /// Samples needed.
        wanted: usize,
        /// What needs them.
        purpose: &'static str,
    },
    /// A NaN or an infinity.
    #[error("event {event}, sample {sample} is not a finite number")]
    NotFinite {
        /// Row.
        event: usize,
        /// Column.
        sample: usize,
    },
    /// An index outside the ensemble.
    #[error("event {index} was chosen, but there are {count}")]
    NoSuchEvent {
        /// Index asked for.
        index: usize,
        /// Events there are.
        count: usize,
    },
    /// A lone number outside its range.
    #[error("{name} is {got}, wanted {wanted}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        got: String,
        /// Its range.
        wanted: &'static str,
    },
    /// All events are equal or constant: nothing to correlate.
    #[error("the mean of the events is constant: it carries no shape to compare with")]
    NoShape,
    /// The events lie in a file that cannot be read.
    #[error("{reason}")]
    Unreadable {
        /// Why, with the file.
        reason: String,
    },
}

impl From<StageError> for EnsembleError {
    fn from(error: StageError) -> Self {
        Self::Unreadable { reason: error.to_string() }
    }
}
