//! Parameter-free estimates: windows, periodograms, ETFE, smoothing.
//!
//! Sign and scale: `X_k = N^(-1/2) sum_n x_n exp(-i 2 pi k n / N)` at the bins `k f_s / N` from zero to half the sample rate.
//! Undefined values are NaN.

use afmid_pipeline::Entry;

mod error;
mod etfe;
mod example;
mod fourier;
mod fraction;
mod least_squares;
mod local_polynomial;
mod local_rational;
mod neighbours;
mod periodogram;
mod power;
mod ratio;
mod smoothing;
mod taper;
mod window;

pub use error::SpectrumError;
pub use etfe::{Etfe, IntersampleKind};
pub use fourier::{bin_frequencies, transform};
pub use local_polynomial::{PolynomialSettings, local_polynomial};
pub use local_rational::{RationalSettings, local_rational};
pub use neighbours::{Bins, Smoothed, SuppressedLine};
pub use periodogram::Periodogram;
pub use power::{PowerSpectrum, power_spectrum};
pub use ratio::{EndTreatment, EtfeSettings, Intersample, TransferEstimate, difference, etfe};
pub use smoothing::{LineParams, Smoothing, SmoothingMethod, TransientChoice};
pub use taper::{Taper, TaperGains, taper, taper_gains};
pub use window::{Window, WindowKind};

/// The stages of this domain.
pub const STAGES: &[Entry] =
    &[Entry::of::<Window>(), Entry::of::<Periodogram>(), Entry::of::<Etfe>(), Entry::of::<Smoothing>()];

#[cfg(test)]
mod chain_tests;

#[cfg(test)]
#[test]
fn examples_hold() {
    crate::ensemble::example::run_examples(STAGES);
}
