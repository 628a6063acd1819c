//! Why a diagnosis cannot be made.

/// What was found, what is wanted, what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DiagnosisError {
    /// No record, no channel, or no stretch.
    #[error("there is nothing to diagnose: no record with an output")]
    Nothing,
    /// Input and outputs of a record differ in length.
    #[error("record {record}: input and outputs differ in length: {found} samples beside {wanted}")]
    Lengths {
        /// Number of the record, from 1.
        record: usize,
        /// Samples of one of them.
        found: usize,
        /// Samples of the first output.
        wanted: usize,
    },
    /// Records differ in their channels.
    #[error("record {record} has {found} outputs, the first {wanted}")]
    Channels {
        /// Number of the record, from 1.
        record: usize,
        /// Its outputs.
        found: usize,
        /// Outputs of the first.
        wanted: usize,
    },
    /// A stretch beyond the record, or too short.
    #[error(
        "part `{name}` is samples {first} to {end} of {samples}; wanted at least {least} samples within the record"
    )]
    Part {
        /// Its name.
        name: String,
        /// First sample.
        first: usize,
        /// One past the last.
        end: usize,
        /// Samples of the record.
        samples: usize,
        /// Fewest samples.
        least: usize,
    },
    /// A part that goes on from the training part but does not begin in it or behind it.
    #[error(
        "part `{name}` begins at sample {first}, before the training part at {training}; wanted a later one, or `state_samples` above 0"
    )]
    Before {
        /// Its name.
        name: String,
        /// First sample.
        first: usize,
        /// First sample of the training part.
        training: usize,
    },
    /// A value that is not finite.
    #[error(
        "record {record}: the input misses sample {sample}: the response to an unknown input is unknown; choose parts \
         without gaps"
    )]
    Missing {
        /// Number of the record, from 1.
        record: usize,
        /// Number of the sample, from 0.
        sample: usize,
    },
    /// An output that does not move.
    #[error("output {channel} does not move: there is nothing to identify")]
    Silent {
        /// Number of the channel, from 1.
        channel: usize,
    },
    /// An input that does not move.
    #[error(
        "the input is constant over what is learnt from: it causes nothing but an offset; choose a \
         stretch in which it moves, or diagnose a free decay without an input"
    )]
    Still,
    /// No linear model follows the output.
    #[error(
        "no linear model follows the output: every start of the fit diverged; check that input and output belong together"
    )]
    NoBaseline,
    /// An unknown cause.
    #[error("there is no cause `{0}` for these data")]
    Cause(String),
    /// An interval that is none.
    #[error("the sample interval is {0} s, wanted above 0")]
    Interval(f64),
}
