//! Why a model cannot be identified or evaluated.

use crate::linear_algebra::NoConvergence;

/// What was found and what was wanted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// No experiment was given.
    #[error("no experiment: wanted at least one pair of input and output")]
    NoExperiment,
    /// Two series that belong together differ in length.
    #[error("{what} has {found} samples, wanted {wanted} as in the output")]
    Length {
        /// The series.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The other's length.
        wanted: usize,
    },
    /// Too few samples for the order or the block rows.
    #[error("{found} samples, wanted at least {wanted} for this order and these block rows")]
    TooShort {
        /// Samples given.
        found: usize,
        /// Samples needed.
        wanted: usize,
    },
    /// Too few points of a frequency response are defined.
    #[error("{found} points of the response are defined, wanted at least {wanted} for this order")]
    TooFewPoints {
        /// Defined points.
        found: usize,
        /// Points needed.
        wanted: usize,
    },
    /// A NaN or an infinity in the data.
    #[error("sample {index} of the {what} is not finite")]
    NotFinite {
        /// The series.
        what: &'static str,
        /// First offending sample.
        index: usize,
    },
    /// Outputs are missing and the noise model needs every one.
    #[error("{count} output samples are missing, the first at {index}: a noise filter runs over every sample")]
    Missing {
        /// How many.
        count: usize,
        /// The first.
        index: usize,
    },
    /// A parameter outside its range.
    #[error("{name} is {found}, wanted {wanted}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// What it was.
        found: f64,
        /// Its range.
        wanted: &'static str,
    },
    /// One response of several cannot be used.
    #[error("response {number} {problem}: leave it out")]
    Response {
        /// Which, from 1.
        number: usize,
        /// Why.
        problem: &'static str,
    },
    /// The output does not vary: there is nothing to identify.
    #[error("the output is constant: there is nothing to identify")]
    ConstantOutput,
    /// A decomposition did not converge.
    #[error(transparent)]
    Decomposition(#[from] NoConvergence),
    /// The result is not a finite model.
    #[error("the fit has no finite result: {0}")]
    Degenerate(&'static str),
    /// The monitor said so.
    #[error("cancelled")]
    Cancelled,
}

/// Errors: who watches wants the work to end.
pub(crate) fn go_on(watch: &crate::Watch) -> Result<(), ModelError> {
    if watch.is_cancelled() { Err(ModelError::Cancelled) } else { Ok(()) }
}

/// Checks that a series is finite. Errors: [`ModelError::NotFinite`].
pub(crate) fn finite(what: &'static str, values: &[f64]) -> Result<(), ModelError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(ModelError::NotFinite { what, index }),
        None => Ok(()),
    }
}
