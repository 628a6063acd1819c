//! What a run leaves behind: what the store writes and reads.

use serde_json::Value;

use super::Ports;
use crate::error::with_id;

/// What a stage made: the unit of the cache.
#[derive(Debug, Clone, Default)]
pub struct StageResult {
    /// Artifacts by output port.
    pub outputs: Ports,
    /// Warnings, in the order in which they arose.
    pub warnings: Vec<String>,
}

impl StageResult {
    /// The warnings with the id of the stage that they are of.
    pub(crate) fn warnings_of(&self, id: &str) -> Vec<String> {
        self.warnings.iter().map(|warning| with_id(warning, id)).collect()
    }
}

/// A file that a stage read, without its folder: provenance that does not depend on where the data lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceFile {
    /// Path as found.
    pub path: String,
    /// Bytes.
    pub size: u64,
    /// BLAKE3 hash in hexadecimal.
    pub blake3: String,
}

/// A stage of a finished run, with everything needed to trace its numbers back.
#[derive(Debug, Clone)]
pub struct StageRecord {
    /// Its id in the config.
    pub id: String,
    /// Its name in the registry.
    pub uses: String,
    /// The stage's version.
    pub version: u32,
    /// All parameters, defaults filled in.
    pub params: Value,
    /// Wires as (input port, stage id, output port).
    pub wires: Vec<(String, String, String)>,
    /// Seed, if the stage draws random numbers.
    pub seed: Option<u64>,
    /// Content address of its result, in hexadecimal.
    pub key: String,
    /// Files that it read.
    pub sources: Vec<SourceFile>,
    /// What it made.
    pub result: StageResult,
}

/// When and where a run took place: left out of comparisons.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunInfo {
    /// ISO 8601, UTC.
    pub started_at: String,
    /// Seconds from start to the last stage's end.
    pub seconds: f64,
    /// Host name.
    pub host: String,
    /// Threads.
    pub threads: usize,
    /// The working directory: paths as found begin there. Empty if unknown.
    pub folder: String,
    /// The config file, as it was named. Empty if unknown.
    pub config_file: String,
    /// Per stage id: seconds, and whether the result came from the cache.
    pub stages: Vec<(String, f64, bool)>,
    /// Per stage id that ran a process which wrote to stderr: the end of that.
    pub logs: Vec<(String, String)>,
    /// The stages without a result, in the plan's order; empty where the run went through.
    pub unfinished: Vec<Unfinished>,
}

/// A stage of a run that has no result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unfinished {
    /// Its id in the config.
    pub id: String,
    /// Its name in the registry.
    pub uses: String,
    /// Why it failed; none if it was not run, since something that it needs has no result.
    pub reason: Option<String>,
}

/// A finished run: what a result file holds.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// `[pipeline] name`.
    pub name: String,
    /// `[pipeline] seed`.
    pub seed: u64,
    /// The config, byte for byte as it was read.
    pub config: String,
    /// `--set` arguments, in order.
    pub overrides: Vec<String>,
    /// The program's version.
    pub program: String,
    /// The stages in topological order.
    pub stages: Vec<StageRecord>,
    /// When and where.
    pub info: RunInfo,
}

impl RunResult {
    /// The stage with this id.
    pub fn stage(&self, id: &str) -> Option<&StageRecord> {
        self.stages.iter().find(|stage| stage.id == id)
    }
}
