//! Documents as text.

use serde_json::{Map, Value};

use super::columns::columns;
use super::grid::narrow_grid;
use super::number::{named_with_std, number};
use super::partners::Partners;
use crate::printable::one_line;

/// Characters in a table's line that most windows show.
const WIDEST: usize = 110;

/// A document as indented lines; lists of flat objects become tables.
pub fn document_text(value: &Value) -> String {
    let mut text = String::new();
    match value {
        Value::Object(entries) => write_object(entries, 0, &mut text),
        other => write_value("", other, 0, &mut text),
    }
    text
}

fn write_object(entries: &Map<String, Value>, depth: usize, text: &mut String) {
    let partners = Partners::of(entries.keys().map(String::as_str));
    for (name, value) in entries.iter().filter(|(name, _)| !partners.is_std(name)) {
        match partners.std(name).and_then(|std| entries.get(std)) {
            Some(std) if value.is_number() => {
                text.push_str(&format!("{}{}: {}\n", indent(depth), one_line(name), uncertain(name, value, std)));
            }
            _ => write_value(name, value, depth, text),
        }
    }
}

fn write_value(name: &str, value: &Value, depth: usize, text: &mut String) {
    let head = if name.is_empty() { indent(depth) } else { format!("{}{}: ", indent(depth), one_line(name)) };
    match value {
        Value::Object(entries) if !entries.is_empty() => {
            text.push_str(&format!("{}\n", head.trim_end()));
            write_object(entries, depth + 1, text);
        }
        Value::Array(values) if values.iter().any(|value| value.is_object() || value.is_array()) => {
            text.push_str(&format!("{}\n", head.trim_end()));
            match table(values) {
                Some(rows) => {
                    for line in narrow_grid(&rows, WIDEST).lines() {
                        text.push_str(&format!("{}{line}\n", indent(depth + 1)));
                    }
                }
                None => {
                    for (index, value) in values.iter().enumerate() {
                        write_value(&format!("[{index}]"), value, depth + 1, text);
                    }
                }
            }
        }
        scalar => text.push_str(&format!("{head}{}\n", scalar_text(scalar))),
    }
}

/// Whether a value is an object without objects or lists of objects in it.
fn flat(value: &Value) -> bool {
    let simple = |value: &Value| match value {
        Value::Object(_) => false,
        Value::Array(values) => values.iter().all(|value| !value.is_object() && !value.is_array()),
        _ => true,
    };
    value.as_object().is_some_and(|entries| !entries.is_empty() && entries.values().all(simple))
}

/// The rows of a list of flat objects, names first. None of another list, and of one that would make far more cells
/// than it has values.
fn table(values: &[Value]) -> Option<Vec<Vec<String>>> {
    if !values.iter().all(flat) {
        return None;
    }
    let objects: Vec<&Map<String, Value>> = values.iter().filter_map(Value::as_object).collect();
    let names = columns(&objects)?;
    let partners = Partners::of(names.iter().copied());
    let shown: Vec<(&str, Option<&str>)> =
        names.iter().filter(|name| !partners.is_std(name)).map(|name| (*name, partners.std(name))).collect();
    let mut rows: Vec<Vec<String>> = vec![shown.iter().map(|(name, _)| (*name).to_owned()).collect()];
    for object in objects {
        let cell = |(name, std): &(&str, Option<&str>)| match (object.get(*name), std) {
            (Some(value), Some(std)) if value.is_number() => {
                uncertain(name, value, object.get(*std).unwrap_or(&Value::Null))
            }
            (value, _) => value.map_or(String::new(), scalar_text),
        };
        rows.push(shown.iter().map(cell).collect());
    }
    Some(rows)
}

fn uncertain(name: &str, value: &Value, std: &Value) -> String {
    named_with_std(name, value.as_f64().unwrap_or(f64::NAN), std.as_f64().unwrap_or(f64::NAN))
}

fn scalar_text(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::Bool(flag) => if *flag { "yes" } else { "no" }.to_owned(),
        Value::Number(value) if value.is_f64() => number(value.as_f64().unwrap_or(f64::NAN)),
        Value::Number(value) => value.to_string(),
        Value::String(text) => one_line(text),
        Value::Array(values) if !values.is_empty() => values.iter().map(scalar_text).collect::<Vec<_>>().join(", "),
        Value::Array(_) | Value::Object(_) => "none".to_owned(),
    }
}

fn indent(depth: usize) -> String {
    "  ".repeat(depth)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::document_text;

    #[test]
    fn lists_of_objects_are_tables_and_errors_stand_in_brackets() {
        let document = json!({
            "modes": [
                { "frequency_hz": 46300.1, "frequency_std_hz": 0.4, "quality_factor": 40.8, "quality_factor_std": 0.05 },
                { "frequency_hz": 247000.0, "frequency_std_hz": 2.0, "quality_factor": null, "quality_factor_std": null }
            ],
            "fit_percent": { "held_out": 99.8, "noise_ceiling": null },
            "rejected": [],
            "gain": 2.0, "gain_std": 0.1,
            "nested": [{ "a": { "b": true } }],
            "names": ["x", "y"]
        });
        let expected = "\
modes:
  frequency_hz  quality_factor
  46300.10(40)      40.800(50)
  247000.0(20)               -
fit_percent:
  held_out: 99.8
  noise_ceiling: -
rejected: none
gain: 2.00(10)
nested:
  [0]:
    a:
      b: yes
names: x, y
";
        assert_eq!(document_text(&document), expected);
    }

    #[test]
    fn many_keys_take_no_longer_than_many_values() {
        // quadratic, each of these takes minutes
        let own: Vec<Value> = (0..50_000).map(|k| json!({ format!("a{k}"): k })).collect();
        let text = document_text(&json!({ "modes": own }));
        assert!(text.starts_with("modes:\n  [0]:\n    a0: 0\n  [1]:\n    a1: 1\n"), "{}", &text[..80]);
        assert_eq!(text.lines().count(), 100_001);
        let pairs = (0..50_000).flat_map(|k| [(format!("k{k}"), json!(2.0)), (format!("k{k}_std"), json!(0.1))]);
        let text = document_text(&Value::Object(pairs.collect()));
        assert!(text.starts_with("k0: 2.00(10)\n"), "{}", &text[..80]);
        assert_eq!(text.lines().count(), 50_000);
        let one: Vec<Value> = vec![Value::Object((0..90_000).map(|k| (format!("k{k}_std"), json!(k))).collect())];
        assert_eq!(document_text(&Value::Array(one)).lines().count(), 4);
    }
}
