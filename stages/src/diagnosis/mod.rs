//! What the simulation gets wrong: the verdict of a diagnosis, and the diagnosis of a measured input and output.

mod example;
mod measured_events;
pub mod records;
pub mod release;
mod release_example;
mod release_model;
mod release_stage;
mod release_story;
pub mod replay;
mod replay_example;
mod replay_stage;
#[cfg(test)]
mod replay_tests;
pub mod system;
mod system_stage;
mod system_story;
mod verdict;

pub use release_stage::ReleaseDiagnose;
pub use replay_stage::ReleaseReplay;
pub use system_stage::{JudgedPart, SystemDiagnose};
pub use verdict::{DiagnosedMode, Diagnosis, Gain, NamedCause, Rung, RunnerUp, Validation, Value, Verdict};

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] =
    &[Entry::of::<ReleaseDiagnose>(), Entry::of::<ReleaseReplay>(), Entry::of::<SystemDiagnose>()];

#[cfg(test)]
#[test]
fn examples_hold() {
    crate::ensemble::example::run_examples(STAGES);
}
