//! From parsed TOML to plain values.

use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

use super::problem::Problem;

/// The plain value; what JSON cannot hold (too large an integer, a number that is not finite) is a problem.
pub(super) fn plain(value: &Spanned<DeValue<'_>>, problems: &mut Vec<Problem>) -> toml::Value {
    match value.get_ref() {
        DeValue::String(text) => toml::Value::String(text.to_string()),
        DeValue::Boolean(flag) => toml::Value::Boolean(*flag),
        DeValue::Datetime(time) => toml::Value::Datetime(*time),
        DeValue::Integer(number) => toml::Value::Integer(integer(number).unwrap_or_else(|| {
            problems.push(
                Problem::new(
                    format!("the integer `{number}` is too large: found more than 63 bits"),
                    value.span(),
                    "too large",
                )
                .help("write it as a float if it need not be exact"),
            );
            0
        })),
        DeValue::Float(number) => match number.as_str().parse() {
            Ok(number) if f64::is_finite(number) => toml::Value::Float(number),
            _ => {
                let message = format!("found `{}`, wanted a finite number", number.as_str());
                problems.push(Problem::new(message, value.span(), "not finite"));
                toml::Value::Float(0.0)
            }
        },
        DeValue::Array(array) => toml::Value::Array(array.iter().map(|element| plain(element, problems)).collect()),
        DeValue::Table(entries) => toml::Value::Table(table(entries, problems)),
    }
}

/// The plain table; see [`plain`].
pub(super) fn table(entries: &DeTable<'_>, problems: &mut Vec<Problem>) -> toml::Table {
    entries.iter().map(|(key, value)| (key.get_ref().to_string(), plain(value, problems))).collect()
}

/// The integer, if it fits.
pub(super) fn integer(number: &DeInteger<'_>) -> Option<i64> {
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// What was found, for messages: `the string "x"`.
pub(super) fn found(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("the string {text:?}"),
        DeValue::Integer(number) => format!("the integer `{number}`"),
        DeValue::Float(number) => format!("the number `{number}`"),
        DeValue::Boolean(flag) => format!("`{flag}`"),
        DeValue::Datetime(time) => format!("the date `{time}`"),
        DeValue::Array(_) => "an array".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
