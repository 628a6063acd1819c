//! Units, and time differences, that Arrow keeps with the fields of a table: its schema lies in a Parquet file as a text in base 64.
//!
//! Only what leads to them is read: of a message its schema, of that the fields, of each the name, the type and the
//! metadata.
//!
//! Source: Apache Arrow, "Arrow columnar format" and "Schema.fbs", "Message.fbs"; Google, "FlatBuffers internals".

/// Name of the text.
pub(super) const KEY: &str = "ARROW:schema";

/// More fields or pairs are no recording.
const MOST_ITEMS: usize = 1 << 16;

/// Number of the type of time differences, and their units.
const DURATION: usize = 18;
const DURATION_UNITS: [&str; 4] = ["s", "ms", "us", "ns"];

/// The unit of a field.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unit {
    pub(super) unit: String,
    /// Whether it is that of time differences, by their type.
    pub(super) of_duration: bool,
}

/// Names and units of the fields that state one. Empty if the text is none of a schema.
pub(super) fn units(text: &str) -> Vec<(String, Unit)> {
    base64(text).and_then(|bytes| in_message(&bytes)).unwrap_or_default()
}

fn in_message(bytes: &[u8]) -> Option<Vec<(String, Unit)>> {
    // a mark and the length stand before the message, in old files the length alone
    let head = if bytes.starts_with(&[0xff; 4]) { 8 } else { 4 };
    let buffer = Buffer(bytes.get(head..)?);
    let message = buffer.follow(0)?;
    let schema = buffer.inner(message, 2)?;
    let stated = |field| unit(&buffer, field).map(|unit| Unit { unit, of_duration: false });
    let named = |field| Some((buffer.text(field, 0)?, duration(&buffer, field).or_else(|| stated(field))?));
    Some(buffer.items(schema, 1).into_iter().filter_map(named).collect())
}

fn unit(buffer: &Buffer, field: usize) -> Option<String> {
    let pairs = buffer.items(field, 6);
    let pair = pairs.into_iter().find(|&pair| buffer.text(pair, 0).is_some_and(|name| super::names_unit(&name)))?;
    buffer.text(pair, 1)
}

/// The unit of a field of time differences.
fn duration(buffer: &Buffer, field: usize) -> Option<Unit> {
    let kind = buffer.number::<1>(buffer.field(field, 2)?).filter(|kind| *kind == DURATION);
    let table = kind.and_then(|_| buffer.inner(field, 3))?;
    // milliseconds are not written
    let unit = buffer.field(table, 0).map_or(Some(1), |at| buffer.number::<2>(at))?;
    Some(Unit { unit: (*DURATION_UNITS.get(unit)?).to_owned(), of_duration: true })
}

/// Tables that refer to one another by their distances.
#[derive(Debug)]
struct Buffer<'a>(&'a [u8]);

impl Buffer<'_> {
    fn number<const N: usize>(&self, at: usize) -> Option<usize> {
        let bytes = self.0.get(at..at.checked_add(N)?)?;
        Some(bytes.iter().rev().fold(0, |number, &byte| number << 8 | usize::from(byte)))
    }

    /// What the distance at `at` leads to.
    fn follow(&self, at: usize) -> Option<usize> {
        at.checked_add(self.number::<4>(at)?)
    }

    /// Where a table has its field of this number.
    fn field(&self, table: usize, number: usize) -> Option<usize> {
        let back = self.number::<4>(table)? as u32 as i32;
        let list = i64::try_from(table).ok()?.checked_sub(i64::from(back))?;
        let list = usize::try_from(list).ok()?;
        let at = 4 + 2 * number;
        let offset = if at < self.number::<2>(list)? { self.number::<2>(list.checked_add(at)?)? } else { 0 };
        (offset > 0).then_some(table.checked_add(offset)?)
    }

    fn inner(&self, table: usize, number: usize) -> Option<usize> {
        self.follow(self.field(table, number)?)
    }

    fn text(&self, table: usize, number: usize) -> Option<String> {
        let at = self.inner(table, number)?;
        let from = at.checked_add(4)?;
        let bytes = self.0.get(from..from.checked_add(self.number::<4>(at)?)?)?;
        Some(String::from_utf8_lossy(bytes).into_owned())
    }

    /// The tables of a list of tables.
    fn items(&self, table: usize, number: usize) -> Vec<usize> {
        let Some((at, count)) = self.inner(table, number).and_then(|at| Some((at, self.number::<4>(at)?))) else {
            return Vec::new();
        };
        let item = |number: usize| self.follow(at.checked_add(4)?.checked_add(4 * number)?);
        (0..count.min(MOST_ITEMS)).map_while(item).collect()
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
            assert!(in_message(bytes).unwrap_or_default().is_empty());
        }
    }
}
