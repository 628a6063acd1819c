//! How good a model is: fit of held-out records, whiteness of residuals, bootstrap intervals, comparison of two models.
mod bootstrap;
mod comparison;
mod fit;
mod order_choice;
mod resampled;
mod residual;

pub use bootstrap::{BootstrapSettings, Bootstrapped, bootstrap};
pub use comparison::{Frequency, PoleShift, ZeroPair, compare_zeros, pole_shifts};
pub use fit::{Nuisances, Simulation, fit_percent, noise_ceiling_percent, simulate_held_out};
pub use order_choice::{OrderCandidate, OrderChoice, choose_order, largest_gap};
pub use resampled::{Drawing, Intervals, RootInterval};
pub use residual::{TestResult, input_dependence, whiteness};
