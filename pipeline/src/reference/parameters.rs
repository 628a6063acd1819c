//! The parameters of a stage, read from its JSON Schema.

use serde_json::{Map, Value};

use super::params_schema;
use crate::stage::Entry;

/// A parameter, for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Its name; of a value inside a table, the path.
    pub name: String,
    /// Its type.
    pub kind: String,
    /// Its default in TOML; nothing if it must be given.
    pub default: Option<String>,
    /// The range of its values; empty if not stated.
    pub range: String,
    /// Its documentation.
    pub doc: String,
}

/// The parameters of a stage, in the order of its struct; tables are followed by what they hold.
pub fn parameters(entry: &Entry) -> Vec<Parameter> {
    let (schema, definitions) = params_schema(entry);
    let mut rows = Vec::new();
    Reader { definitions: &definitions }.object(&schema, "", &mut rows);
    rows
}

struct Reader<'a> {
    definitions: &'a Map<String, Value>,
}

impl<'a> Reader<'a> {
    fn object(&self, schema: &'a Value, prefix: &str, rows: &mut Vec<Parameter>) {
        let required = |name: &str| {
            schema["required"].as_array().is_some_and(|names| names.iter().any(|required| required == name))
        };
        for (name, property) in schema["properties"].as_object().into_iter().flatten() {
            let (inner, optional) = self.resolve(property);
            let default = match &property["default"] {
                _ if required(name) => None,
                Value::Null => Some("none".to_owned()),
                value => Some(toml(value)),
            };
            let kind = if optional { format!("{}, or none", self.kind(inner)) } else { self.kind(inner) };
            let name = format!("{prefix}{name}");
            rows.push(Parameter {
                name: name.clone(),
                kind,
                default,
                range: range(inner),
                doc: self.doc(property, inner),
            });
            // a table inside a table of the same kind would go on for ever
            if prefix.matches('.').count() < 3 {
                self.object(inner, &format!("{name}."), rows);
                if inner["items"].is_object() {
                    self.object(self.resolve(&inner["items"]).0, &format!("{name}[]."), rows);
                }
            }
        }
    }

    /// The schema behind references and options, and whether it may be left out.
    fn resolve(&self, schema: &'a Value) -> (&'a Value, bool) {
        if let Some(reference) = schema["$ref"].as_str() {
            let name = reference.rsplit('/').next().unwrap_or_default();
            return self.definitions.get(name).map_or((schema, false), |inner| (inner, false));
        }
        if let Some([one]) = schema["allOf"].as_array().map(Vec::as_slice) {
            return self.resolve(one);
        }
        if let Some([one, other]) = schema["anyOf"].as_array().map(Vec::as_slice)
            && other["type"] == "null"
        {
            return (self.resolve(one).0, true);
        }
        let nullable = schema["type"].as_array().is_some_and(|kinds| kinds.iter().any(|kind| kind == "null"));
        (schema, nullable)
    }

    fn kind(&self, schema: &'a Value) -> String {
        let (schema, _) = self.resolve(schema);
        let choices = choices(schema);
        if !choices.is_empty() {
            return choices.iter().map(|(value, _)| toml(value)).collect::<Vec<_>>().join(" or ");
        }
        let kind = match &schema["type"] {
            Value::Array(kinds) => kinds.iter().find(|kind| *kind != "null").and_then(Value::as_str),
            kind => kind.as_str(),
        };
        match kind {
            Some("number") => "number".to_owned(),
            Some("integer") => "whole number".to_owned(),
            Some("boolean") => "true or false".to_owned(),
            Some("string") => "text".to_owned(),
            Some("array") if schema["items"].is_object() => {
                format!("array of {}", plural(&self.kind(&schema["items"])))
            }
            Some("array") => "array".to_owned(),
            Some("object") => "table".to_owned(),
            _ => "value".to_owned(),
        }
    }

    /// The documentation, followed by that of the choices.
    fn doc(&self, property: &Value, inner: &Value) -> String {
        let own = property["description"].as_str().or(inner["description"].as_str()).unwrap_or_default();
        let choices = choices(inner);
        let described: Vec<String> =
            choices.iter().filter_map(|(value, doc)| Some(format!("{}: {}", toml(value), doc.as_ref()?))).collect();
        if described.is_empty() { own.to_owned() } else { format!("{own} {}", described.join(" ")) }
    }
}

/// The values of an enumeration, with their documentation.
fn choices(schema: &Value) -> Vec<(&Value, Option<&str>)> {
    if let Some(values) = schema["enum"].as_array() {
        return values.iter().map(|value| (value, None)).collect();
    }
    let variants = schema["oneOf"].as_array().into_iter().flatten();
    variants
        .flat_map(|variant| {
            let doc = variant["description"].as_str();
            let many = variant["enum"].as_array().into_iter().flatten();
            many.chain(variant.get("const")).map(move |value| (value, doc))
        })
        .collect()
}

fn plural(kind: &str) -> String {
    match kind {
        "number" | "whole number" | "table" | "value" => format!("{kind}s"),
        "text" => "texts".to_owned(),
        other => other.to_owned(),
    }
}

/// The range that a schema states.
fn range(schema: &Value) -> String {
    // zero as the bound of an unsigned type says nothing of the parameter
    let unsigned = schema["format"].as_str().is_some_and(|format| format.starts_with("uint"));
    let informative = |key: &str, bound: &f64| !(unsigned && key == "minimum" && *bound == 0.0);
    let bound =
        |key: &str| schema[key].as_f64().filter(|bound| informative(key, bound)).map(|bound| format!("{bound}"));
    let low = bound("minimum").map(|low| (low, "at least")).or(bound("exclusiveMinimum").map(|low| (low, "above")));
    let high = bound("maximum").map(|high| (high, "at most")).or(bound("exclusiveMaximum").map(|high| (high, "below")));
    match (low, high) {
        (Some((low, "at least")), Some((high, "at most"))) => format!("{low} to {high}"),
        (Some((low, how)), Some((high, limit))) => format!("{how} {low}, {limit} {high}"),
        (Some((low, how)), None) => format!("{how} {low}"),
        (None, Some((high, limit))) => format!("{limit} {high}"),
        (None, None) => String::new(),
    }
}

/// A JSON value as one would write it in TOML.
fn toml(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Array(values) => format!("[{}]", values.iter().map(toml).collect::<Vec<_>>().join(", ")),
        Value::Object(entries) if entries.is_empty() => "{}".to_owned(),
        Value::Object(entries) => {
            let entries = entries.iter().filter(|(_, value)| !value.is_null());
            let entries: Vec<String> = entries.map(|(key, value)| format!("{key} = {}", toml(value))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        scalar => scalar.to_string(),
    }
}
