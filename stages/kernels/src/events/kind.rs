//! The two things that happen to a tip.

use serde::{Deserialize, Serialize};

/// What happened to the tip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// The contact ruptures: an upward jump from the loaded ramp to the free level.
    SnapOff,
    /// The tip jumps to the surface: a downward jump from the free level, then the contact ramp.
    #[serde(alias = "snap-to-contact")]
    SnapIn,
}

impl EventKind {
    /// As configs, attributes and tables name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SnapOff => "snap-off",
            Self::SnapIn => "snap-in",
        }
    }

    /// The kind of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "snap-off" => Some(Self::SnapOff),
            "snap-in" | "snap-to-contact" => Some(Self::SnapIn),
            _ => None,
        }
    }
}
