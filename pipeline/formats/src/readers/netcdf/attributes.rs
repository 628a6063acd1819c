//! Attributes of the file or of a variable.

use super::cursor::{Cursor, Stop};
use super::kind::Kind;
use crate::text::field;

/// A named text or list of numbers.
#[derive(Debug)]
pub(super) struct Attribute {
    pub(super) name: String,
    pub(super) value: Value,
}

#[derive(Debug, PartialEq)]
pub(super) enum Value {
    Text(String),
    Numbers(Vec<f64>),
}

impl Attribute {
    pub(super) fn read(cursor: &mut Cursor) -> Result<Self, Stop> {
        let name = cursor.name()?;
        let code = cursor.code()?;
        let Some(kind) = Kind::of(code, cursor.version) else {
            return cursor.wrong(format!("the attribute {} is of type {code}, wanted 1 to 6", name.escape_debug()));
        };
        let count = cursor.size()?;
        let Some(bytes) = count.checked_mul(kind.bytes()) else { return Err(Stop::Short) };
        let bytes = cursor.padded(bytes)?;
        let value = match kind {
            Kind::Text => Value::Text(field(bytes)),
            Kind::Number(number) => Value::Numbers(number.decode(bytes, true).widened()),
        };
        Ok(Self { name, value })
    }
}

/// The attribute of a name.
pub(super) fn find<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a Value> {
    attributes.iter().find(|attribute| attribute.name == name).map(|attribute| &attribute.value)
}

/// A text of a name that says something.
pub(super) fn text<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a str> {
    match find(attributes, name) {
        Some(Value::Text(text)) if !text.is_empty() => Some(text),
        _ => None,
    }
}

/// The single number of a name. Errors: it is there and is something else.
pub(super) fn number(attributes: &[Attribute], name: &str) -> Result<Option<f64>, String> {
    match find(attributes, name) {
        None => Ok(None),
        Some(Value::Numbers(numbers)) => match numbers.as_slice() {
            [number] => Ok(Some(*number)),
            several => Err(format!("its attribute {name} has {} numbers, wanted one", several.len())),
        },
        Some(Value::Text(text)) => {
            Err(format!("its attribute {name} is the text «{}», wanted a number", crate::text::brief(text, 40)))
        }
    }
}
