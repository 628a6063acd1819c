//! What a spectral estimate can be refused for.

use thiserror::Error;

/// Why no spectrum can be estimated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SpectrumError {
    /// Too short.
    #[error("{got} samples, wanted at least {wanted}")]
    TooShort {
        /// Samples given.
        got: usize,
        /// Samples needed.
        wanted: usize,
    },
    /// Arrays of different length.
    #[error("{name} has {got} values, wanted {wanted}")]
    Lengths {
        /// Which array.
        name: &'static str,
        /// Its length.
        got: usize,
        /// The other's.
        wanted: usize,
    },
    /// A NaN or an infinity.
    #[error("{name}, sample {at}, is not a finite number")]
    NotFinite {
        /// Which array.
        name: &'static str,
        /// Where.
        at: usize,
    },
    /// A lone number outside its range.
    #[error("{name} is {got}, wanted {wanted}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        got: f64,
        /// Its range.
        wanted: &'static str,
    },
    /// An input that is zero throughout.
    #[error("the input is zero throughout: no transfer function can be derived from it")]
    NoInput,
    /// Nothing stands out where a resonance is sought.
    #[error(
        "no resonance stands out between {lowest_hz} and {highest_hz} Hz: widen the range, or average longer segments"
    )]
    NoPeak {
        /// Lower end of the search.
        lowest_hz: f64,
        /// Upper end of the search.
        highest_hz: f64,
    },
    /// A fit that did not settle.
    #[error("the fit of the resonance near {near_hz:.2} Hz did not settle: {reason}")]
    NoFit {
        /// Where it started.
        near_hz: f64,
        /// Why.
        reason: &'static str,
    },
    /// Too few defined bins for a local model.
    #[error("{got} bins are defined, a local model needs {wanted}")]
    TooFewBins {
        /// Defined bins.
        got: usize,
        /// Bins needed.
        wanted: usize,
    },
}

/// Refuses anything but finite numbers.
pub(super) fn finite(name: &'static str, values: &[f64]) -> Result<(), SpectrumError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(at) => Err(SpectrumError::NotFinite { name, at }),
        None => Ok(()),
    }
}

/// Refuses anything but positive finite numbers.
pub(super) fn positive(name: &'static str, got: f64) -> Result<(), SpectrumError> {
    if got.is_finite() && got > 0.0 { Ok(()) } else { Err(SpectrumError::Setting { name, got, wanted: "above zero" }) }
}
