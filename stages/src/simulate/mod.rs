//! The stages that simulate archives, of an AFM or of an identified model. Kernels: [`afmid_kernels::simulate`].

mod afm;
mod from_model;
mod hidden;
mod lever_model;
mod model;
pub(crate) mod model_example;

#[cfg(test)]
mod hidden_tests;
#[cfg(test)]
mod released_tests;
pub use afm::Afm;
pub use hidden::{Hidden, Setting, effects};
pub(crate) use lever_model::MODEL;
pub use lever_model::{
    Estimated, LEVER_MODEL, LeverModel, LinearPart, ModelAmplitude, ModelCause, ModelMode, ModelNoise, ModelThermal,
    ModelWander,
};
pub use model::AfmOfModel;
pub(crate) use model_example as example;

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Afm>(), Entry::of::<AfmOfModel>()];
