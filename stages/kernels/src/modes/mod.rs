//! Modal extraction: poles and zeros in continuous terms, static shares, frequency response, each with its standard
//! error.
//!
//! ```
//! use afmid_kernels::modes::{ModeCriteria, poles, response};
//! use afmid_kernels::pem::{Experiment, PemOptions, identify};
//! // a resonance at 50 kHz with Q = 40, sampled at 1 MS/s; the input ends, the output rings, with noise
//! let (w, a) = (std::f64::consts::TAU * 50e3 * 1e-6, std::f64::consts::PI * 50e3 / 40.0 * 1e-6);
//! let (a1, a2) = (-2.0 * (-a).exp() * w.cos(), (-2.0 * a).exp());
//! let u: Vec<f64> = (0..4096).map(|k| if k < 200 { 1.0 } else { 0.0 }).collect();
//! let mut y = vec![0.0; u.len()];
//! for k in 2..u.len() {
//!     y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + 0.1 * u[k - 1];
//! }
//! y.iter_mut().enumerate().for_each(|(k, y)| *y += 1e-4 * ((k * k) as f64).sin());
//! let options = PemOptions { order: 2, ..PemOptions::default() };
//! let fit = identify(&[Experiment { input: &u, output: &y }], 1e-6, &options)?;
//! let mode = poles(&fit.model, &fit.covariance, &ModeCriteria::default())?[0].root;
//! assert!((mode.quality_factor - 40.0 * (1.0 + 1.0 / 6400.0_f64).sqrt()).abs() < 5.0 * mode.quality_factor_std);
//! // the transfer function on resonance, against that of the recursion
//! let point = response(&fit.model, &fit.covariance, &[50e3])?[0];
//! let z = afmid_kernels::c64::cis(w);
//! let truth = (z * 0.1 / ((z + a1) * z + a2)).norm();
//! assert!((point.value.norm() - truth).abs() < 5.0 * point.magnitude_std());
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

#[cfg(test)]
mod coverage_tests;
mod interval;
mod map;
mod poles;
mod response;
mod rest;
mod shift;
#[cfg(test)]
mod tests;

pub use interval::{Interval, LEVEL};
pub use map::Root;
pub use poles::{ModeCriteria, Pole, PoleClass, poles, zeros};
pub use response::{ResponsePoint, response};
pub use rest::{AtRest, at_rest};
pub use shift::share_error_from_onset;
