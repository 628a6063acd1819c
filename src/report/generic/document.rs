//! Documents as facts and tables.

use std::collections::HashSet;

use serde_json::{Map, Value};

use super::ROWS;
use crate::report::number::{UNKNOWN, integer, number, quantity};
use crate::report::view::{Fact, Head, TableView};
use crate::show::columns;

/// Splits a JSON document into facts (`events.found` = 24) and, for lists of objects, tables.
pub(crate) fn document_view(document: &Value) -> (Vec<Fact>, Vec<TableView>) {
    let (mut facts, mut tables) = (Vec::new(), Vec::new());
    walk("", document, &mut facts, &mut tables);
    (facts, tables)
}

fn walk(path: &str, value: &Value, facts: &mut Vec<Fact>, tables: &mut Vec<TableView>) {
    match value {
        Value::Object(map) if is_quantity(map) => facts.push(Fact::new(path, quantity_text(path, map))),
        Value::Object(map) => {
            for (key, value) in map {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                walk(&path, value, facts, tables);
            }
        }
        Value::Array(list) if list.iter().any(Value::is_object) => tables.push(objects(path, list)),
        other => facts.push(Fact::new(if path.is_empty() { "value" } else { path }, named_scalar(path, other))),
    }
}

/// Whether an object is one number with its unit or error: `{ "value": 3.8, "std": 0.4, "unit": "N/m" }`.
fn is_quantity(map: &Map<String, Value>) -> bool {
    map.contains_key("value") && map.len() > 1 && map.keys().all(|key| matches!(key.as_str(), "value" | "std" | "unit"))
}

fn quantity_text(name: &str, map: &Map<String, Value>) -> String {
    let at = |name: &str| map.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
    let unit = map.get("unit").and_then(Value::as_str).unwrap_or(unit_in(name));
    match map.get("value") {
        Some(Value::Number(_)) => quantity(at("value"), at("std"), unit),
        Some(other) => scalar(other),
        None => UNKNOWN.to_owned(),
    }
}

/// A table with a column for each key, in the order in which keys first appear; where few objects share a key, of one
/// column with whole objects.
fn objects(caption: &str, list: &[Value]) -> TableView {
    let empty = Map::new();
    let rows: Vec<&Map<String, Value>> = list.iter().map(|item| item.as_object().unwrap_or(&empty)).collect();
    let Some(keys) = columns(&rows) else {
        let mut view = TableView::new(caption, vec![Head::text("entry")]);
        view.rows.extend(list.iter().take(ROWS).map(|item| vec![scalar(item)]));
        return view.truncated(ROWS, rows.len());
    };
    let worded = |(_, value): &(&String, &Value)| !value.is_number() && !value.is_null();
    let words: HashSet<&str> =
        rows.iter().flat_map(|row| row.iter()).filter(worded).map(|(key, _)| key.as_str()).collect();
    let heads = keys.iter().map(|key| Head { numeric: !words.contains(key), ..Head::text(key) }).collect();
    let mut view = TableView::new(caption, heads);
    for row in rows.iter().take(ROWS) {
        view.rows.push(keys.iter().map(|key| row.get(*key).map_or_else(String::new, scalar)).collect());
    }
    view.truncated(ROWS, rows.len())
}

/// A number with the unit that its name carries, other values as they are.
fn named_scalar(name: &str, value: &Value) -> String {
    match (value, unit_in(name)) {
        (Value::Number(value), unit) if !unit.is_empty() => {
            quantity(value.as_f64().unwrap_or(f64::NAN), f64::NAN, unit)
        }
        (value, _) => scalar(value),
    }
}

/// The unit that a name ends with: `stiffness_n_per_m` is in N/m.
fn unit_in(name: &str) -> &'static str {
    // the longest endings first: `_n_per_m` also ends with `_m`
    const ENDINGS: [(&str, &str); 14] = [
        ("_v2_per_hz", "V^2/Hz"),
        ("_n_per_m", "N/m"),
        ("_v_per_m", "V/m"),
        ("_m_per_v", "m/V"),
        ("_v_per_s", "V/s"),
        ("_v_per_v", "V/V"),
        ("_percent", "%"),
        ("_v2", "V^2"),
        ("_hz", "Hz"),
        ("_s", "s"),
        ("_v", "V"),
        ("_n", "N"),
        ("_m", "m"),
        ("_k", "K"),
    ];
    ENDINGS.iter().find(|(ending, _)| name.ends_with(ending)).map_or("", |(_, unit)| unit)
}

/// A value on one line.
fn scalar(value: &Value) -> String {
    match value {
        Value::Null => UNKNOWN.to_owned(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(value) => {
            value.as_i64().map(integer).or(value.as_f64().map(number)).unwrap_or_else(|| value.to_string())
        }
        Value::String(text) => text.clone(),
        Value::Array(list) if list.is_empty() => "none".to_owned(),
        Value::Array(list) => {
            let shown: Vec<String> = list.iter().take(12).map(scalar).collect();
            let more = if list.len() > shown.len() { format!(", … ({} in all)", list.len()) } else { String::new() };
            format!("{}{more}", shown.join(", "))
        }
        Value::Object(map) if is_quantity(map) => quantity_text("", map),
        Value::Object(map) => {
            let parts: Vec<String> = map.iter().map(|(key, value)| format!("{key}: {}", scalar(value))).collect();
            parts.join(", ")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_objects_become_tables_and_the_rest_facts() {
        let document = serde_json::json!({
            "events": {"found": 24, "rejected": [{"record": "a.h5", "reason": "no rupture"}, {"record": "b.h5", "extra": null}]},
            "fit": 99.8123456, "k": {"value": 3.81, "std": 0.12, "unit": "N/m"}, "ids": [1, 2], "none": [], "unknown": null, "free_s": 1.5e-3,
        });
        let (facts, tables) = document_view(&document);
        assert!(facts.contains(&Fact::new("events.found", "24")));
        assert!(facts.contains(&Fact::new("fit", "99.8123")));
        assert!(facts.contains(&Fact::new("ids", "1, 2")));
        assert!(facts.contains(&Fact::new("k", "3.81(12) N/m")));
        assert!(facts.contains(&Fact::new("free_s", "1.5 ms")));
        assert!(facts.contains(&Fact::new("none", "none")));
        assert!(facts.contains(&Fact::new("unknown", "–")));
        assert_eq!(tables.len(), 1);
        assert_eq!(tables[0].caption, "events.rejected");
        assert_eq!(tables[0].rows.len(), 2);
        assert_eq!(tables[0].heads.len(), 3);
    }

    #[test]
    fn objects_that_share_no_keys_make_no_table_of_all_their_keys() {
        let own: Vec<Value> = (0..50_000).map(|k| serde_json::json!({ format!("a{k}"): k })).collect();
        let (_, tables) = document_view(&serde_json::json!({ "modes": own }));
        assert_eq!((tables[0].heads.len(), tables[0].rows.len()), (1, ROWS));
        assert_eq!(tables[0].rows[1], ["a1: 1"]);
    }

    #[test]
    fn a_bare_value_is_shown_too() {
        assert_eq!(document_view(&Value::from(3)).0, [Fact::new("value", "3")]);
    }
}
