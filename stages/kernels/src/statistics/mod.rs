//! Tails of distributions, and centres and scales that outliers cannot move.

mod beta;
mod gamma;
mod half_sample_mode;
mod median;

pub use beta::{binomial_tail, f_tail, incomplete_beta, student_two_sided};
pub use gamma::{chi_square_tail, gamma_tail, ln_gamma, normal_two_sided};
pub use half_sample_mode::half_sample_mode;
pub use median::{median, median_and_scale};
