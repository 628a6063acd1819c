//! The runner: independent stages in parallel, results from the cache where they are still valid.

mod error;
mod execute;
mod keys;
mod result;
mod schedule;
#[cfg(test)]
mod tests;

pub use error::RunError;
pub use execute::{Observer, Options, Quiet, run};
pub use keys::{Decision, StagePlan, explain, stage_seed};
pub use result::{RunInfo, RunResult, SourceFile, StageRecord, StageResult};
