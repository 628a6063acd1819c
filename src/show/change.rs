//! What changed since an earlier result, in words and as JSON.

use afmid_pipeline::cache::OriginFile;
use afmid_pipeline::runner::Change;
use serde_json::{Value, json};

/// A change in words.
pub fn change_text(change: &Change) -> String {
    let was_is = |what: &str, was: &str, is: &str| format!("{what} was {was}, is {is}");
    match change {
        Change::Format { was, is } => was_is("the layout of stage files", &was.to_string(), &is.to_string()),
        Change::Version { was, is } => was_is("the stage's version", &was.to_string(), &is.to_string()),
        Change::Parameter { name, was: Some(was), is: Some(is) } => {
            was_is(&format!("`{name}`"), &was.to_string(), &is.to_string())
        }
        Change::Parameter { name, was: None, is } => {
            format!("`{name}` is a new parameter: {}", is.as_ref().unwrap_or(&Value::Null))
        }
        Change::Parameter { name, was: Some(was), is: None } => format!("`{name}` is no parameter any more, was {was}"),
        Change::Seed { was, is } => was_is("the seed", &seed(*was), &seed(*is)),
        Change::Arithmetic { was, is } => was_is("processor or build", was, is),
        Change::DependsOn { was, is } => was_is("what it depends on", &was.join(", "), &is.join(", ")),
        Change::File { name, was: Some(_), is: Some(_) } => format!("file `{name}` has other bytes"),
        Change::File { name, was: None, .. } => format!("file `{name}` is read in addition"),
        Change::File { name, is: None, .. } => format!("file `{name}` is no longer read"),
        Change::Order => "the files come in another order".to_owned(),
        Change::Input { port, was: Some(was), is: Some(is) } if was == is => {
            format!("input `{port}`: what `{is}` gives has changed")
        }
        Change::Input { port, was, is } => was_is(&format!("input `{port}`"), &wired(was), &wired(is)),
        Change::Upstream { stage, change } => format!("`{stage}`: {}", change_text(change)),
    }
}

fn seed(seed: Option<u64>) -> String {
    seed.map_or_else(|| "none".to_owned(), |seed| seed.to_string())
}

fn wired(source: &Option<String>) -> String {
    source.as_ref().map_or_else(|| "not wired".to_owned(), |source| format!("`{source}`"))
}

/// A change as JSON: `kind`, `name`, `was` and `is` are always there; `stage` names the stage that it happened in,
/// null: the stage itself.
pub fn change_json(change: &Change) -> Value {
    let row = |kind: &str, name: Value, was: Value, is: Value| {
        json!({
            "kind": kind,
            "stage": null,
            "name": name,
            "was": was,
            "is": is,
        })
    };
    let file = |file: &Option<OriginFile>| match file {
        Some(file) => json!({ "size_bytes": file.size, "blake3": file.blake3 }),
        None => Value::Null,
    };
    match change {
        Change::Format { was, is } => row("format", Value::Null, json!(was), json!(is)),
        Change::Version { was, is } => row("version", Value::Null, json!(was), json!(is)),
        Change::Parameter { name, was, is } => row("parameter", json!(name), json!(was), json!(is)),
        Change::Seed { was, is } => row("seed", Value::Null, json!(was), json!(is)),
        Change::Arithmetic { was, is } => row("arithmetic", Value::Null, json!(was), json!(is)),
        Change::DependsOn { was, is } => row("depends_on", Value::Null, json!(was), json!(is)),
        Change::File { name, was, is } => row("file", json!(name), file(was), file(is)),
        Change::Order => row("order", Value::Null, Value::Null, Value::Null),
        Change::Input { port, was, is } => row("input", json!(port), json!(was), json!(is)),
        Change::Upstream { stage, change } => {
            let mut inner = change_json(change);
            // the innermost stage is the one where it happened
            if inner["stage"].is_null() {
                inner["stage"] = json!(stage);
            }
            inner
        }
    }
}
