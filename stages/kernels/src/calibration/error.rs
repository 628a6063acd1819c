//! Why a calibration cannot be made.

use thiserror::Error;

use crate::signal::SignalError;

/// Why a calibration cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CalibrationError {
    /// Inputs of different lengths, or too short.
    #[error("{what}: got {got}, wanted {wanted}")]
    Length {
        /// Which input.
        what: &'static str,
        /// Its length.
        got: usize,
        /// What is wanted.
        wanted: String,
    },
    /// The records hold too little of what is needed.
    #[error("found {found} {what}, wanted at least {wanted}; {hint}")]
    TooLittle {
        /// Of what.
        what: &'static str,
        /// How much there is.
        found: usize,
        /// How much is needed.
        wanted: usize,
        /// What to change.
        hint: &'static str,
    },
    /// A number that no calibration can use.
    #[error("{name} is {got}; {wanted}")]
    Value {
        /// Which number.
        name: &'static str,
        /// Its value.
        got: f64,
        /// Its range, and why.
        wanted: &'static str,
    },
    /// A spectrum that cannot be averaged.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// A fit that did not settle.
    #[error("the fit of the thermal peak near {near_hz:.0} Hz did not settle: {reason}")]
    Fit {
        /// Where it was sought.
        near_hz: f64,
        /// Why.
        reason: &'static str,
    },
}
