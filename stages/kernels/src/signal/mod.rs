//! Sampled signals: tapers, Fourier transforms, periodograms.
//!
//! Nothing is planned behind the caller's back: a [`RealTransform`] is the plan for one length, made once and used for
//! many signals, on any number of threads.
//!
//! ```
//! use afmid_kernels::signal::{Detrend, Welch};
//!
//! // a line of amplitude 1 in bin 32 of 256: half its square lies within two bins
//! let rate_hz = 1e6;
//! let line: Vec<f64> = (0..4096).map(|k| (std::f64::consts::TAU * k as f64 / 8.0).sin()).collect();
//! let mut welch = Welch::new(256, rate_hz, Detrend::Mean)?;
//! welch.push(&line);
//! let spectrum = welch.average()?;
//! let power: f64 = spectrum.density[30..35].iter().sum::<f64>() * spectrum.bin_hz;
//! assert!((power - 0.5).abs() < 1e-12);
//! # Ok::<(), afmid_kernels::signal::SignalError>(())
//! ```

mod codes;
mod decimation;
mod error;
mod fourier;
mod periodogram;
mod taper;
mod welch;

pub use codes::code_step;
pub use decimation::{Decimated, decimate};
pub use error::SignalError;
pub use fourier::{RealTransform, TransformPlans};
pub use periodogram::{autocorrelation, mean_periodogram, summed_periodograms};
pub use taper::{Taper, TaperGains, bessel_i0, hann, taper, taper_gains};
pub use welch::{AveragedPeriodogram, Detrend, Welch};
