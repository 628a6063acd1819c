//! The parameter `modes`: a number, or `auto`.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// How many modes are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModeNumber {
    /// So many.
    Fixed(usize),
    /// Found from the data.
    Auto,
}

impl ModeNumber {
    /// The given number; `most` where it is to be found.
    pub(super) fn largest(self, most: usize) -> usize {
        if let Self::Fixed(modes) = self { modes } else { most }
    }
}

impl Serialize for ModeNumber {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(modes) => serializer.serialize_u64(*modes as u64),
            Self::Auto => serializer.serialize_str("auto"),
        }
    }
}

impl<'de> Deserialize<'de> for ModeNumber {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "wanted a number of modes, or \"auto\"")]
        enum Written {
            Number(usize),
            Word(Word),
        }
        #[derive(Deserialize)]
        #[serde(rename_all = "kebab-case")]
        enum Word {
            Auto,
        }
        Ok(match Written::deserialize(deserializer)? {
            Written::Number(modes) => Self::Fixed(modes),
            Written::Word(Word::Auto) => Self::Auto,
        })
    }
}

impl JsonSchema for ModeNumber {
    fn schema_name() -> Cow<'static, str> {
        "ModeNumber".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({
            "description": "How many modes are fitted: a number, or `\"auto\"`.",
            "anyOf": [{ "type": "integer", "minimum": 1, "maximum": 20 }, { "const": "auto" }],
        })
    }
}
