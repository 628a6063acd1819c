//! Parameters of a plugin: the part of JSON Schema (draft 2020-12) that configs need, checked with errors like a
//! built-in stage's.
//!
//! A keyword outside this part is refused when the plugin describes itself, so that nothing is believed to be checked
//! and is not.

mod definition;
mod number;
mod resolve;
#[cfg(test)]
mod tests;

use serde_json::{Map, Value};

use crate::config::list;
use crate::stage::ParamError;

/// The schema of a plugin's parameters: checked itself, its defaults right.
#[derive(Debug, Clone)]
pub(super) struct Schema(Value);

impl Schema {
    /// Errors: it is no object that refuses unknown keys, uses a keyword that is not checked here, or has a wrong
    /// default.
    pub(super) fn new(schema: &Value) -> Result<Self, String> {
        definition::check_root(schema)?;
        Ok(Self(schema.clone()))
    }

    /// The schema itself.
    pub(super) fn whole(&self) -> &Value {
        &self.0
    }

    /// Checks parameters and fills in the defaults. Errors: the first that is wrong, in serde's words, which configs
    /// translate.
    pub(super) fn resolve(&self, params: Value) -> Result<Value, ParamError> {
        resolve::resolve(&self.0, params, "")
    }

    /// The values of the parameters that name files.
    pub(super) fn paths(&self, params: &Value) -> Vec<String> {
        let of = |(name, schema): (&String, &Value)| {
            let named = schema.get("format").and_then(Value::as_str) == Some("path");
            params.get(name).filter(|_| named).and_then(Value::as_str).map(str::to_owned)
        };
        properties(&self.0).into_iter().flatten().filter_map(of).collect()
    }

    /// The names of the parameters.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        properties(&self.0).into_iter().flatten().map(|(name, _)| name.as_str())
    }

    /// Its parameters in a line.
    pub(super) fn manual(&self) -> String {
        let names: Vec<&str> = self.names().collect();
        match names.as_slice() {
            [] => "the plugin has no parameters".to_owned(),
            names => format!("the plugin's parameters are {}", list(names.iter().copied())),
        }
    }
}

fn properties(schema: &Value) -> Option<&Map<String, Value>> {
    schema.get("properties")?.as_object()
}

/// A `params` table as JSON; dates become text.
pub(super) fn json(params: toml::Table) -> Value {
    fn plain(value: toml::Value) -> Value {
        match value {
            toml::Value::String(text) => text.into(),
            toml::Value::Integer(number) => number.into(),
            toml::Value::Float(number) => number.into(),
            toml::Value::Boolean(flag) => flag.into(),
            toml::Value::Datetime(time) => time.to_string().into(),
            toml::Value::Array(values) => values.into_iter().map(plain).collect(),
            toml::Value::Table(table) => json(table),
        }
    }
    Value::Object(params.into_iter().map(|(name, entry)| (name, plain(entry))).collect())
}
