//! Parameter-free estimates: windows, periodograms, ETFE, smoothing.
//!
//! Sign and scale: `X_k = N^(-1/2) sum_n x_n exp(-i 2 pi k n / N)` at the bins `k f_s / N` from zero to half the sample rate.
//! Undefined values are NaN.

use afmid_pipeline::Entry;

mod averaged;
mod ensemble_response;
mod error;
mod etfe;
mod example;
mod fourier;
mod fraction;
mod frf;
mod frf_example;
mod lane_squares;
mod lanes;
mod least_squares;
mod local_polynomial;
mod local_rational;
mod neighbours;
mod periodogram;
mod power;
mod ratio;
mod seen_oscillator;
mod smoothing;
mod taper;
mod thermal;
mod thermal_example;
mod thermal_fit;
mod welch;
mod window;

pub use averaged::{AveragedSpectrum, RecordSpectrum, average_spectra};
pub use ensemble_response::{EnsembleResponse, EnsembleResponseSettings, ensemble_response};
pub use error::SpectrumError;
pub use etfe::{Etfe, IntersampleKind};
pub use fourier::{bin_frequencies, transform};
pub use frf::Frf;
pub use local_polynomial::{PolynomialSettings, local_polynomial};
pub use local_rational::{RationalSettings, local_rational};
pub use neighbours::{Bins, Smoothed, SuppressedLine};
pub use periodogram::Periodogram;
pub use power::{PowerSpectrum, power_spectrum};
pub use ratio::{EndTreatment, EtfeSettings, Intersample, TransferEstimate, difference, etfe};
pub use seen_oscillator::SeenThrough;
pub use smoothing::{LineParams, Smoothing, SmoothingMethod, TransientChoice};
pub use taper::{Taper, TaperGains, taper, taper_gains};
pub use thermal::{Presence, SpectrumWindow, Thermal};
pub use thermal_fit::{AveragedDensity, Fitted, FoundLine, ThermalFit, ThermalFitSettings, thermal_fit};
pub use welch::Welch;
pub use window::{Window, WindowKind};

/// The stages of this domain.
pub const STAGES: &[Entry] = &[
    Entry::of::<Window>(),
    Entry::of::<Periodogram>(),
    Entry::of::<Etfe>(),
    Entry::of::<Frf>(),
    Entry::of::<Smoothing>(),
    Entry::of::<Thermal>(),
    Entry::of::<Welch>(),
];

#[cfg(test)]
mod chain_tests;

#[cfg(test)]
#[test]
fn examples_hold() {
    crate::ensemble::example::run_examples(STAGES);
}
