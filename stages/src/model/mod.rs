//! Parametric estimates: prediction error method, modes, zeros.

mod comparison;
mod error;
mod example;
mod fit;
mod innovations;
pub mod modes;
mod modes_stage;
mod orthogonal;
pub mod pem;
mod pem_stage;
mod residual;
mod riccati;
pub mod ringdown;
mod ringdown_stage;
mod subspace;
mod transmission;
mod zeros_stage;

pub use comparison::{Frequency, PoleShift, ZeroPair, compare_zeros, pole_shifts};
pub use error::ModelError;
pub use fit::{Nuisances, Simulation, fit_percent, noise_ceiling_percent, simulate_held_out};
pub use innovations::{InnovationsModel, Section};
pub use modes_stage::Modes;
pub use pem_stage::{DataSet, NoiseKind, Pem};
pub use residual::{TestResult, input_dependence, whiteness};
pub use ringdown_stage::{ErrorSource, JointNoise, RingdownFit};
pub use subspace::Subspace;
pub use transmission::transmission_zeros;
pub use zeros_stage::Zeros;

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] =
    &[Entry::of::<Pem>(), Entry::of::<Modes>(), Entry::of::<Zeros>(), Entry::of::<RingdownFit>()];

#[cfg(test)]
#[test]
fn examples_hold() {
    crate::ensemble::example::run_examples(STAGES);
}
