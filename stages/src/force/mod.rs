//! The force that acted: the input of the identification.
//!
//! Nobody measures the force in the contact. At a rupture it is known all the same: before it the lever bends quasi-statically
//! under the load, after it there is none. Both lines are extrapolated to the moment `t0`, and their difference is the input,
//! in volts of static deflection, so that the quasi-static gain is one.

use afmid_pipeline::Entry;

mod error;
mod example;
mod extension;
mod extrapolate;
mod extrapolation;
mod line;
mod onset;
mod reconstruct;
mod reconstruction;
mod reconstruction_example;
#[cfg(test)]
mod reconstruction_tests;

pub use error::ForceError;
pub use extrapolate::{Event, ExtrapolationSettings, Lines, Pair, ZeroLine, extrapolate, pair};
pub use extrapolation::{Extrapolation, ZeroLineKind};
pub use line::{Line, Weighting, fit_line};
pub use onset::{Onset, OnsetSettings, find_onset};
pub use reconstruct::{
    ForcePrior, IdentifiedModel, Reconstruction, ReconstructionSettings, Rise, band_inflation, reconstruct, rise,
};
pub use reconstruction::{NoiseSource, PriorKind, Reconstruction as ForceReconstruction};

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Extrapolation>(), Entry::of::<ForceReconstruction>()];

#[cfg(test)]
#[test]
fn examples_hold() {
    crate::ensemble::example::run_examples(STAGES);
}
