//! Parametric estimates: prediction error method, modes, zeros.

mod bootstrap;
mod bootstrap_stage;
mod comparison;
pub mod contact;
mod contact_stage;
mod era;
mod era_stage;
mod error;
mod example;
mod fit;
mod gram;
pub mod grey;
mod grey_stage;
mod hankel;
mod innovations;
mod instrumental;
pub mod modes;
mod modes_stage;
mod order;
pub(crate) mod orthogonal;
pub mod pem;
mod pem_stage;
mod realised;
mod residual;
mod riccati;
pub mod ringdown;
mod ringdown_stage;
mod series;
pub mod stabilisation;
mod stabilisation_stage;
#[cfg(test)]
mod start_tests;
mod subspace;
mod subspace_stage;
mod system_poles;
mod tall;
mod transmission;
pub mod vector_fitting;
mod vector_fitting_stage;
#[cfg(test)]
mod weight_tests;
mod zeros_stage;

pub use bootstrap::{BootstrapSettings, Bootstrapped, bootstrap};
pub use bootstrap_stage::BootstrapIntervals;
pub use comparison::{Frequency, PoleShift, ZeroPair, compare_zeros, pole_shifts};
pub use contact_stage::ContactFit;
pub use era::Era;
pub use era_stage::EraEstimate;
pub use error::ModelError;
pub use fit::{Nuisances, Simulation, fit_percent, noise_ceiling_percent, simulate_held_out};
pub use grey_stage::{GreyEstimate, GreyNumber, GreyNumberKind, HistoryKind, InputKind};
pub use innovations::{InnovationsModel, InputGains, Section};
pub use instrumental::{InstrumentalSubspace, Weight};
pub use modes_stage::Modes;
pub use order::{Order, OrderCandidate, OrderChoice, choose_order};
pub use pem_stage::{DataSet, FocusKind, NoiseKind, Pem};
pub use residual::{TestResult, input_dependence, whiteness};
pub use ringdown_stage::{ErrorSource, JointNoise, KnownNumber, KnownQuantity, ModeNumber, RingdownFit};
pub use stabilisation_stage::{PoleMethod, StabilisationDiagram};
pub use subspace::Subspace;
pub use subspace_stage::{SubspaceEstimate, WeightKind};
pub use system_poles::system_poles;
pub use transmission::transmission_zeros;
pub use vector_fitting_stage::{ResponseWeight, VectorFittingEstimate};
pub use zeros_stage::Zeros;

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[
    Entry::of::<Pem>(),
    Entry::of::<SubspaceEstimate>(),
    Entry::of::<EraEstimate>(),
    Entry::of::<VectorFittingEstimate>(),
    Entry::of::<StabilisationDiagram>(),
    Entry::of::<GreyEstimate>(),
    Entry::of::<Modes>(),
    Entry::of::<BootstrapIntervals>(),
    Entry::of::<Zeros>(),
    Entry::of::<RingdownFit>(),
    Entry::of::<ContactFit>(),
];

#[cfg(test)]
#[test]
fn examples_hold() {
    crate::ensemble::example::run_examples(STAGES);
}
