//! What Arrow says of the columns of a table: in its own files, and as a text in base 64 in those of Parquet.
//!
//! Source: Apache Arrow, "Arrow columnar format" and "Schema.fbs", "Message.fbs".

use super::{Buffer, DEEPEST, MOST_COLUMNS, What};
use crate::Number;
use std::cell::Cell;

/// Name of the text in files of Parquet.
pub(crate) const KEY: &str = "ARROW:schema";

/// The version from which on unions do not say which of their values are missing.
const VERSION_5: usize = 4;

/// Parts of a second, by the number of their unit, and its name.
const UNITS: [(i64, &str); 4] = [(1, "s"), (1000, "ms"), (1_000_000, "us"), (1_000_000_000, "ns")];

/// Unit of times and time differences where none is written: milliseconds.
const UNSAID_UNIT: usize = 1;

/// The unit of a field.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unit {
    pub(crate) unit: String,
    /// Whether it is that of time differences, by their type.
    pub(crate) of_duration: bool,
}

/// What the values of a field are.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Holds {
    /// Numbers of so many bits each; of more bits than those of `number` the lowest count.
    Numbers { number: Number, bits: usize, what: What },
    /// The fields in it.
    Struct,
    /// Something else, and in how many buffers besides those of the fields in it.
    Else { called: &'static str, buffers: usize },
    /// Texts or bytes of which each batch says in how many buffers they are, besides two.
    Views,
}

/// A field of a table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) holds: Holds,
    pub(crate) unit: Option<Unit>,
    /// The fields in it.
    pub(crate) fields: Vec<Self>,
}

/// A table's description.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Schema {
    pub(crate) big_endian: bool,
    pub(crate) fields: Vec<Field>,
    /// Names and texts that belong to the whole table.
    pub(crate) texts: Vec<(String, String)>,
}

impl Schema {
    /// From the table at `at`, in a message of this version. None: damaged, or more columns than any recording has.
    pub(crate) fn read(buffer: &Buffer, at: usize, version: usize) -> Option<Self> {
        let reading = Reading { buffer, version, fields_left: Cell::new(MOST_COLUMNS) };
        let big_endian = buffer.whole::<2>(at, 0, 0) == 1;
        let schema = Self { big_endian, fields: reading.fields(at, 1, 0)?, texts: buffer.pairs(at, 2) };
        (!buffer.is_spent()).then_some(schema)
    }
}

/// Names and units of the fields that state one, from a text in base 64. Empty if the text is none of a schema.
pub(crate) fn units(text: &str) -> Vec<(String, Unit)> {
    let fields = base64(text).and_then(|bytes| in_message(&bytes)).map(|schema| schema.fields).unwrap_or_default();
    fields.into_iter().filter_map(|field| Some((field.name, field.unit?))).collect()
}

fn in_message(bytes: &[u8]) -> Option<Schema> {
    // a mark and the length stand before the message, in old files the length alone
    let head = if bytes.starts_with(&[0xff; 4]) { 8 } else { 4 };
    let buffer = Buffer::new(bytes.get(head..)?);
    let message = buffer.follow(0)?;
    Schema::read(&buffer, buffer.inner(message, 2)?, buffer.whole::<2>(message, 0, 0))
}

/// Whether metadata of this name state a unit.
pub(crate) fn names_unit(name: &str) -> bool {
    matches!(name, "unit" | "units")
}

/// Fields that are being read.
#[derive(Debug)]
struct Reading<'a> {
    buffer: &'a Buffer<'a>,
    version: usize,
    fields_left: Cell<usize>,
}

impl Reading<'_> {
    /// The fields in a list of a table.
    fn fields(&self, table: usize, number: usize, depth: usize) -> Option<Vec<Field>> {
        if depth > DEEPEST {
            return None;
        }
        self.buffer.items(table, number)?.into_iter().map(|at| self.field(at, depth)).collect()
    }

    fn field(&self, at: usize, depth: usize) -> Option<Field> {
        self.fields_left.set(self.fields_left.get().checked_sub(1)?);
        let name = self.buffer.text(at, 0).unwrap_or_default();
        // a batch has the numbers of entries alone
        if self.buffer.inner(at, 4).is_some() {
            let holds = Holds::Else { called: "entries of a dictionary", buffers: 2 };
            return Some(Field { name, holds, unit: None, fields: Vec::new() });
        }
        let (holds, duration) = self.kind(at);
        let of_duration = duration.map(|unit| Unit { unit: unit.to_owned(), of_duration: true });
        let stated = || self.buffer.pairs(at, 6).into_iter().find(|(name, _)| names_unit(name));
        let unit = of_duration.or_else(|| stated().map(|(_, unit)| Unit { unit, of_duration: false }));
        Some(Field { name, holds, unit, fields: self.fields(at, 5, depth + 1)? })
    }

    /// What a field holds, and its unit if it holds time differences.
    fn kind(&self, field: usize) -> (Holds, Option<&'static str>) {
        let kind = self.buffer.whole::<1>(field, 2, 0);
        let table = self.buffer.inner(field, 3);
        // of the type's table; an empty one may be left out
        let short = |number, unsaid| table.map_or(unsaid, |at| self.buffer.whole::<2>(at, number, unsaid));
        let word = |number, unsaid| table.map_or(unsaid, |at| self.buffer.whole::<4>(at, number, unsaid));
        let other = |called, buffers| Holds::Else { called, buffers };
        let unit = |unsaid| UNITS.get(short(0, unsaid)).copied().unwrap_or((1, "s"));
        let holds = match kind {
            1 => other("nothing", 0),
            2 => {
                let signed = table.is_some_and(|at| self.buffer.whole::<1>(at, 1, 0) != 0);
                whole_numbers(word(0, 0), signed)
            }
            3 => match short(0, 0) {
                0 => numbers(Number::F16, What::Plain),
                1 => numbers(Number::F32, What::Plain),
                _ => numbers(Number::F64, What::Plain),
            },
            4 | 5 | 19 | 20 => other("texts or bytes", 3),
            6 => Holds::Numbers { number: Number::U8, bits: 1, what: What::Plain },
            7 => decimals(word(0, 0), word(1, 0) as u32 as i32, word(2, 128)),
            8 => other("dates", 2),
            9 => {
                let number = if word(1, 32) == 32 { Number::I32 } else { Number::I64 };
                numbers(number, What::TimeOfDay(1.0 / unit(UNSAID_UNIT).0 as f64))
            }
            10 => {
                let utc = table.and_then(|at| self.buffer.text(at, 1)).is_some_and(|zone| !zone.is_empty());
                numbers(Number::I64, What::Moments { per_second: unit(0).0, utc })
            }
            11 => other("stretches of a calendar", 2),
            12 | 17 | 21 => other("lists", 2),
            13 => Holds::Struct,
            14 => other("values of several types", 1 + short(0, 0) + usize::from(self.version < VERSION_5)),
            15 => other("texts or bytes", 2),
            16 => other("lists", 1),
            18 => numbers(Number::I64, What::Plain),
            22 => other("runs of equal values", 0),
            23 | 24 => Holds::Views,
            25 | 26 => other("lists", 3),
            _ => other("values of an unknown type", 2),
        };
        (holds, (kind == 18).then(|| unit(UNSAID_UNIT).1))
    }
}

fn numbers(number: Number, what: What) -> Holds {
    Holds::Numbers { number, bits: 8 * number.bytes() as usize, what }
}

fn whole_numbers(bits: usize, signed: bool) -> Holds {
    let number = match (bits, signed) {
        (8, true) => Number::I8,
        (8, false) => Number::U8,
        (16, true) => Number::I16,
        (16, false) => Number::U16,
        (32, true) => Number::I32,
        (32, false) => Number::U32,
        (64, true) => Number::I64,
        (64, false) => Number::U64,
        _ => return Holds::Else { called: "whole numbers of an unknown width", buffers: 2 },
    };
    numbers(number, What::Plain)
}

/// Decimal fractions; those of up to 18 digits fit into 64 bits.
fn decimals(digits: usize, places: i32, bits: usize) -> Holds {
    let number = if bits == 32 { Number::I32 } else { Number::I64 };
    match bits {
        32 | 64 | 128 | 256 if digits <= 18 => Holds::Numbers { number, bits, what: What::decimals(places) },
        _ => Holds::Else { called: "decimal fractions of many digits", buffers: 2 },
    }
}

/// The bytes of a text in base 64; none if it is none.
fn base64(text: &str) -> Option<Vec<u8>> {
    let digit = |byte: u8| {
        Some(u32::from(match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        }))
    };
    let mut bytes = Vec::new();
    for group in text.trim_end_matches('=').as_bytes().chunks(4) {
        let mut word = 0;
        for at in 0..4 {
            word = word << 6 | group.get(at).map_or(Some(0), |&byte| digit(byte))?;
        }
        let [_, whole @ ..] = word.to_be_bytes();
        bytes.extend_from_slice(whole.get(..group.len() - 1)?);
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_in_base_64_and_damaged_schemas() {
        assert_eq!(base64("TWFueQ==").unwrap(), b"Many");
        assert_eq!(base64("TWFu").unwrap(), b"Man");
        assert_eq!((base64("T*Fu"), base64("")), (None, Some(Vec::new())));
        for bytes in [&[0xff_u8; 40][..], &[0; 40], &[1; 7], &[]] {
            assert_eq!(in_message(bytes).filter(|schema| !schema.fields.is_empty()), None);
        }
    }

    /// A table of two fields, which are one and the same, with two fields in it, and so on for 32 levels: read one by
    /// one, four thousand million. Each table begins 16 bytes behind a multiple of 40.
    fn doubled() -> Vec<u8> {
        let mut bytes = Vec::new();
        for _ in 0..32 {
            // bytes of this list and of the table; where its parts 0 to 5 are: byte order, fields, fields of a field
            for half in [16_u16, 12, 8, 4, 0, 0, 0, 4] {
                bytes.extend(half.to_le_bytes());
            }
            // back to that list, on to the fields, big-endian; two fields, the distance of each to the next table
            for word in [16_u32, 8, 1, 2, 24, 20] {
                bytes.extend(word.to_le_bytes());
            }
        }
        bytes
    }

    #[test]
    fn a_description_that_is_made_to_take_long_is_not_read() {
        let mut bytes = doubled();
        assert_eq!(Buffer::new(&bytes).items(16, 1).unwrap(), [56, 56]);
        assert_eq!(Schema::read(&Buffer::new(&bytes), 16, 4), None);
        // a list that is longer than the description, one of nothing
        for (count, fields) in [(1 << 30, None), (0, Some(0))] {
            bytes[28..32].copy_from_slice(&u32::to_le_bytes(count));
            let found = Schema::read(&Buffer::new(&bytes), 16, 4);
            assert_eq!(found.as_ref().map(|schema| schema.fields.len()), fields);
            assert!(found.is_none_or(|schema| schema.big_endian && schema.texts.is_empty()));
        }
    }
}
