//! What stages make: artifacts by port, a stage's result, a run's record.

mod difference;
mod port;
mod run;

pub use difference::difference;
pub use port::{Port, PortSpec, Ports};
pub use run::{RunInfo, RunResult, SourceFile, StageRecord, StageResult, Unfinished};
