//! What the simulation gets wrong: releases, measured inputs and outputs, free decays.

mod causes_stage;
mod causes_story;
mod chosen;
mod closed_loop;
mod example;
mod measured_events;
mod release_example;
mod release_model;
mod release_stage;
mod release_story;
pub mod replay;
mod replay_example;
mod replay_stage;
#[cfg(test)]
mod replay_tests;
mod runs;
mod several_inputs;
mod steady;

pub use afmid_kernels::diagnosis::verdict::{
    DiagnosedMode, Diagnosis, Gain, NamedCause, Rung, RunnerUp, Validation, Value, Verdict,
};
pub use afmid_kernels::diagnosis::{Drive, Simulation, SimulationError};
pub use causes_stage::{CausesDiagnose, JudgedPart};
pub use release_stage::ReleaseDiagnose;
pub use replay_stage::ReleaseReplay;

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] =
    &[Entry::of::<CausesDiagnose>(), Entry::of::<ReleaseDiagnose>(), Entry::of::<ReleaseReplay>()];
