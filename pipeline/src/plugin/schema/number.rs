//! Ranges of numbers.

use serde_json::Value;

/// The whole number, if it is one: JSON Schema counts `3.0` among them.
pub(super) fn whole(value: &Value) -> Option<i64> {
    /// Doubles are exact up to here.
    const MOST: f64 = 9_007_199_254_740_992.0;
    let from_real = |real: f64| (real.trunc() == real && real.abs() <= MOST).then_some(real as i64);
    value.as_i64().or_else(|| value.as_f64().and_then(from_real))
}

/// What is wanted of a number, if it is not that.
pub(super) fn check(schema: &Value, value: &Value) -> Result<(), String> {
    let number = value.as_f64().unwrap_or(f64::NAN);
    let limit = |name: &str| Some((schema.get(name)?, schema.get(name)?.as_f64()?));
    let step = limit("multipleOf").is_none_or(|(_, step)| {
        let times = number / step;
        // decimal steps are not exact in binary: 0.3 is no multiple of 0.1 to the last bit
        (times - times.round()).abs() <= 1e-9 * times.abs().max(1.0)
    });
    let inside = number.is_finite()
        && step
        && limit("minimum").is_none_or(|(_, low)| number >= low)
        && limit("maximum").is_none_or(|(_, high)| number <= high)
        && limit("exclusiveMinimum").is_none_or(|(_, low)| number > low)
        && limit("exclusiveMaximum").is_none_or(|(_, high)| number < high);
    if inside { Ok(()) } else { Err(wanted(schema, limit)) }
}

fn wanted<'a>(schema: &Value, limit: impl Fn(&str) -> Option<(&'a Value, f64)>) -> String {
    let words = [
        ("minimum", "at least"),
        ("exclusiveMinimum", "above"),
        ("maximum", "at most"),
        ("exclusiveMaximum", "below"),
        ("multipleOf", "a multiple of"),
    ];
    let parts: Vec<String> =
        words.iter().filter_map(|(name, word)| Some(format!("{word} {}", limit(name)?.0))).collect();
    let integer = schema.get("type").and_then(Value::as_str) == Some("integer");
    format!("{} {}", if integer { "a whole number" } else { "a number" }, parts.join(" and "))
}
