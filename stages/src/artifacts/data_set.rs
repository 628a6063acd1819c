//! Which events: all, or one half.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which events: all, or one half.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DataSet {
    /// All events.
    All,
    /// The identification half.
    Identification,
    /// The verification half.
    Verification,
}

impl DataSet {
    /// All events, then the halves.
    pub const EACH: [Self; 3] = [Self::All, Self::Identification, Self::Verification];

    /// As configs and attributes name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Identification => "identification",
            Self::Verification => "verification",
        }
    }

    /// The name of a quantity of these events: `force_verification`, say.
    pub fn of(self, quantity: &str) -> String {
        match self {
            Self::All => quantity.to_owned(),
            half => format!("{quantity}_{}", half.name()),
        }
    }
}
