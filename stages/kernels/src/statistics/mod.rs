//! Tails of distributions, and centres and scales that outliers cannot move.
//!
//! ```
//! use afmid_kernels::statistics::{median_and_scale, student_two_sided};
//! // twenty readings of 5 with noise of 0.07, and one that is wrong
//! let mut readings: Vec<f64> = (0..20).map(|k| 5.0 + 0.1 * f64::from(k * k).sin()).chain([1e6]).collect();
//! let (centre, scale) = median_and_scale(&mut readings);
//! // the median's standard error is 1.25 times the mean's
//! let std = 1.253 * scale / 21.0_f64.sqrt();
//! assert!((centre - 5.0).abs() < 3.0 * std && std < 0.05);
//! // so much or more by chance: not rare
//! assert!(student_two_sided((centre - 5.0) / std, 20.0) > 0.01);
//! ```

mod beta;
mod gamma;
mod half_sample_mode;
mod median;
mod share;
mod slow;

pub use beta::{binomial_tail, f_tail, incomplete_beta, student_limit, student_two_sided};
pub use gamma::{chi_square_level, chi_square_tail, gamma_tail, ln_gamma, normal_two_sided};
pub use half_sample_mode::half_sample_mode;
pub use median::{median, median_and_scale};
pub use share::clopper_pearson;
pub use slow::{without_slow, without_steps};
