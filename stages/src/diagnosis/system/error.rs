//! Why a system cannot be diagnosed.

/// What was found, what is wanted, what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// Input and output differ in length.
    #[error("the input has {input} samples, the output {output}; wanted as many")]
    Lengths {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
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
    #[error("the input misses sample {0}: the response to an unknown input is unknown; choose parts without gaps")]
    Missing(usize),
    /// An output that does not move.
    #[error("the output of the training part does not move: there is nothing to identify")]
    Silent,
    /// No oscillator follows the output.
    #[error(
        "no oscillator follows the output: every start of the fit diverged; check that input and output belong together"
    )]
    NoBaseline,
    /// An unknown cause.
    #[error("there is no cause `{0}` for input and output")]
    Cause(String),
    /// An interval that is none.
    #[error("the sample interval is {0} s, wanted above 0")]
    Interval(f64),
}
