//! The ranges of parameters, stated once, on their fields: by `#[schemars(range(min = ..., max = ...))]`, or
//! `exclusiveMinimum` and `exclusiveMaximum` by `#[schemars(extend(...))]`.

use serde_json::{Map, Value};

use super::{DynStage, Entry, Stage};
use crate::error::StageError;

/// The JSON Schema of a stage's parameters, asked for the ranges that it states.
#[derive(Debug, Clone)]
pub struct Bounds {
    schema: Value,
    definitions: Map<String, Value>,
}

/// A parameter outside its range.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutOfRange {
    /// Where it lies within `params`: names and indices.
    pub path: Vec<String>,
    /// What was found and what was wanted: `is 0, wanted 1 to 40`.
    pub message: String,
    /// What the parameter is, with the reason of its default.
    pub doc: String,
}

impl Bounds {
    /// Of a stage's parameters.
    pub fn of(entry: &Entry) -> Self {
        let mut generator = schemars::generate::SchemaSettings::draft07().into_generator();
        let schema = entry.schema(&mut generator).to_value();
        Self { schema, definitions: generator.take_definitions(true) }
    }

    /// The parameters of a table that are out of their ranges; where a range is stated, so are infinite and undefined
    /// numbers.
    pub fn check(&self, params: &toml::Table) -> Vec<OutOfRange> {
        let mut found = Vec::new();
        self.table(&self.schema, params, &mut Vec::new(), &mut found);
        found
    }

    /// The range of the parameter at `path`, in words; empty if none is stated.
    pub(crate) fn range(&self, path: &[String]) -> String {
        let mut schema = resolve(&self.schema, &self.definitions).0;
        for step in path {
            let inner = if step.bytes().all(|byte| byte.is_ascii_digit()) {
                &schema["items"]
            } else {
                &schema["properties"][step.as_str()]
            };
            schema = resolve(inner, &self.definitions).0;
        }
        range(schema)
    }

    fn table(&self, schema: &Value, params: &toml::Table, path: &mut Vec<String>, found: &mut Vec<OutOfRange>) {
        for (name, value) in params {
            path.push(name.clone());
            let property = &schema["properties"][name.as_str()];
            let before = found.len();
            self.value(property, value, path, found);
            let fresh = found[before..].iter_mut().filter(|wrong| wrong.doc.is_empty());
            fresh.for_each(|wrong| wrong.doc = help(property));
            path.pop();
        }
    }

    fn value(&self, schema: &Value, value: &toml::Value, path: &mut Vec<String>, found: &mut Vec<OutOfRange>) {
        let (schema, _) = resolve(schema, &self.definitions);
        match value {
            toml::Value::Table(params) => self.table(schema, params, path, found),
            toml::Value::Array(values) => {
                for (index, value) in values.iter().enumerate() {
                    path.push(index.to_string());
                    self.value(&schema["items"], value, path, found);
                    path.pop();
                }
            }
            toml::Value::Integer(number) => number_in(schema, *number as f64, number.to_string(), path, found),
            toml::Value::Float(number) => number_in(schema, *number, number.to_string(), path, found),
            _ => {}
        }
    }
}

/// What a parameter is, in one line, with its default.
fn help(property: &Value) -> String {
    let doc = property["description"].as_str().unwrap_or_default().replace('\n', " ");
    match &property["default"] {
        Value::Null => doc,
        default => format!("{doc} Default: {}.", shown(default)),
    }
}

/// A default as it would be written.
fn shown(default: &Value) -> String {
    match default {
        Value::Number(found) => found.as_f64().map_or_else(|| found.to_string(), number),
        other => other.to_string(),
    }
}

/// Of alternatives the one for numbers.
fn of_numbers(schema: &Value) -> &Value {
    let alternatives = schema["anyOf"].as_array().map(Vec::as_slice).unwrap_or_default();
    let numeric = |one: &&Value| one["type"] == "integer" || one["type"] == "number";
    alternatives.iter().find(numeric).unwrap_or(schema)
}

fn number_in(schema: &Value, number: f64, shown: String, path: &[String], found: &mut Vec<OutOfRange>) {
    let schema = of_numbers(schema);
    let bound = |key: &str| schema[key].as_f64();
    let limits = [bound("minimum"), bound("exclusiveMinimum"), bound("maximum"), bound("exclusiveMaximum")];
    let [least, above, most, below] = limits;
    let inside = number.is_finite()
        && least.is_none_or(|least| number >= least)
        && above.is_none_or(|above| number > above)
        && most.is_none_or(|most| number <= most)
        && below.is_none_or(|below| number < below);
    if !inside && limits.iter().any(Option::is_some) {
        let wanted = match range(schema) {
            range if range.is_empty() => "a count".to_owned(),
            range => range,
        };
        let message = format!("is {shown}, wanted {wanted}");
        found.push(OutOfRange { path: path.to_vec(), message, doc: String::new() });
    }
}

/// The schema behind references and options, and whether the value may be left out.
pub(crate) fn resolve<'a>(schema: &'a Value, definitions: &'a Map<String, Value>) -> (&'a Value, bool) {
    if let Some(reference) = schema["$ref"].as_str() {
        let name = reference.rsplit('/').next().unwrap_or_default();
        return definitions.get(name).map_or((schema, false), |inner| (inner, false));
    }
    if let Some([one]) = schema["allOf"].as_array().map(Vec::as_slice) {
        return resolve(one, definitions);
    }
    if let Some([one, other]) = schema["anyOf"].as_array().map(Vec::as_slice)
        && other["type"] == "null"
    {
        return (resolve(one, definitions).0, true);
    }
    let nullable = schema["type"].as_array().is_some_and(|kinds| kinds.iter().any(|kind| kind == "null"));
    (schema, nullable)
}

/// The range that a schema states, in words: `1 to 40`, `above 0, at most 1`; empty if it states none.
pub(crate) fn range(schema: &Value) -> String {
    let schema = of_numbers(schema);
    // zero as the bound of an unsigned type says nothing of the parameter
    let unsigned = schema["format"].as_str().is_some_and(|format| format.starts_with("uint"));
    let stated = |key: &str, bound: &f64| !(unsigned && key == "minimum" && *bound == 0.0);
    let bound = |key: &str| schema[key].as_f64().filter(|bound| stated(key, bound)).map(number);
    let zero = || (unsigned && schema["maximum"].is_number()).then(|| "0".to_owned());
    let (least, above) = (bound("minimum").or_else(zero), bound("exclusiveMinimum"));
    let (most, below) = (bound("maximum"), bound("exclusiveMaximum"));
    match (least, above, most, below) {
        (Some(least), None, Some(most), None) => format!("{least} to {most}"),
        (Some(least), None, None, None) => format!("{least} or more"),
        (least, above, most, below) => {
            let parts = [("at least", least), ("above", above), ("at most", most), ("below", below)];
            let parts = parts.into_iter().filter_map(|(how, bound)| Some(format!("{how} {}", bound?)));
            parts.collect::<Vec<_>>().join(", ")
        }
    }
}

/// Very small and very large bounds with a power of ten.
fn number(bound: f64) -> String {
    let size = bound.abs();
    if bound != 0.0 && !(1e-4..1e9).contains(&size) { format!("{bound:e}") } else { format!("{bound}") }
}

/// Checks a stage that no config declares: the ranges of its parameters, then [`Stage::check`]. Errors: the first that
/// is wrong.
pub fn check<S: Stage>(stage: &S) -> Result<(), StageError> {
    let params = toml::Table::try_from(stage)
        .map_err(|error| StageError::new(format!("parameters cannot be written as TOML: {error}")))?;
    match Bounds::of(&Entry::of::<S>()).check(&params).into_iter().next() {
        Some(wrong) => Err(StageError::new(format!("`{}` {}", wrong.path.join("."), wrong.message)).help(wrong.doc)),
        None => DynStage::faults(stage).into_iter().next().map_or(Ok(()), Err),
    }
}
