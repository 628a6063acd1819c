//! Block-oriented models: linear parts and one static curve, from one measured input and output.
//!
//! # Model
//! `y = G2(q) f(G1(q) u) + e`, e the output error: Wiener (`G2 = 1`), Hammerstein (`G1 = 1`) or both parts. G1 and G2
//! are stable and proper in `q^-1` ([`Rational`]); f is a natural cubic spline on equally spaced knots, straight beyond
//! its ends ([`Curve`]). The gains of G1 and G2 are in f: a numerator coefficient is held in either.
//! # Method
//! The best linear approximation has the poles and zeros of both parts: for a Gaussian input it is `c G1 G2`
//! (Bussgang). It is fitted by [`crate::pem`], and all divisions of its poles and zeros between the two parts are
//! listed, with and without pairs that all but cancel, conjugate pairs together, one real pole at a time in both
//! (`splits`). Each is scored by linear least squares for the curve on the stretch where the linear model leaves most
//! (`screening`). The best are refined there by damped least squares with sensitivities that are filtered signals
//! (`refine`), fewer and further in every round; then all divisions of the best one's own poles and zeros are tried in
//! the same way (`search`). A few are refined on all of the record. At the end the curve gets as many knots as
//! Schwarz's criterion favours, and weak poles that it does not favour go; it also chooses among structures that
//! leave alike (`fit`).
//! # Shapes
//! u and y: N samples each; [`BlockModel::vector`]: twice the poles and the knots.
//! # Units
//! Those of u and y; time in samples.
//! # Cost
//! A step on a record: `O(N p^2)` for p parameters. 100,000 samples, order 6: some 15 s of one core.
//! # Accuracy
//! Known chains of order 3 and 6, 12,000 samples, noise of 0.1 to 1 %: in nine of ten cases (tests) fresh data are
//! simulated to 0.5 to 1.5 times `noise sqrt(p / N)` and the poles are within four standard errors. In the tenth, two
//! linear parts with the least noise, the error is three times as much and poles are farther off. The curve's own error
//! is the spline's: the fourth power of the distance of the knots where f is smooth, the first at a kink.
//! # Source
//! J. Sjoberg and J. Schoukens, Automatica 48 (2012) 353; M. Schoukens and K. Tiels, Automatica 85 (2017) 272; J. J.
//! Bussgang, MIT Technical Report 216 (1952); C. de Boor, A Practical Guide to Splines (1978).
//!
//! ```
//! use afmid_kernels::Unwatched;
//! use afmid_kernels::block_oriented::{BlockOptions, Structure, fit_block_oriented};
//! // numbers between -1 and 1 without a pattern
//! let mut state = 1_u32;
//! let mut random = || {
//!     state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
//!     f64::from(state >> 8) / f64::from(1_u32 << 23) - 1.0
//! };
//! // a low pass, then an amplifier that saturates; noise of 1e-3
//! let u: Vec<f64> = (0..4000).map(|_| 3.0 * random()).collect();
//! let mut x = 0.0;
//! let amplified = |u: &f64| {
//!     x = 0.8 * x + 0.2 * u;
//!     (1.5 * x).tanh()
//! };
//! let y: Vec<f64> = u.iter().map(amplified).map(|y| y + 1e-3 * 3f64.sqrt() * random()).collect();
//! let structures = vec![Structure::Wiener, Structure::Hammerstein];
//! let options = BlockOptions { order: 1, structures, ..BlockOptions::default() };
//! let fit = fit_block_oriented(&u, &y, &options, &Unwatched)?;
//! assert_eq!(fit.structure, Structure::Wiener);
//! let pole = fit.poles()[0];
//! println!("{:.4} +- {:.4}", pole.z.re, pole.std);
//! assert!((pole.z.re - 0.8).abs() < 4.0 * pole.std && pole.std < 1e-3);
//! // what is left is the noise
//! assert!(fit.training_rms < 1.05e-3 && fit.linear_rms > 0.02);
//! let bend = fit.curve_strength();
//! assert!(bend.relative > 20.0 * bend.std);
//! # Ok::<(), afmid_kernels::block_oriented::BlockError>(())
//! ```

#[cfg(test)]
mod benchmark_tests;
mod conclusion;
mod curve;
mod fit;
mod model;
mod options;
mod rational;
mod refine;
mod result;
mod screening;
mod search;
mod splits;
mod start;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod unit_tests;

pub use curve::Curve;
pub use fit::{fit_block_oriented, fit_from_chain};
pub use model::{BlockModel, Structure};
pub use options::{BlockError, BlockOptions};
pub use rational::Rational;
pub use result::{BlockFit, BlockPole, CurveStrength, Tried};
