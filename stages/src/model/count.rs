//! A parameter that is a number, or `auto`.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number from 1 to `MOST`, or `"auto"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count<const MOST: u64> {
    /// So many.
    Fixed(usize),
    /// Found from the data.
    Auto,
}

impl<const MOST: u64> Count<MOST> {
    /// The given number; `most` where it is to be found.
    pub(super) fn largest(self, most: usize) -> usize {
        if let Self::Fixed(number) = self { number } else { most }
    }
}

impl<const MOST: u64> Serialize for Count<MOST> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(number) => serializer.serialize_u64(*number as u64),
            Self::Auto => serializer.serialize_str("auto"),
        }
    }
}

impl<'de, const MOST: u64> Deserialize<'de> for Count<MOST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "wanted a whole number, or \"auto\"")]
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
            Written::Number(number) => Self::Fixed(number),
            Written::Word(Word::Auto) => Self::Auto,
        })
    }
}

impl<const MOST: u64> JsonSchema for Count<MOST> {
    fn schema_name() -> Cow<'static, str> {
        format!("CountTo{MOST}").into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({
            "description": "A number, or `\"auto\"`.",
            "anyOf": [{ "type": "integer", "minimum": 1, "maximum": MOST }, { "const": "auto" }],
        })
    }
}
