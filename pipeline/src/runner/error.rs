//! A run that failed: which stage, which port, why.

use crate::error::StageError;

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
