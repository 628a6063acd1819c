//! What the simulation gets wrong: the verdict of a diagnosis.

pub mod records;
pub mod release;
mod verdict;

pub use verdict::{DiagnosedMode, Diagnosis, Gain, NamedCause, Rung, RunnerUp, Validation, Value, Verdict};
