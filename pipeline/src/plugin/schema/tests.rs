//! What a schema lets through, on both sides of each limit.

use serde_json::{Value, json};

use super::Schema;

fn schema() -> Schema {
    Schema::new(&json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["points"],
        "properties": {
            "points": { "type": "integer", "minimum": 3, "multipleOf": 2 },
            "width": { "type": "number", "exclusiveMinimum": 0, "maximum": 1, "default": 1 },
            "mode": { "enum": ["nearest", "mirror"], "default": "mirror" },
            "list": { "type": "array", "items": { "type": "number" }, "minItems": 1, "maxItems": 2 },
            "deep": { "type": "object", "additionalProperties": false, "properties": { "flag": { "type": "boolean" } } },
            "name": { "type": ["string", "null"], "minLength": 2 },
            "file": { "type": "string", "format": "path" }
        }
    }))
    .expect("a schema")
}

fn said(params: Value) -> String {
    match schema().resolve(params) {
        Ok(resolved) => resolved.to_string(),
        Err(error) => format!("{}: {}", error.path, error.message),
    }
}

#[test]
fn defaults_are_filled_in_and_numbers_have_their_type() {
    assert_eq!(said(json!({ "points": 4.0 })), r#"{"points":4,"width":1.0,"mode":"mirror"}"#);
    assert_eq!(schema().paths(&json!({ "file": "a.txt" })), ["a.txt"]);
}

#[test]
fn every_limit_holds_on_both_sides() {
    let right = |params: Value| schema().resolve(params).is_ok();
    let with = |name: &str, value: Value| json!({ "points": 4, name: value });
    for (name, good, bad) in [
        ("points", json!(4), json!(2)),
        ("points", json!(6), json!(5)),
        ("points", json!(4), json!(4.5)),
        ("points", json!(4), json!("4")),
        ("width", json!(1e-300), json!(0)),
        ("width", json!(1), json!(1.0001)),
        ("mode", json!("nearest"), json!("neares")),
        ("list", json!([1]), json!([])),
        ("list", json!([1, 2.5]), json!([1, 2, 3])),
        ("list", json!([1, 2.5]), json!([1, "2"])),
        ("deep", json!({ "flag": true }), json!({ "flag": 1 })),
        ("deep", json!({}), json!({ "flog": true })),
        ("name", json!("ab"), json!("a")),
        ("name", Value::Null, json!(3)),
    ] {
        assert!(right(with(name, good.clone())), "{name} = {good}");
        assert!(!right(with(name, bad.clone())), "{name} = {bad}");
    }
}

#[test]
fn errors_are_in_the_words_that_configs_translate() {
    assert_eq!(said(json!({})), ": missing field `points`");
    assert_eq!(
        said(json!({ "points": 4, "widht": 1 })),
        "widht: unknown field `widht`, expected one of `points`, `width`, `mode`, `list`, `deep`, `name`, `file`"
    );
    assert_eq!(
        said(json!({ "points": 2 })),
        "points: invalid value: integer `2`, expected a whole number at least 3 and a multiple of 2"
    );
    assert_eq!(
        said(json!({ "points": 4, "mode": "mirorr" })),
        "mode: unknown variant `mirorr`, expected one of `nearest`, `mirror`"
    );
    assert_eq!(
        said(json!({ "points": 4, "list": [1, true] })),
        "list[1]: invalid value: boolean `true`, expected a number"
    );
}

#[test]
fn what_would_not_be_checked_is_refused() {
    let wrong = |schema: Value| Schema::new(&schema).expect_err("wrong");
    assert!(wrong(json!({ "type": "object" })).contains("additionalProperties"));
    let with =
        |property: Value| json!({ "type": "object", "additionalProperties": false, "properties": { "x": property } });
    assert!(wrong(with(json!({ "oneOf": [] }))).contains("`x`: the keyword `oneOf` is not checked"));
    assert!(wrong(with(json!({ "minimun": 3 }))).contains("did you mean `minimum`?"));
    assert!(wrong(with(json!({ "type": "integer", "default": 1.5 }))).contains("its default is wrong"));
    assert!(wrong(with(json!({ "type": "float" }))).contains("`type` is none of"));
    assert!(
        wrong(json!({ "type": "object", "additionalProperties": false, "required": ["y"] })).contains("no property")
    );
}
