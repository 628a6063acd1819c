//! Subspace identification: poles without a start, from singular value decompositions.
//!
//! | of | kernel | instruments |
//! |---|---|---|
//! | input and output, white output noise | [`Subspace::new`] (MOESP) | none |
//! | input and output, any noise | [`Subspace::with_instruments`] (N4SID, MOESP, CVA) | the past |
//! | a free decay | [`Subspace::of_decay`] | none |
//!
//! # Model
//! `x(t+1) = A x(t) + B u(t)`, `y(t) = C x(t) + D u(t) + v(t)`: rows of past and future outputs, the inputs projected
//! out, span the range of the extended observability matrix `(C; C A; C A^2; ...)`; A follows from its shift
//! invariance. v is white, or any noise where the past gives instruments. Poles have no errors of their own:
//! [`crate::pem::refit`] makes the model of these poles and gives them.
//! # Shapes
//! u, y: N samples, several inputs one after the other; s block rows give s singular values, the poles of an order n
//! below s are n.
//! # Cost
//! For N samples and s block rows: O(N s) to form the products, O(s^3) to decompose them; O(N s^2) where the products
//! keep too few digits and QR takes over.
//! # Source
//! P. Van Overschee and B. De Moor, Subspace Identification for Linear Systems (1996), chapter 4; M. Verhaegen and P.
//! Dewilde, Int. J. Control 56 (1992) 1187.
//!
//! ```
//! use afmid_kernels::pem::{Experiment, PemOptions, refit};
//! use afmid_kernels::subspace::Subspace;
//! // a resonance at 50 kHz with Q = 40, sampled at 1 MS/s; the input ends, the output rings, with noise
//! let (w, a) = (std::f64::consts::TAU * 50e3 * 1e-6, std::f64::consts::PI * 50e3 / 40.0 * 1e-6);
//! let (a1, a2) = (-2.0 * (-a).exp() * w.cos(), (-2.0 * a).exp());
//! let u: Vec<f64> = (0..4096).map(|k| if k < 200 { 1.0 } else { 0.0 }).collect();
//! let mut y = vec![0.0; u.len()];
//! for k in 2..u.len() {
//!     y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + 0.1 * u[k - 1];
//! }
//! y.iter_mut().enumerate().for_each(|(k, y)| *y += 1e-4 * ((k * k) as f64).sin());
//! let driven = Subspace::new(&u, &y, 60)?.poles(2)?[0];
//! let decay = Subspace::of_decay(&y[200..], 60)?.poles(2)?[0];
//! // start values: a tenth of a per cent
//! assert!((driven.ln().norm() / w - 1.0).abs() < 1e-3 && (decay.ln().norm() / w - 1.0).abs() < 1e-3);
//! // the model that starts from them has errors
//! let poles = Subspace::new(&u, &y, 60)?.poles(2)?;
//! let fit = refit(&[Experiment { input: &u, output: &y }], 1e-6, &poles, &PemOptions::default())?;
//! let mode = fit.modes()?[0].root;
//! assert!((mode.frequency_hz - 50e3 * (1.0 + 1.0 / 6400.0_f64).sqrt()).abs() < 5.0 * mode.frequency_std_hz);
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```
mod era;
mod instrumental;
mod past_future;
#[cfg(test)]
mod start_tests;
mod weight;
#[cfg(test)]
mod weight_tests;

pub(crate) use instrumental::Instruments;
pub use past_future::Subspace;
pub use weight::Weight;
