//! Parameter-free estimates: windows, periodograms, ETFE, smoothing.
//!
//! Sign and scale: `X_k = N^(-1/2) sum_n x_n exp(-i 2 pi k n / N)` at the bins `k f_s / N` from zero to half the sample
//! rate. Undefined values are NaN.
//!
//! # Model
//! [`etfe`]: `G(k) = Y_k / U_k` (Eqs. 5 to 7) with the variance `phi_k / abs(U_k)^2` (Eq. 10); [`local_rational`] and
//! [`local_polynomial`] smooth its real and imaginary part. [`frequency_response`] averages those of measured
//! inputs. [`power_spectrum`] and [`average_spectra`] are for noise;
//! [`thermal_fit`] fits `A (2/pi) (f0^3/Q) / ((f0^2 - f^2)^2 + (f f0/Q)^2) + W + B/f` to a density, [`thermal_peak`] one
//! of several peaks.
//! # Shapes
//! N real samples give N/2 + 1 bins; a response, its variance and the bins have one length.
//! # Cost
//! A transform O(N log N), a local fit O(bins x neighbours).
//! # Source
//! R. W. Stark et al., Rev. Sci. Instrum. (2005), Eqs. 5 to 7 and 10; R. Pintelon and J. Schoukens, System
//! Identification (2012), chapters 2 and 7; P. Whittle, Ark. Mat. 2 (1953) 423.
//!
//! ```
//! use afmid_kernels::spectra::{EndTreatment, EtfeSettings, Intersample, difference, etfe};
//! // y(t) = 0.9 y(t-1) + 0.1 u(t-1): static gain 1; a load that ends
//! let u: Vec<f64> = (0..4096).map(|k| if k < 1000 { 1.0 } else { 0.0 }).collect();
//! let mut y = vec![1.0; u.len()];
//! for k in 1..u.len() {
//!     y[k] = 0.9 * y[k - 1] + 0.1 * u[k - 1];
//! }
//! let settings = EtfeSettings {
//!     sample_rate_hz: 1e6,
//!     bandwidth_hz: 5e5,
//!     vanishing_ratio: 1e-3,
//!     ends: EndTreatment::Differenced,
//!     intersample: Intersample::Sampled,
//!     normalise: false,
//! };
//! let found = etfe(&difference(&u), &difference(&y), &vec![1e-4; u.len()], settings)?;
//! for k in (8..2048).step_by(100) {
//!     let z = num_complex::Complex64::from_polar(1.0, std::f64::consts::TAU * found.frequency_hz[k] / 1e6);
//!     assert!((found.transfer[k] - 0.1 / (z - 0.9)).norm() < 3.0 * found.variance[k].sqrt());
//! }
//! # Ok::<(), afmid_kernels::spectra::SpectrumError>(())
//! ```

mod averaged;
mod averages;
mod ensemble_response;
mod error;
mod fourier;
mod fraction;
mod intersample;
mod lane_squares;
mod lanes;
mod least_squares;
mod local_polynomial;
mod local_rational;
mod measured_input;
mod neighbour_scatter;
mod neighbours;
mod power;
mod presence;
mod ratio;
mod resonance;
mod seen_oscillator;
mod thermal_fit;
mod thermal_peak;

pub use crate::signal::{Taper, TaperGains, taper, taper_gains};
pub use averaged::{AveragedSpectrum, RecordSpectrum, average_spectra};
pub use averages::averages_by_scatter;
pub use ensemble_response::{EnsembleResponse, EnsembleResponseSettings, ensemble_response};
pub use error::SpectrumError;
pub use fourier::{bin_frequencies, transform};
pub use intersample::{Intersample, response_frequencies};
pub use local_polynomial::{PolynomialSettings, local_polynomial};
pub use local_rational::{RationalSettings, local_rational};
pub use measured_input::{
    Block, BlockKind, Estimator, MeasuredResponse, ResponseSettings, chance_coherence, common_hit_samples,
    energy_beside_hits, excited_share, frequency_response, half_energy_samples, hit_begins, hit_spacing, hits,
    is_impulsive, period_samples, periods, rings_on, segments, with_hits,
};
pub use neighbour_scatter::neighbour_scatter;
pub use neighbours::{Bins, Smoothed, SuppressedLine};
pub use power::{PowerSpectrum, power_spectrum};
pub use presence::Presence;
pub use ratio::{EndTreatment, EtfeSettings, TransferEstimate, difference, etfe};
pub use resonance::{FALSE_ALARM as RESONANCE_FALSE_ALARM, resonance_chance, resonance_segment, segment_samples};
pub use seen_oscillator::SeenThrough;
pub use thermal_fit::{AveragedDensity, Fitted, FoundLine, ThermalFit, ThermalFitSettings, thermal_fit};
pub use thermal_peak::{PeakSearch, thermal_peak};
