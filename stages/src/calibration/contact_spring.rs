//! A parameter that is a contact's stiffness, or `rigid`.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// How stiff a contact is: so many N/m, or `"rigid"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactSpring {
    /// Much stiffer than the lever.
    Rigid,
    /// So many N/m.
    NPerM(f64),
}

impl ContactSpring {
    /// Its stiffness in N/m; none of a rigid one.
    pub(super) fn n_per_m(self) -> Option<f64> {
        if let Self::NPerM(stiffness) = self { Some(stiffness) } else { None }
    }
}

impl Serialize for ContactSpring {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::NPerM(stiffness) => serializer.serialize_f64(*stiffness),
            Self::Rigid => serializer.serialize_str("rigid"),
        }
    }
}

impl<'de> Deserialize<'de> for ContactSpring {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "wanted a stiffness in N/m, or \"rigid\"")]
        enum Written {
            Number(f64),
            Word(Word),
        }
        #[derive(Deserialize)]
        #[serde(rename_all = "kebab-case")]
        enum Word {
            Rigid,
        }
        Ok(match Written::deserialize(deserializer)? {
            Written::Number(stiffness) => Self::NPerM(stiffness),
            Written::Word(Word::Rigid) => Self::Rigid,
        })
    }
}

impl JsonSchema for ContactSpring {
    fn schema_name() -> Cow<'static, str> {
        "ContactSpring".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({
            "description": "A stiffness in N/m, or `\"rigid\"`.",
            "anyOf": [{ "type": "number", "exclusiveMinimum": 0.0 }, { "const": "rigid" }],
        })
    }
}
