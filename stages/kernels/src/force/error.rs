//! Why no force can be derived.

use thiserror::Error;

/// Why the force at an event cannot be extrapolated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ForceError {
    /// A stretch is too short for its line.
    #[error("{samples} samples {stretch} the event, but a line needs at least {wanted}: take a longer window")]
    TooShort {
        /// Samples there are.
        samples: usize,
        /// `before` or `after`.
        stretch: &'static str,
        /// Samples needed.
        wanted: usize,
    },
    /// Arrays of different length.
    #[error("the mean has {mean} samples, its standard error {standard_error}")]
    Lengths {
        /// Samples of the mean.
        mean: usize,
        /// Samples of its standard error.
        standard_error: usize,
    },
    /// A NaN or an infinity.
    #[error("sample {0} is not a finite number")]
    NotFinite(usize),
    /// The signal never leaves the line.
    #[error("the signal stays within {threshold:.3e} of the line before the event: nothing departs near sample {near}")]
    NoDeparture {
        /// Threshold in the signal's unit.
        threshold: f64,
        /// Where it was looked for.
        near: usize,
    },
    /// Matrices that do not fit together.
    #[error("{name} of the model has {found} values, wanted {wanted}, more than none")]
    Model {
        /// Which matrix.
        name: &'static str,
        /// Its values.
        found: usize,
        /// What the order asks for.
        wanted: usize,
    },
    /// What no reconstruction can use.
    #[error("{0}")]
    Reconstruction(&'static str),
    /// Load and noise are the same size.
    #[error("a load of {load:.3e} is within {sigmas:.1} standard errors of zero")]
    NoLoad {
        /// Load in the signal's unit.
        load: f64,
        /// Ratio to its standard error.
        sigmas: f64,
    },
}
