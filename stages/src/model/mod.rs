//! The stages of parametric estimates: prediction error method, subspace, ringdown, modes, zeros. A stage finds its
//! kernel by name in [`afmid_kernels`].

mod bootstrap;
mod contact;
mod count;
mod decay;
mod decay_example;
mod era;
mod example;
mod excitation;
mod frf_modes;
mod frf_modes_example;
mod grey;
mod harmonics;
mod harmonics_example;
mod known;
mod modes;
mod order;
mod pem;
mod realised;
mod ringdown;
#[cfg(test)]
mod scale_tests;
mod stabilisation;
mod subspace;
mod system_poles;
mod vector_fitting;
mod whiteness;
mod zeros;

pub use crate::artifacts::DataSet;
pub use bootstrap::BootstrapIntervals;
pub use contact::ContactFit;
pub use count::Count;
pub use decay::{DecayFit, DecayNoise};
pub use era::EraEstimate;
pub use frf_modes::FrfModeFit;
pub use grey::GreyEstimate;
pub use harmonics::Harmonics;
pub use known::{KnownNumber, KnownQuantity};
pub use modes::Modes;
pub use order::Order;
pub use pem::Pem;
pub use ringdown::{ErrorSource, JointNoise, ModeNumber, RingdownFit};
pub use stabilisation::{PoleMethod, StabilisationDiagram};
pub use subspace::SubspaceEstimate;
pub use system_poles::system_poles;
pub use vector_fitting::{ResponseWeight, VectorFittingEstimate};
pub use zeros::Zeros;

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
    Entry::of::<DecayFit>(),
    Entry::of::<FrfModeFit>(),
    Entry::of::<Harmonics>(),
    Entry::of::<ContactFit>(),
];
