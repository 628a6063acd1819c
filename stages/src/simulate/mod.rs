//! An AFM in the time domain: force, lever, detector, recorder, each in its own file.
//!
//! [`ModalLever`] and [`Contact`] make the two linear regimes of [`AfmSystem`]; [`simulate_motion`] propagates them exactly
//! along a [`TriangleRamp`] and switches at the events; [`Microscope::record`] adds [`ReadoutNoise`] and the [`Adc`].
//! [`PhaseProblem`] chooses start phases so that an archive holds a stated number of events.

mod adc;
mod afm;
mod afm_system;
mod archive;
mod chain;
mod contact;
mod detector;
mod discretisation;
mod error;
mod from_model;
mod hidden;
mod hidden_motion;
mod lever;
mod lever_model;
mod model;
pub(crate) mod model_example;
mod motion;
mod noise_free;
mod optics;
mod phases;
mod propagator;
mod ramp;
mod readout_noise;
mod recorder;
mod released;
mod square;
mod truth;

#[cfg(test)]
mod hidden_tests;
#[cfg(test)]
mod released_tests;
#[cfg(test)]
mod tests;

pub use adc::Adc;
pub use afm::Afm;
pub use afm_system::{AfmSystem, BOLTZMANN_J_PER_K};
pub use archive::{Archive, ArchiveLayout};
pub use contact::{ADHESION_CUT, Contact};
pub use detector::Detector;
pub use discretisation::{LinearSystem, Step};
pub use error::SimulateError;
pub use hidden::{Hidden, Setting, effects};
pub use hidden_motion::simulate_hidden;
pub use lever::{ModalLever, Mode};
pub(crate) use lever_model::MODEL;
pub use lever_model::{
    Estimated, LEVER_MODEL, LeverModel, LinearPart, ModelAmplitude, ModelCause, ModelMode, ModelNoise, ModelThermal,
    ModelWander,
};
pub use model::AfmOfModel;
pub(crate) use model_example as example;
pub use motion::{ContactEvent, Drive, EventKind, Motion, Sampling, simulate_motion};
pub use noise_free::Cut;
pub use phases::{PhaseProblem, RecordPlan, Target};
pub use ramp::TriangleRamp;
pub use readout_noise::{Drift, PINK_LOWEST_HZ, ReadoutNoise};
pub use recorder::{Microscope, PiezoMonitor, Place, RecordedEvent, Scatter, SimulatedRecord, archive_stream, counted};
pub use released::Release;
pub use square::Square;
pub use truth::{Counts, EventTruth, RecordTruth, Truth};

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Afm>(), Entry::of::<AfmOfModel>()];
