//! Damped least squares: one search for every fit of the crate.
//!
//! # Model
//! A cost that is a sum of squares near its minimum: `cost(p + d) = cost(p) - 2 g'd + d'F d`, with half the falling
//! gradient `g` and the information `F` (for a likelihood Fisher's).
//! # Method
//! Levenberg and Marquardt: steps `(F + damping diag F)^-1 g`; [`descend`] chooses the damping, takes a step if the
//! cost falls, and says why it ended. What a step does to a point, which parameters are eliminated or held, and what
//! counts as arrived is the [`Objective`]'s.
//! # Source
//! D. W. Marquardt, J. SIAM 11 (1963) 431; H. B. Nielsen, IMM-REP-1999-05, Technical University of Denmark (rule for
//! the damping); J. J. Moré, Lecture Notes in Mathematics 630 (1978) 105 (scaling).
//!
//! ```
//! use std::convert::Infallible;
//! use afmid_kernels::optimise::{Damping, Ending, Limits, Objective, Trial, damped_step, descend};
//! use afmid_kernels::Mat;
//!
//! /// `y = exp(-rate t)`, one unknown.
//! struct Decay { time: Vec<f64>, value: Vec<f64> }
//!
//! impl Objective for Decay {
//!     type Point = f64;
//!     type Local = (Mat<f64>, Vec<f64>);
//!     type Step = ();
//!     type Error = Infallible;
//!
//!     fn cost(&self, rate: &f64) -> f64 {
//!         self.time.iter().zip(&self.value).map(|(t, y)| (y - (-rate * t).exp()).powi(2)).sum()
//!     }
//!
//!     fn local(&mut self, rate: &mut f64) -> Result<Option<Self::Local>, Infallible> {
//!         let slope: Vec<f64> = self.time.iter().map(|t| -t * (-*rate * t).exp()).collect();
//!         let residual = self.time.iter().zip(&self.value).map(|(t, y)| y - (-*rate * t).exp());
//!         let gradient: f64 = slope.iter().zip(residual).map(|(s, r)| s * r).sum();
//!         let information: f64 = slope.iter().map(|s| s * s).sum();
//!         let arrived = gradient.abs() < 1e-14;
//!         Ok((!arrived).then(|| (Mat::from_fn(1, 1, |_, _| information), vec![gradient])))
//!     }
//!
//!     fn trial(&mut self, rate: &f64, local: &Self::Local, damping: f64) -> Result<Trial<f64, ()>, Infallible> {
//!         let (step, _) = damped_step(&local.0, &local.1, damping);
//!         Ok(Some((rate + step[0], ())))
//!     }
//! }
//!
//! let time: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
//! let value = time.iter().map(|t| (-0.7 * t).exp()).collect();
//! let mut damping = 1e-6;
//! let limits = Limits { steps: 30, ..Limits::NONE };
//! let found = descend(&mut Decay { time, value }, 2.0, &mut damping, Damping::STANDARD, limits).unwrap();
//! assert_eq!(found.ending, Ending::Minimum);
//! assert!((found.point - 0.7).abs() < 1e-12);
//! ```

mod damping;
mod descent;
mod step;
#[cfg(test)]
mod tests;

pub use damping::Damping;
pub use descent::{Descent, Ending, Limits, Objective, Taken, Trial, descend};
pub use step::{damped_step, damped_svd_step, shortened};
