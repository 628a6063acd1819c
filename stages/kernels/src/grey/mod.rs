//! Modes, real poles, delay and feedthrough from inputs and outputs: the grey modal form, fitted at the limit of white
//! noise.
//!
//! # Model
//! `G(s) = exp(-s d) (sum_n g_n w_n^2 / (s^2 + w_n / Q_n s + w_n^2) + d0) prod_k p_k / (s + p_k)`; `y = G u + offset +
//! slope t + e`, e white or with the spectrum of its residuals. u is held between samples, linear, or band-limited,
//! as stated or as the data choose ([`BetweenSamples`]); d is any part of a sample.
//! # Shapes
//! Experiments of u (several inputs one after the other) and y; a parameter for each `w_n, Q_n, g_n, p_k`, d and d0.
//! # Cost
//! O(N (modes + poles)) per iteration; some ten iterations.
//! # Source
//! L. Ljung, System Identification (1999), sections 4.3 (grey forms) and 7.4; G. H. Golub and V. Pereyra, SIAM J. Numer.
//! Anal. 10 (1973) 413.
//!
//! ```
//! use afmid_kernels::grey::{GreyOptions, GreyQuantity, fit_grey};
//! use afmid_kernels::pem::Experiment;
//! // a resonance of 50 kHz, Q = 40, static gain 2, sampled at 1 MS/s, driven by held steps
//! let (w, a) = (std::f64::consts::TAU * 50e3, std::f64::consts::PI * 50e3 / 40.0);
//! let wd = (w * w - a * a).sqrt();
//! let step = |k: i32| if k < 0 { 0.0 } else {
//!     let t = 1e-6 * f64::from(k);
//!     2.0 * (1.0 - (-a * t).exp() * ((wd * t).cos() + a / wd * (wd * t).sin()))
//! };
//! let u: Vec<f64> = (0..4096).map(|k| f64::from(u8::from(k >= 100)) - f64::from(u8::from(k >= 900))).collect();
//! let y: Vec<f64> = (0..4096).map(|k| step(k - 100) - step(k - 900) + 1e-4 * f64::from((k * k) % 1000).sin()).collect();
//! let options = GreyOptions { modes: 1, real_poles: 0, ..GreyOptions::default() };
//! let fit = fit_grey(&[Experiment { input: &u, output: &y }], 1e-6, &options)?;
//! let q = fit.modes()[0].quality_factor;
//! assert!((q.value - 40.0).abs() < 5.0 * q.std, "{q:?}");
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

mod band_limited;
mod closest;
mod columns;
mod discrete;
mod errors;
mod evaluation;
mod fit;
mod fractions;
mod hold;
mod intersample;
#[cfg(test)]
mod intersample_tests;
mod layout;
mod moments;
mod options;
mod point;
mod result;
mod rules;
mod search;
mod start;
#[cfg(test)]
mod tests;

pub use crate::effects::Intersample;
pub use discrete::DiscreteGrey;
pub use fit::fit_grey;
pub use intersample::{DISTINGUISHABLE, IntersampleChoice, IntersampleFit};
pub use options::{Before, BetweenSamples, GreyKnown, GreyOptions, GreyQuantity, GreyStart};
pub use result::{Grey, GreyExperiment, GreyHold, GreyMode, GreyModel, GreyParameter};
