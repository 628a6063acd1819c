//! Descriptions in Thrift's compact protocol.
//!
//! Source: Apache Thrift, "Thrift compact protocol encoding".

use crate::columnar::varint;

/// Structs in structs beyond this are refused, so that no file can exhaust the stack.
const DEEPEST: usize = 16;

/// A value. Numbers of all sizes are one kind; what no description of Parquet has is `Other`.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value<'a> {
    Truth(bool),
    Number(i64),
    Bytes(&'a [u8]),
    List(Vec<Value<'a>>),
    Struct(Vec<(i16, Value<'a>)>),
    Other,
}

impl<'a> Value<'a> {
    /// A struct at the beginning of some bytes, and how many bytes it has. None: it is none, or is cut off.
    pub(super) fn read(bytes: &'a [u8]) -> Option<(Self, usize)> {
        let mut reading = Reading { bytes, at: 0 };
        let value = reading.fields(0)?;
        Some((value, reading.at))
    }

    /// A field of a struct by its number.
    pub(super) fn field(&self, number: i16) -> Option<&Self> {
        let Self::Struct(fields) = self else { return None };
        fields.iter().find(|(known, _)| *known == number).map(|(_, value)| value)
    }

    /// A field that is a number.
    pub(super) fn number(&self, number: i16) -> Option<i64> {
        match self.field(number) {
            Some(Self::Number(value)) => Some(*value),
            _ => None,
        }
    }

    /// A field that is a number and counts or measures something.
    pub(super) fn count(&self, number: i16) -> Option<u64> {
        self.number(number).and_then(|value| u64::try_from(value).ok())
    }

    /// A field that is true or false.
    pub(super) fn truth(&self, number: i16) -> Option<bool> {
        match self.field(number) {
            Some(Self::Truth(value)) => Some(*value),
            _ => None,
        }
    }

    /// A field that is a text; what is no UTF-8 in it is replaced.
    pub(super) fn text(&self, number: i16) -> Option<String> {
        match self.field(number) {
            Some(Self::Bytes(bytes)) => Some(String::from_utf8_lossy(bytes).into_owned()),
            _ => None,
        }
    }

    /// A field that is a list; empty if there is none.
    pub(super) fn list(&self, number: i16) -> &[Self] {
        match self.field(number) {
            Some(Self::List(values)) => values,
            _ => &[],
        }
    }
}

/// Bytes that are read from the front.
#[derive(Debug)]
struct Reading<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reading<'a> {
    fn byte(&mut self) -> Option<u8> {
        let byte = self.bytes.get(self.at).copied()?;
        self.at += 1;
        Some(byte)
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    fn whole(&mut self) -> Option<u64> {
        let (number, length) = varint(self.bytes.get(self.at..)?)?;
        self.at += length;
        Some(number)
    }

    fn signed(&mut self) -> Option<i64> {
        self.whole().map(zigzag)
    }

    /// The fields of a struct up to its end mark.
    fn fields(&mut self, depth: usize) -> Option<Value<'a>> {
        if depth > DEEPEST {
            return None;
        }
        let (mut fields, mut last) = (Vec::new(), 0_i16);
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(Value::Struct(fields));
            }
            last = match i16::from(head >> 4) {
                0 => i16::try_from(self.signed()?).ok()?,
                more => last.checked_add(more)?,
            };
            let value = match head & 15 {
                1 => Value::Truth(true),
                2 => Value::Truth(false),
                kind => self.value(kind, depth)?,
            };
            fields.push((last, value));
        }
    }

    /// A value outside of a struct's head: a truth has a byte there.
    fn value(&mut self, kind: u8, depth: usize) -> Option<Value<'a>> {
        Some(match kind {
            1 | 2 => Value::Truth(self.byte()? == 1),
            3 => Value::Number(i64::from(self.byte()?.cast_signed())),
            4..=6 => Value::Number(self.signed()?),
            7 => self.take(8).map(|_| Value::Other)?,
            8 => {
                let length = usize::try_from(self.whole()?).ok()?;
                Value::Bytes(self.take(length)?)
            }
            9 | 10 => self.items(depth)?,
            11 => self.pairs(depth)?,
            12 => self.fields(depth + 1)?,
            _ => return None,
        })
    }

    fn items(&mut self, depth: usize) -> Option<Value<'a>> {
        let head = self.byte()?;
        let count = if head >> 4 == 15 { self.whole()? } else { u64::from(head >> 4) };
        if depth > DEEPEST || count > (self.bytes.len() - self.at) as u64 {
            // each item has a byte at least
            return None;
        }
        (0..count).map(|_| self.value(head & 15, depth + 1)).collect::<Option<_>>().map(Value::List)
    }

    fn pairs(&mut self, depth: usize) -> Option<Value<'a>> {
        let count = self.whole()?;
        let kinds = if count == 0 { 0 } else { self.byte()? };
        if depth > DEEPEST || count > self.bytes.len() as u64 {
            return None;
        }
        for _ in 0..count {
            self.value(kinds >> 4, depth + 1)?;
            self.value(kinds & 15, depth + 1)?;
        }
        Some(Value::Other)
    }
}

/// 0, -1, 1, -2, ... of 0, 1, 2, 3, ...
pub(super) fn zigzag(number: u64) -> i64 {
    (number >> 1).cast_signed() ^ -(number & 1).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structs_are_read_and_hostile_ones_refused() {
        // 1: -1 (i32), 3: true, 20: [2, -2] (i64), 21: "ab", then the end and a byte of something else
        let bytes = [0x15, 1, 0x21, 0x09, 40, 0x26, 4, 3, 0x18, 2, b'a', b'b', 0, 9];
        let (value, length) = Value::read(&bytes).unwrap();
        assert_eq!(length, bytes.len() - 1);
        assert_eq!((value.number(1), value.truth(3), value.text(21)), (Some(-1), Some(true), Some("ab".to_owned())));
        assert_eq!(value.list(20), [Value::Number(2), Value::Number(-2)]);
        for cut in 0..length {
            assert_eq!(Value::read(&bytes[..cut]), None, "{cut}");
        }
        // a list of 2^40 structs, structs in structs without end, a kind that is none
        assert_eq!(Value::read(&[0x19, 0xfc, 0x80, 0x80, 0x80, 0x80, 0x80, 0x40, 0, 0, 0]), None);
        assert_eq!(Value::read(&[0x1c; 100_000]), None);
        assert_eq!(Value::read(&[0x19; 100_000]), None);
        assert_eq!(Value::read(&[0x1d, 0]), None);
        assert_eq!([0, 1, 2, u64::MAX].map(zigzag), [0, -1, 1, i64::MIN]);
    }
}
