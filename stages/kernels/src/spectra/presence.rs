//! Whether a term is part of a model.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whether a term is in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Presence {
    /// Where the data ask for it.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

impl Presence {
    /// The given choice; none where the data decide.
    pub fn given(self) -> Option<bool> {
        match self {
            Self::Auto => None,
            Self::On => Some(true),
            Self::Off => Some(false),
        }
    }
}
