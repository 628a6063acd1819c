//! Checks values against a schema and fills in defaults.

use serde_json::{Map, Value};

use super::{number, properties};
use crate::stage::ParamError;

/// The value with its defaults; numbers in the form that their type asks for, so that `1` and `1.0` are one parameter
/// and one cache key.
pub(super) fn resolve(schema: &Value, value: Value, path: &str) -> Result<Value, ParamError> {
    let value = typed(schema, value, path)?;
    choices(schema, &value, path)?;
    match value {
        Value::Number(_) => number::check(schema, &value).map_err(|wanted| wrong(path, &value, &wanted))?,
        Value::String(_) => {
            let length = value.as_str().map_or(0, |text| text.chars().count());
            within(schema, ("minLength", "maxLength"), length, "characters")
                .map_err(|wanted| wrong(path, &value, &wanted))?;
        }
        Value::Array(items) => return array(schema, items, path),
        Value::Object(members) => return object(schema, members, path),
        Value::Null | Value::Bool(_) => {}
    }
    Ok(value)
}

/// The value as one of the types that the schema allows.
fn typed(schema: &Value, value: Value, path: &str) -> Result<Value, ParamError> {
    let names: Vec<&str> = match schema.get("type") {
        Some(Value::String(name)) => vec![name.as_str()],
        Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).collect(),
        _ => return Ok(value),
    };
    match names.iter().find_map(|name| as_type(name, &value)) {
        Some(typed) => Ok(typed),
        None => {
            let words: Vec<&str> = names.iter().map(|name| words(name)).collect();
            Err(wrong(path, &value, &words.join(" or ")))
        }
    }
}

fn as_type(name: &str, value: &Value) -> Option<Value> {
    let fits = match name {
        "integer" => return number::whole(value).map(Value::from),
        "number" => return value.as_f64().filter(|_| value.is_number()).map(Value::from),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        "null" => value.is_null(),
        _ => false,
    };
    fits.then(|| value.clone())
}

fn words(name: &str) -> &'static str {
    match name {
        "integer" => "a whole number",
        "number" => "a number",
        "string" => "text",
        "boolean" => "true or false",
        "array" => "an array",
        "object" => "a table",
        _ => "null",
    }
}

fn choices(schema: &Value, value: &Value, path: &str) -> Result<(), ParamError> {
    let none = Vec::new();
    let choices: Vec<&Value> = match (schema.get("enum").and_then(Value::as_array), schema.get("const")) {
        (None, None) => return Ok(()),
        (choices, only) => choices.unwrap_or(&none).iter().chain(only).collect(),
    };
    let same = |choice: &&Value| **choice == *value || (choice.is_number() && choice.as_f64() == value.as_f64());
    if choices.iter().any(same) {
        return Ok(());
    }
    let message = match (value, choices.iter().all(|choice| choice.is_string())) {
        (Value::String(found), true) => {
            let known: Vec<String> =
                choices.iter().filter_map(|choice| Some(format!("`{}`", choice.as_str()?))).collect();
            format!("unknown variant `{found}`, expected one of {}", known.join(", "))
        }
        _ => {
            let known: Vec<String> = choices.iter().map(ToString::to_string).collect();
            return Err(wrong(path, value, &known.join(" or ")));
        }
    };
    Err(ParamError { path: path.to_owned(), message })
}

fn array(schema: &Value, items: Vec<Value>, path: &str) -> Result<Value, ParamError> {
    within(schema, ("minItems", "maxItems"), items.len(), "values").map_err(|wanted| ParamError {
        path: path.to_owned(),
        message: format!("found {} values, wanted {wanted}", items.len()),
    })?;
    let Some(inner) = schema.get("items") else { return Ok(Value::Array(items)) };
    let each = |(index, item)| resolve(inner, item, &format!("{path}[{index}]"));
    items.into_iter().enumerate().map(each).collect()
}

fn object(schema: &Value, mut members: Map<String, Value>, path: &str) -> Result<Value, ParamError> {
    let at = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    let none = Map::new();
    let inner = properties(schema).unwrap_or(&none);
    let closed = schema.get("additionalProperties") == Some(&Value::Bool(false));
    if let Some(other) = members.keys().find(|name| closed && !inner.contains_key(*name)) {
        let known: Vec<String> = inner.keys().map(|name| format!("`{name}`")).collect();
        let message = format!("unknown field `{other}`, expected one of {}", known.join(", "));
        return Err(ParamError { path: at(other), message });
    }
    // in the order of the schema: a result states its parameters as the plugin does
    let mut resolved = Map::new();
    for (name, schema) in inner {
        if let Some(value) = members.remove(name).or_else(|| schema.get("default").cloned()) {
            resolved.insert(name.clone(), resolve(schema, value, &at(name))?);
        }
    }
    let required = schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
    if let Some(name) = required.into_iter().find(|name| !resolved.contains_key(*name) && !members.contains_key(*name))
    {
        return Err(ParamError { path: path.to_owned(), message: format!("missing field `{name}`") });
    }
    resolved.extend(members);
    Ok(Value::Object(resolved))
}

/// What is wanted of a length, if it is not that.
fn within(schema: &Value, (least, most): (&str, &str), length: usize, what: &str) -> Result<(), String> {
    let limit = |name: &str| schema.get(name).and_then(Value::as_u64);
    let (least, most) = (limit(least), limit(most));
    let inside = least.is_none_or(|least| length as u64 >= least) && most.is_none_or(|most| length as u64 <= most);
    match (inside, least, most) {
        (true, ..) => Ok(()),
        (false, Some(least), Some(most)) => Err(format!("{least} to {most} {what}")),
        (false, Some(least), None) => Err(format!("at least {least} {what}")),
        (false, None, most) => Err(format!("at most {} {what}", most.unwrap_or_default())),
    }
}

/// An error in serde's words.
fn wrong(path: &str, value: &Value, wanted: &str) -> ParamError {
    let found = match value {
        Value::Null => "null".to_owned(),
        Value::Bool(flag) => format!("boolean `{flag}`"),
        Value::Number(number) if number.is_f64() => format!("floating point `{number}`"),
        Value::Number(number) => format!("integer `{number}`"),
        Value::String(text) => format!("string {text:?}"),
        Value::Array(_) => "sequence".to_owned(),
        Value::Object(_) => "map".to_owned(),
    };
    ParamError { path: path.to_owned(), message: format!("invalid value: {found}, expected {wanted}") }
}
