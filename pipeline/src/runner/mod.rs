//! The runner: independent stages in parallel, results from the cache where they are still valid.

mod result;

pub use result::{RunInfo, RunResult, SourceFile, StageRecord, StageResult};
