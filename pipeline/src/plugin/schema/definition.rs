//! Checks a schema itself, when a plugin describes itself.

use serde_json::Value;

use super::{properties, resolve};
use crate::config::{did_you_mean, list};

/// Keywords that are checked.
const CHECKED: [&str; 17] = [
    "type",
    "properties",
    "required",
    "additionalProperties",
    "enum",
    "const",
    "minimum",
    "maximum",
    "exclusiveMinimum",
    "exclusiveMaximum",
    "multipleOf",
    "minLength",
    "maxLength",
    "items",
    "minItems",
    "maxItems",
    "default",
];

/// Keywords that say something to people; `x-` begins others.
const SAID: [&str; 8] = ["$schema", "$id", "$comment", "title", "description", "examples", "deprecated", "format"];

const TYPES: [&str; 7] = ["object", "array", "string", "number", "integer", "boolean", "null"];

/// Checks the schema of all parameters.
pub(super) fn check_root(schema: &Value) -> Result<(), String> {
    if schema.get("type").and_then(Value::as_str) != Some("object") {
        return Err("wanted a schema of `\"type\": \"object\"`".to_owned());
    }
    if schema.get("additionalProperties") != Some(&Value::Bool(false)) {
        return Err("wanted `\"additionalProperties\": false`: a misspelt parameter would pass silently".to_owned());
    }
    check(schema, "")
}

fn check(schema: &Value, place: &str) -> Result<(), String> {
    let at = |name: &str| if place.is_empty() { name.to_owned() } else { format!("{place}.{name}") };
    let here = if place.is_empty() { String::new() } else { format!("`{place}`: ") };
    let Some(keywords) = schema.as_object() else {
        return Err(format!("{here}wanted a schema, a JSON object"));
    };
    let known = |name: &str| CHECKED.contains(&name) || SAID.contains(&name) || name.starts_with("x-");
    if let Some(other) = keywords.keys().find(|name| !known(name)) {
        let help = did_you_mean(other, "keyword", CHECKED.into_iter());
        return Err(format!("{here}the keyword `{other}` is not checked by afmid; {help}"));
    }
    types(schema, &here)?;
    limits(schema, &here)?;
    if let Some(found) = schema.get("properties") {
        let inner = found.as_object().ok_or_else(|| format!("{here}`properties` is no object"))?;
        inner.iter().try_for_each(|(name, schema)| check(schema, &at(name)))?;
    }
    if let Some(items) = schema.get("items") {
        check(items, &format!("{place}[]"))?;
    }
    if !matches!(schema.get("additionalProperties"), None | Some(Value::Bool(_))) {
        return Err(format!("{here}`additionalProperties` is neither true nor false"));
    }
    required(schema, &here)?;
    match schema.get("default") {
        Some(default) => resolve::resolve(schema, default.clone(), place)
            .map(drop)
            .map_err(|error| format!("{here}its default is wrong: {}", error.message)),
        None => Ok(()),
    }
}

fn types(schema: &Value, here: &str) -> Result<(), String> {
    let named = |name: &Value| name.as_str().is_some_and(|name| TYPES.contains(&name));
    let right = match schema.get("type") {
        None => return Ok(()),
        Some(Value::Array(names)) => !names.is_empty() && names.iter().all(named),
        Some(name) => named(name),
    };
    if right { Ok(()) } else { Err(format!("{here}`type` is none of {}", list(TYPES.into_iter()))) }
}

fn limits(schema: &Value, here: &str) -> Result<(), String> {
    for name in ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "multipleOf"] {
        if schema.get(name).is_some_and(|limit| !limit.is_number()) {
            return Err(format!("{here}`{name}` is no number"));
        }
    }
    for name in ["minLength", "maxLength", "minItems", "maxItems"] {
        if schema.get(name).is_some_and(|limit| !limit.is_u64()) {
            return Err(format!("{here}`{name}` is no whole number of 0 or more"));
        }
    }
    if schema.get("multipleOf").and_then(Value::as_f64).is_some_and(|step| step <= 0.0) {
        return Err(format!("{here}`multipleOf` is not above 0"));
    }
    match schema.get("enum") {
        Some(Value::Array(choices)) if !choices.is_empty() => Ok(()),
        None => Ok(()),
        Some(_) => Err(format!("{here}`enum` is no list of values")),
    }
}

fn required(schema: &Value, here: &str) -> Result<(), String> {
    let Some(required) = schema.get("required") else { return Ok(()) };
    let names = required.as_array().ok_or_else(|| format!("{here}`required` is no list of names"))?;
    for name in names {
        let known = |name: &&str| properties(schema).is_some_and(|inner| inner.contains_key(*name));
        if name.as_str().filter(known).is_none() {
            return Err(format!("{here}`required` names {name}, which is no property"));
        }
    }
    Ok(())
}
