//! Properties of objects.

use super::bytes::Bytes;
use super::kind::Kind;
use super::stamp::Stamp;
use crate::FormatError;
use crate::fail;
use crate::number::Order;
use crate::rate::{Clue, is_unit_of_clue, unit_names};
use std::collections::BTreeMap;

/// A property's value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Text(String),
    Time(Stamp),
    /// Of a type no reader of recordings has use for.
    Other,
}

/// The properties of one object that matter here.
#[derive(Debug, Clone, Default)]
pub(super) struct Properties(BTreeMap<String, Value>);

impl Properties {
    /// Keeps a property if it is one of those read here: a file may state thousands of others with every segment.
    pub(super) fn keep(&mut self, name: String, value: Value) {
        let wanted = ["wf_", "NI_", "unit_string", "DateTime", "description"].iter().any(|w| name.starts_with(w));
        if wanted || Clue::of(&name, "", 1.0).is_some() || is_unit_of_clue(&name) {
            self.0.insert(name, value);
        }
    }

    pub(super) fn number(&self, name: &str) -> Option<f64> {
        match self.0.get(name) {
            Some(Value::Number(number)) => Some(*number),
            _ => None,
        }
    }

    /// Text without blanks around it; none if nothing is left.
    pub(super) fn text(&self, name: &str) -> Option<&str> {
        match self.0.get(name) {
            Some(Value::Text(text)) => Some(text.trim()).filter(|t| !t.is_empty()),
            _ => None,
        }
    }

    /// A time that is known.
    pub(super) fn time(&self, name: &str) -> Option<Stamp> {
        match self.0.get(name) {
            Some(Value::Time(time)) => Some(*time).filter(|t| t.is_known()),
            _ => None,
        }
    }

    /// What is named like a sampling rate or a start; a number may be written as text, with its unit.
    pub(super) fn clues(&self, location: &str) -> Vec<Clue> {
        let unit = |name: &str| unit_names(name).into_iter().find_map(|name| self.text(&name)).unwrap_or_default();
        let clue = |(name, found): (&String, &Value)| {
            let location = format!("{location}@{name}");
            let clue = match found {
                Value::Number(number) => Clue::of(name, &location, *number),
                Value::Text(text) => Clue::of_text(name, &location, text),
                _ => None,
            };
            Some(clue?.in_unit(unit(name)))
        };
        self.0.iter().filter_map(clue).collect()
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}

/// Reads one property: name, type, value.
pub(super) fn read(bytes: &mut Bytes) -> Result<(String, Value), FormatError> {
    let name = bytes.text("a property's name")?;
    let at = bytes.at();
    let code = bytes.u32("a property's type")?;
    let kind = Kind::of_code(code);
    let what = "a property's value";
    let value = match kind {
        Some(Kind::Int8) => Value::Number(f64::from(i8::from_le_bytes(bytes.number(what)?))),
        Some(Kind::Int16) => Value::Number(f64::from(i16::from_le_bytes(bytes.number(what)?))),
        Some(Kind::Int32) => Value::Number(f64::from(i32::from_le_bytes(bytes.number(what)?))),
        Some(Kind::Int64) => Value::Number(i64::from_le_bytes(bytes.number(what)?) as f64),
        Some(Kind::UInt8 | Kind::Boolean) => Value::Number(f64::from(bytes.u8(what)?)),
        Some(Kind::UInt16) => Value::Number(f64::from(u16::from_le_bytes(bytes.number(what)?))),
        Some(Kind::UInt32) => Value::Number(f64::from(bytes.u32(what)?)),
        Some(Kind::UInt64) => Value::Number(bytes.u64(what)? as f64),
        Some(Kind::Float32) => Value::Number(f64::from(f32::from_le_bytes(bytes.number(what)?))),
        Some(Kind::Float64) => Value::Number(f64::from_le_bytes(bytes.number(what)?)),
        Some(Kind::Text) => Value::Text(bytes.text(what)?),
        Some(Kind::Stamp) => Value::Time(stamp(bytes)?),
        Some(Kind::Void) => Value::Other,
        Some(other) if other.width().is_some() => {
            bytes.take(other.width().unwrap_or(0) as usize, what)?;
            Value::Other
        }
        // Its size is not known, so nothing behind it can be found.
        Some(other) => return Err(unreadable(at, &name, other.name())),
        None => return Err(unreadable(at, &name, &format!("0x{code:08X}"))),
    };
    Ok((name, value))
}

fn unreadable(at: u64, name: &str, kind: &str) -> FormatError {
    let problem = format!("the property «{name}» is of type {kind}, a type of fixed size or text was wanted");
    fail::at(at, problem, "save the file again without that property, or see whether it is damaged")
}

/// Fraction and seconds as they lie: the order of the two follows the byte order.
fn stamp(bytes: &mut Bytes) -> Result<Stamp, FormatError> {
    let (first, second) = (bytes.u64("a time stamp")?, bytes.u64("a time stamp")?);
    let (fraction, seconds) = match bytes.order() {
        Order::Little => (first, second),
        Order::Big => (second, first),
    };
    Ok(Stamp { seconds: seconds.cast_signed(), fraction })
}
