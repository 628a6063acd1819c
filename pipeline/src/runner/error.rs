//! A run that failed: which stage, which port, why.

use std::path::PathBuf;

use crate::error::StageError;
use crate::error::StoreError;

/// Why a run left no result file.
#[derive(Debug)]
pub enum Failed {
    /// Stages failed, in the plan's order.
    Stages {
        /// Which, and why.
        errors: Vec<RunError>,
        /// The file that the results of the others were written to, or why it could not be; none if there are none.
        kept: Option<Result<PathBuf, StoreError>>,
    },
    /// All stages went through, and the file cannot be written.
    File(StoreError),
}

/// A stage that failed. The runner adds what a stage does not know of itself.
#[derive(Debug, thiserror::Error)]
#[error("stage `{id}` ({uses}){}: {error}", error.port.map(|port| format!(", port `{port}`")).unwrap_or_default())]
pub struct RunError {
    /// The stage's id in the config.
    pub id: String,
    /// Its name in the registry.
    pub uses: String,
    /// Why.
    pub error: Box<StageError>,
}
