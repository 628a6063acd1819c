//! A JSON document: summaries and verdicts.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::StageError;

/// A JSON document. The port named `summary` of a stage is what `afmid show OUT ID --json` prints.
///
/// Unknown numbers are `null`, keys are never missing: [`Document::new`] turns NaN and infinities into null, as JSON
/// has none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Document(pub Value);

impl Document {
    /// Serialises any value. Errors: map keys that are not strings.
    pub fn new<T: Serialize>(value: &T) -> Result<Self, StageError> {
        serde_json::to_value(value)
            .map(Self)
            .map_err(|error| StageError::new(format!("a document cannot be written as JSON: {error}")))
    }

    /// Deserialises it. Errors: another layout than `T`'s, with the path of the first difference.
    pub fn read<'a, T: Deserialize<'a>>(&'a self) -> Result<T, StageError> {
        serde_path_to_error::deserialize(&self.0)
            .map_err(|error| StageError::new(format!("document: at {}: {}", error.path(), error.inner())))
    }
}
