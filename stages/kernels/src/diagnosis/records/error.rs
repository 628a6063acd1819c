//! Why a record cannot be summarised.

/// What was found, what is wanted, what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// Piezo and deflection differ in length.
    #[error("the piezo channel has {piezo} samples, the deflection {deflection}; wanted as many, or no piezo channel")]
    Lengths {
        /// Samples of the piezo channel.
        piezo: usize,
        /// Samples of the deflection.
        deflection: usize,
    },
    /// The interval is no time.
    #[error("the interval between samples is {0} s; wanted a positive time")]
    Interval(f64),
    /// An event beyond the record.
    #[error("an event lies at sample {sample}, the record has {samples}; wanted events of this record")]
    Event {
        /// Its sample.
        sample: usize,
        /// Samples of the record.
        samples: usize,
    },
    /// Too short for any channel.
    #[error("the record has {0} samples; wanted at least {least}", least = super::summary::FEWEST_SAMPLES)]
    Short(usize),
}
