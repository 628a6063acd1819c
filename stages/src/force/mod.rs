//! The stages that find the force that acted: the input of the identification. Kernels: [`afmid_kernels::force`].

mod example;
mod extension;
mod extrapolation;
mod reconstruction;
mod reconstruction_example;

#[cfg(test)]
mod reconstruction_tests;
pub use extrapolation::Extrapolation;
pub use reconstruction::{NoiseSource, Reconstruction as ForceReconstruction};

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Extrapolation>(), Entry::of::<ForceReconstruction>()];
