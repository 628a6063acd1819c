//! Prediction error method: the innovations form of the paper's Eq. 8, fitted by minimum one-step prediction error.
//!
//! # Model
//! Eq. 8: `x(t+1) = A x(t) + B u(t) + K e(t)`, `y(t) = C x(t) + D u(t) + e(t)`, e white. A is built of sections of
//! order two ([`InnovationsModel`](crate::model::InnovationsModel)): `a_i` and `c_i` are the characteristic polynomials
//! of the sections of A and of A - K C, and `model::kalman_gains` makes K of them. Per experiment: x0, an offset and a
//! slope of y.
//! # Method
//! Minimises `V = sum_t e(t)^2`, `e = H^-1 (y - G u)` with `H^-1 = prod a_i / c_i` (`predictor`; V is the cost of
//! `projection`). Starts from subspace estimates ([`crate::subspace`]; `estimates`, `starts`), those in the basin of a
//! known minimum left out (`basin`), then Levenberg-Marquardt steps on the one-step prediction errors
//! (`levenberg_marquardt`, by [`crate::optimise::descend`]) with analytic derivatives (`jacobian`) and a secant
//! estimate of the curvature that they leave out (`secant`); x0, offset, slope, B and D are eliminated in every step
//! (variable projection, `projection`). By default poles and noise model move in turns (`alternating`). [`identify`]
//! minimises; [`refit`] starts from a model; [`with_poles`] keeps the poles.
//! # Shapes
//! u and y: N samples per experiment, several inputs one after the other; covariance: (2n + 1) x (2n + 1) and n + 1
//! more for each further input.
//! # Cost
//! Per iteration O(N n^2); the start O(N s + s^3) for s block rows.
//! # Source
//! Stark et al. 2005 (the paper, doi 10.1063/1.2137887), Eq. 8; L. Ljung, System Identification (1999), chapters 7 and
//! 10; G. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.
//!
//! ```
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
//! assert!(fit.verdict.converged);
//! let mode = fit.modes()?[0].root;
//! println!("{:.1} Hz +- {:.1} Hz", mode.frequency_hz, mode.frequency_std_hz);
//! assert!((mode.frequency_hz - 50e3 * (1.0 + 1.0 / 6400.0_f64).sqrt()).abs() < 5.0 * mode.frequency_std_hz);
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

mod alternating;
mod autoregression;
mod basin;
mod columns;
mod conclusion;
mod covariance;
mod data;
mod estimates;
mod identify;
mod jacobian;
mod levenberg_marquardt;
mod linearised;
mod noise;
mod options;
mod orders;
mod predictor;
mod products;
mod projection;
mod rotation;
mod secant;
mod starts;
mod state;
mod tangent;
#[cfg(test)]
mod tests;
mod whitening;

pub(crate) use autoregression::{largest_order, least_bic, levinson};

pub use crate::optimise::Ending;
pub use covariance::ResidualColour;
pub(crate) use covariance::covariance as time_domain_covariance;
pub(crate) use data::complete as longest_complete;
pub use identify::{identify, refit, with_poles};
pub use options::{Experiment, Focus, Identified, NoiseModel, PemOptions, Verdict};
pub(crate) use orders::Orders;
pub(crate) use predictor::all_pole;
