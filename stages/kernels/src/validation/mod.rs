//! How good a model is: fit of held-out records, whiteness of residuals, feedback, bootstrap intervals, comparison of two
//! models.
//!
//! ```
//! use afmid_kernels::pem::{Experiment, PemOptions, identify};
//! use afmid_kernels::validation::{Nuisances, simulate_held_out, whiteness};
//! // a resonance at 50 kHz with Q = 40, sampled at 1 MS/s; the input ends, the output rings, with noise
//! let (w, a) = (std::f64::consts::TAU * 50e3 * 1e-6, std::f64::consts::PI * 50e3 / 40.0 * 1e-6);
//! let (a1, a2) = (-2.0 * (-a).exp() * w.cos(), (-2.0 * a).exp());
//! let u: Vec<f64> = (0..4096).map(|k| if k < 200 { 1.0 } else { 0.0 }).collect();
//! let mut y = vec![0.0; u.len()];
//! for k in 2..u.len() {
//!     y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + 0.1 * u[k - 1];
//! }
//! y.iter_mut().enumerate().for_each(|(k, y)| *y += 1e-4 * ((k * k) as f64).sin());
//! // fitted to the record, judged on one whose input ends later
//! let options = PemOptions { order: 2, ..PemOptions::default() };
//! let fit = identify(&[Experiment { input: &u, output: &y }], 1e-6, &options)?;
//! let u: Vec<f64> = (0..4096).map(|k| if k < 900 { 1.0 } else { 0.0 }).collect();
//! let mut y = vec![0.0; u.len()];
//! for k in 2..u.len() {
//!     y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + 0.1 * u[k - 1];
//! }
//! let nuisances = Nuisances { offset: true, slope: false };
//! let held_out = simulate_held_out(&fit.model, &[], &u, &y, nuisances)?;
//! assert!(held_out.fit_percent > 99.9);
//! // a chi-square with its degrees of freedom and the probability of a larger one
//! let test = whiteness(&fit.residuals[0], 25, 2)?;
//! println!("{:.1} with {} degrees of freedom, p = {:.2}", test.statistic, test.freedom, test.p_value);
//! assert!(test.freedom == 23 && (0.0..=1.0).contains(&test.p_value));
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

mod bootstrap;
mod comparison;
mod feedback;
mod fit;
mod order_choice;
mod resampled;
mod residual;
mod shortlist;
mod single_sine;

pub use bootstrap::{BootstrapSettings, Bootstrapped, bootstrap};
pub use comparison::{Frequency, PoleShift, ZeroPair, compare_zeros, pole_shifts};
pub use feedback::{Driven, Feedback, feedback};
pub use fit::{Nuisances, Simulation, fit_percent, noise_ceiling_percent, simulate_held_out};
pub use order_choice::{OrderCandidate, OrderChoice, choose_order, largest_gap};
pub use resampled::{Drawing, Intervals, RootInterval};
pub use residual::{TestResult, input_dependence, whiteness};
pub use single_sine::{SingleSine, single_sine};
