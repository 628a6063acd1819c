//! Parameter-free estimates: windows, periodograms, ETFE, smoothing.
//!
//! Sign and scale: `X_k = N^(-1/2) sum_n x_n exp(-i 2 pi k n / N)` at the bins `k f_s / N` from zero to half the sample rate.
//! Undefined values are NaN.

mod error;
mod fourier;
mod fraction;
mod least_squares;
mod local_polynomial;
mod local_rational;
mod neighbours;
mod power;
mod ratio;
mod taper;

pub use error::SpectrumError;
pub use fourier::{bin_frequencies, transform};
pub use local_polynomial::{PolynomialSettings, local_polynomial};
pub use local_rational::{RationalSettings, local_rational};
pub use neighbours::{Bins, Smoothed, SuppressedLine};
pub use power::{PowerSpectrum, power_spectrum};
pub use ratio::{EndTreatment, Etfe, EtfeSettings, Intersample, difference, etfe};
pub use taper::{Taper, TaperGains, taper, taper_gains};
