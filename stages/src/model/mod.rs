//! Parametric estimates: prediction error method, modes, zeros.

mod chi_square;
mod comparison;
mod error;
mod fit;
mod innovations;
pub mod modes;
mod orthogonal;
pub mod pem;
mod residual;
mod riccati;
mod subspace;
mod transmission;

pub use chi_square::chi_square_tail;
pub use comparison::{Frequency, PoleShift, ZeroPair, compare_zeros, pole_shifts};
pub use error::ModelError;
pub use fit::{
    Nuisances, Simulation, fit_percent, noise_ceiling_percent, scale_free_standard_error, simulate_held_out,
};
pub use innovations::{InnovationsModel, Section};
pub use residual::{TestResult, input_dependence, whiteness};
pub use subspace::Subspace;
pub use transmission::transmission_zeros;
