//! What an element of an array is made of.

use super::literal::Literal;
use crate::number::Number;
use crate::time_units::seconds;

/// Structs in structs beyond this are refused, so that no file can exhaust the stack or, by arrays of arrays, the
/// memory.
const DEEPEST: usize = 8;
/// More fields than a recording has channels.
const MOST_FIELDS: usize = 4096;
/// Names and indices of a field with those around it: together with `MOST_FIELDS` they bound the memory.
const MOST_SUFFIX_BYTES: usize = 512;

/// What an array of objects holds: one pickle for all, of a length that the header does not say.
pub(super) const PICKLED: &str = "Python objects, pickled";

/// A part of an element.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    /// `.outer.inner[2]`, empty if the element is the number itself.
    pub(super) suffix: String,
    /// Bytes from the beginning of the element.
    pub(super) offset: u64,
    /// What it is.
    pub(super) what: Part,
}

/// What a part is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Part {
    /// A number, in big-endian order or not.
    Number(Number, bool),
    /// Real and imaginary part, one behind the other, likewise.
    Complex(Number, bool),
    /// A text of so many bytes, in four for a character or in one, in big-endian order or not.
    Text { bytes: u64, wide: bool, big_endian: bool },
    /// Moments since 1970 or time differences: whole numbers of this unit, in big-endian order or not.
    Times { unit: String, big_endian: bool },
    /// Anything else, in words.
    Other(String),
}

impl Part {
    /// In words, if it is no number and no complex one.
    pub(super) fn no_number(&self) -> Option<String> {
        match self {
            Self::Number(..) | Self::Complex(..) | Self::Times { .. } => None,
            Self::Text { bytes, wide: true, .. } => Some(format!("texts of {} characters", bytes / 4)),
            Self::Text { bytes, .. } => Some(format!("byte strings of {bytes}")),
            Self::Other(what) => Some(what.clone()),
        }
    }
}

/// Parts and size of an element, from the header's `descr`. Error: what is wrong with it.
pub(super) fn of(descr: &Literal) -> Result<(Vec<Field>, u64), String> {
    let mut fields = Vec::new();
    let bytes = put(descr, "", 0, 0, &mut fields)?;
    Ok((fields, bytes))
}

/// Adds the parts of one description at `offset`; gives its size.
fn put(descr: &Literal, suffix: &str, offset: u64, depth: usize, into: &mut Vec<Field>) -> Result<u64, String> {
    match descr {
        Literal::Text(code) => {
            let (what, bytes) = simple(code)?;
            into.push(Field { suffix: suffix.to_owned(), offset, what });
            if into.len() > MOST_FIELDS {
                return Err(format!("an element has more than {MOST_FIELDS} fields"));
            }
            Ok(bytes)
        }
        Literal::Row(rows) if depth < DEEPEST => {
            let mut bytes = 0;
            for row in rows {
                bytes = sum(bytes, field(row, suffix, sum(offset, bytes)?, depth, into)?)?;
            }
            Ok(bytes)
        }
        // `(type, shape)`: NumPy does not write it outside of a field.
        other => Err(format!("{other:?} is no description of a type")),
    }
}

/// One `(name, type)` or `(name, type, shape)`; a name may be a pair of title and name.
fn field(row: &Literal, suffix: &str, offset: u64, depth: usize, into: &mut Vec<Field>) -> Result<u64, String> {
    let wrong = || format!("{row:?} is no field");
    let Literal::Row(parts) = row else { return Err(wrong()) };
    let (name, descr, shape) = match parts.as_slice() {
        [name, descr] => (name, descr, None),
        [name, descr, shape] => (name, descr, Some(shape)),
        _ => return Err(wrong()),
    };
    let name = match name {
        Literal::Text(name) => name,
        Literal::Row(both) => match both.as_slice() {
            [Literal::Text(_), Literal::Text(name)] => name,
            _ => return Err(wrong()),
        },
        _ => return Err(wrong()),
    };
    if name.is_empty() {
        // What NumPy fills up with between aligned fields.
        return match descr {
            Literal::Text(code) => simple(code).map(|(_, bytes)| bytes),
            _ => Err(wrong()),
        };
    }
    let suffix = format!("{suffix}.{}", name.escape_debug());
    if suffix.len() > MOST_SUFFIX_BYTES {
        return Err(format!("a field's name has more than {MOST_SUFFIX_BYTES} bytes"));
    }
    let copies = match shape {
        None => return put(descr, &suffix, offset, depth + 1, into),
        Some(Literal::Number(count)) => *count,
        Some(Literal::Row(sizes)) => sizes.iter().try_fold(1_u64, |count, size| match size {
            Literal::Number(size) => count.checked_mul(*size).ok_or_else(wrong),
            _ => Err(wrong()),
        })?,
        Some(_) => return Err(wrong()),
    };
    let before = into.len();
    let mut bytes = 0;
    for copy in 0..copies {
        bytes = sum(bytes, put(descr, &format!("{suffix}[{copy}]"), sum(offset, bytes)?, depth + 1, into)?)?;
        if into.len() == before {
            // Nothing in it but filling: counting to `copies` could take for ever.
            return bytes.checked_mul(copies).ok_or_else(wrong);
        }
    }
    Ok(bytes)
}

fn sum(one: u64, other: u64) -> Result<u64, String> {
    one.checked_add(other).ok_or_else(|| "an element has more than 2^64 bytes".to_owned())
}

/// Byte order, kind, and size: `<f8`.
fn simple(code: &str) -> Result<(Part, u64), String> {
    let wrong = || format!("'{}' is no type", code.escape_debug());
    let order = code.chars().next().filter(|order| "<>|=".contains(*order)).ok_or_else(wrong)?;
    let mut rest = code.chars();
    let kind = rest.nth(1).ok_or_else(wrong)?;
    let size = rest.as_str();
    let unit = size.split_once('[').and_then(|(_, unit)| unit.strip_suffix(']')).unwrap_or_default();
    let size = size.split('[').next().unwrap_or_default();
    if kind == 'O' {
        return Ok((Part::Other(PICKLED.to_owned()), 8));
    }
    let size: u64 = size.parse().map_err(|_| wrong())?;
    let number = match (kind, size) {
        ('b' | 'u', 1) => Number::U8,
        ('i', 1) => Number::I8,
        ('i', 2) => Number::I16,
        ('u', 2) => Number::U16,
        ('i', 4) => Number::I32,
        ('u', 4) => Number::U32,
        ('i', 8) => Number::I64,
        ('u', 8) => Number::U64,
        ('f', 2) => Number::F16,
        ('f', 4) => Number::F32,
        ('f', 8) => Number::F64,
        ('c', 8) => return Ok((Part::Complex(Number::F32, order == '>'), size)),
        ('c', 16) => return Ok((Part::Complex(Number::F64, order == '>'), size)),
        ('U', _) => {
            let bytes = size.checked_mul(4).ok_or_else(wrong)?;
            return Ok((Part::Text { bytes, wide: true, big_endian: order == '>' }, bytes));
        }
        ('S' | 'a', _) => return Ok((Part::Text { bytes: size, wide: false, big_endian: false }, size)),
        ('M' | 'm', 8) if seconds(unit).is_some() => {
            return Ok((Part::Times { unit: unit.to_owned(), big_endian: order == '>' }, size));
        }
        _ => return other(kind, size).map(|(what, bytes)| (Part::Other(what), bytes)).ok_or_else(wrong),
    };
    Ok((Part::Number(number, order == '>'), size))
}

fn other(kind: char, size: u64) -> Option<(String, u64)> {
    Some(match kind {
        'f' => (format!("{}-bit floating point numbers", size.saturating_mul(8)), size),
        'c' => (format!("{}-bit complex numbers", size.saturating_mul(8)), size),
        'V' => (format!("{size} bytes without a type"), size),
        'M' => ("dates".to_owned(), size),
        'm' => ("durations".to_owned(), size),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readers::numpy::literal::parse;

    fn fields(text: &str) -> (Vec<(String, u64)>, u64) {
        let (fields, bytes) = of(&parse(text).unwrap()).unwrap();
        (fields.into_iter().map(|field| (field.suffix, field.offset)).collect(), bytes)
    }

    #[test]
    fn fields_lie_one_behind_the_other() {
        let text = "[('a', '<i2'), ('', '|V6'), ('b', [('c', '>f4', (2,)), (('title', 'd'), '|u1')]), ('e', '<U3')]";
        let wanted = [(".a", 0), (".b.c[0]", 8), (".b.c[1]", 12), (".b.d", 16), (".e", 17)];
        let wanted: Vec<_> = wanted.map(|(name, at)| (name.to_owned(), at)).to_vec();
        assert_eq!(fields(text), (wanted, 29));
    }

    #[test]
    fn endless_descriptions_are_refused_quickly() {
        for text in ["[('a', '<i1', 18446744073709551615)]", "[('a', [('b', '<f8', (70000,))], (70000,))]"] {
            assert!(of(&parse(text).unwrap()).is_err(), "{text}");
        }
        assert_eq!(fields("[('a', [('', '|V2')], (4000000000,))]").1, 8_000_000_000);
    }

    #[test]
    fn absurd_sizes_do_not_overflow() {
        assert_eq!(fields("'<f18446744073709551615'").1, u64::MAX);
        assert!(of(&parse("[('a', '|V18446744073709551615'), ('b', '|u1')]").unwrap()).is_err());
    }

    #[test]
    fn types_that_are_none_are_refused() {
        for text in ["'f8'", "'<'", "'<x8'", "'<f'", "'é8'", "3", "[3]", "[('a',)]", "'<U9223372036854775807'"] {
            assert!(of(&parse(text).unwrap()).is_err(), "{text}");
        }
    }
}
