//! What the end of a file says of its columns.
//!
//! Source: Apache Parquet, "parquet.thrift" and "Logical types" (<https://parquet.apache.org/docs/file-format>).

use super::compact::Value;
use crate::columnar::arrow_schema::names_unit;
use crate::columnar::{Codec, DEEPEST, MOST_COLUMNS, MOST_PATH_BYTES, What};
use crate::number::Number;
use crate::opened::Opened;
use crate::{FormatError, fail};

pub(super) const MAGIC: &[u8] = b"PAR1";

/// The length of the description and the mark, at the end.
const TAIL_BYTES: u64 = 8;

/// A description of a thousand columns in five hundred row groups has about as many.
const MOST_FOOTER_BYTES: u64 = 64 << 20;

/// A column of the schema.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    /// Names of the groups that it is in, and its own.
    pub(super) path: Vec<String>,
    /// Type and meaning of its numbers. Error: what it holds instead.
    pub(super) kind: Result<(Number, What), String>,
    /// In how many ways a value may be missing.
    pub(super) optional: u32,
    /// Whether a row may have several values.
    pub(super) repeated: bool,
}

/// Part of a column: that of one row group.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chunk {
    pub(super) rows: u64,
    /// First byte and length of its pages.
    pub(super) at: u64,
    pub(super) bytes: u64,
    /// Error: what it is packed with.
    pub(super) codec: Result<Codec, &'static str>,
    /// Unit, if the column's metadata state one.
    pub(super) unit: Option<String>,
}

/// A file's description.
#[derive(Debug)]
pub(super) struct Footer {
    pub(super) columns: Vec<Column>,
    /// Chunks of each column, row group by row group.
    pub(super) chunks: Vec<Vec<Chunk>>,
    /// Names and texts that belong to the whole file.
    pub(super) texts: Vec<(String, String)>,
}

impl Footer {
    /// Errors: no Parquet file, cut off, damaged.
    pub(super) fn read(file: &Opened) -> Result<Self, FormatError> {
        let end = file.bytes();
        let tail_at = end.saturating_sub(TAIL_BYTES);
        let tail = file.read("the end of the description", tail_at, TAIL_BYTES.min(end))?;
        let &[a, b, c, d, ref mark @ ..] = tail.as_slice() else { return Err(damaged(end, "the file is too short")) };
        if mark != MAGIC {
            return Err(damaged(tail_at, "the file does not end with PAR1"));
        }
        let bytes = u64::from(u32::from_le_bytes([a, b, c, d]));
        let at = tail_at.checked_sub(bytes).filter(|_| bytes <= MOST_FOOTER_BYTES);
        let at = at.ok_or_else(|| damaged(tail_at, "its description is longer than the file"))?;
        let text = file.read("the description", at, bytes)?;
        let (whole, _) = Value::read(&text).ok_or_else(|| damaged(at, "its description is incomplete"))?;
        Self::of(&whole, at).map_err(|problem| damaged(at, &problem))
    }

    /// From the description; the pages end before byte `end`.
    fn of(whole: &Value, end: u64) -> Result<Self, String> {
        let mut columns = Vec::new();
        let mut elements = whole.list(2).iter();
        let root = elements.next().ok_or("there is no schema")?;
        let children = root.count(5).unwrap_or(0);
        leaves(&mut elements, children, &Branch::default(), &mut columns)?;
        let rows = whole.count(3).ok_or("the number of rows is missing")?;
        let mut chunks = vec![Vec::new(); columns.len()];
        let mut in_groups = 0_u64;
        for group in whole.list(4) {
            let rows = group.count(3).ok_or("a row group has no number of rows")?;
            in_groups = in_groups.saturating_add(rows);
            if group.list(1).len() != columns.len() {
                return Err(format!("a row group has {} columns of {}", group.list(1).len(), columns.len()));
            }
            for (chunk, chunks) in group.list(1).iter().zip(&mut chunks) {
                chunks.push(chunk_of(chunk, rows, end)?);
            }
        }
        if in_groups != rows {
            return Err(format!("the row groups have {in_groups} rows of {rows}"));
        }
        let texts = whole.list(5).iter().filter_map(|pair| Some((pair.text(1)?, pair.text(2)?))).collect();
        Ok(Self { columns, chunks, texts })
    }
}

fn damaged(at: u64, problem: &str) -> FormatError {
    fail::at(at, format!("no readable Parquet file: {problem}"), fail::COPY_AGAIN)
}

fn chunk_of(chunk: &Value, rows: u64, end: u64) -> Result<Chunk, String> {
    if chunk.text(1).is_some() {
        return Err("a column lies in another file".to_owned());
    }
    let about = chunk.field(3).ok_or("a column is encrypted, or has no description")?;
    let data = about.count(9).ok_or("a column does not say where its pages are")?;
    let bytes = about.count(7).ok_or("a column does not say how long its pages are")?;
    let at = about.count(11).filter(|&at| at > 0).map_or(data, |dictionary| dictionary.min(data));
    if at.checked_add(bytes).is_none_or(|last| last > end) {
        return Err(format!("a column has {bytes} bytes from byte {at}, its pages end before byte {end}"));
    }
    let texts = || about.list(8).iter().filter_map(|pair| Some((pair.text(1)?, pair.text(2)?)));
    let unit = texts().find(|(name, _)| names_unit(name)).map(|(_, unit)| unit);
    Ok(Chunk { rows, at, bytes, codec: codec_of(about.number(4).unwrap_or(-1)), unit })
}

/// The groups that a column is in.
#[derive(Debug, Clone, Default)]
struct Branch {
    path: Vec<String>,
    optional: u32,
    repeated: bool,
}

/// Adds the columns among the next `count` elements and what they hold.
fn leaves<'a>(
    elements: &mut impl Iterator<Item = &'a Value<'a>>,
    count: u64,
    branch: &Branch,
    into: &mut Vec<Column>,
) -> Result<(), String> {
    if branch.path.len() > DEEPEST {
        return Err(format!("its columns are more than {DEEPEST} groups deep"));
    }
    for _ in 0..count {
        let element = elements.next().ok_or("its schema is incomplete")?;
        let mut here = branch.clone();
        here.path.push(element.text(4).ok_or("a column has no name")?);
        if here.path.iter().map(String::len).sum::<usize>() > MOST_PATH_BYTES {
            return Err(format!("the name of a column has more than {MOST_PATH_BYTES} bytes"));
        }
        match element.number(3) {
            Some(1) => here.optional += 1,
            Some(2) => (here.optional, here.repeated) = (here.optional + 1, true),
            _ => {}
        }
        match element.count(5).filter(|&children| children > 0) {
            Some(children) => leaves(elements, children, &here, into)?,
            None => {
                let Branch { path, optional, repeated } = here;
                into.push(Column { path, kind: kind_of(element), optional, repeated });
            }
        }
        if into.len() > MOST_COLUMNS {
            return Err(format!("it has more than {MOST_COLUMNS} columns"));
        }
    }
    Ok(())
}

/// Type and meaning of a column's numbers. Error: what it holds instead.
fn kind_of(element: &Value) -> Result<(Number, What), String> {
    let logical = Logical::of(element);
    let number = match (element.number(1), logical) {
        (Some(0), _) => Number::U8,
        (Some(1), Logical::Unsigned) => Number::U32,
        (Some(1), _) => Number::I32,
        (Some(2), Logical::Unsigned) => Number::U64,
        (Some(2), _) => Number::I64,
        (Some(4), _) => Number::F32,
        (Some(5), _) => Number::F64,
        (Some(7), Logical::Half) if element.number(2) == Some(2) => Number::F16,
        (Some(3), _) => return Err("moments of 96 bits".to_owned()),
        (_, Logical::Decimal(_)) => return Err("decimal fractions of many digits".to_owned()),
        (Some(6 | 7), _) => return Err("texts or bytes".to_owned()),
        (kind, _) => return Err(format!("values of the unknown type {kind:?}")),
    };
    let what = match logical {
        Logical::Decimal(scale) => What::decimals(scale),
        Logical::Date => return Err("dates".to_owned()),
        Logical::Time(per_second) => What::TimeOfDay(1.0 / per_second as f64),
        Logical::Moments { per_second, utc } if number == Number::I64 => What::Moments { per_second, utc },
        _ => What::Plain,
    };
    Ok((number, what))
}

/// What is said of the stored numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Logical {
    Nothing,
    Unsigned,
    Half,
    Date,
    Decimal(i32),
    Time(i64),
    Moments { per_second: i64, utc: bool },
}

impl Logical {
    fn of(element: &Value) -> Self {
        element.field(10).and_then(Self::modern).unwrap_or_else(|| Self::converted(element))
    }

    /// The description since 2018: one field says which.
    fn modern(logical: &Value) -> Option<Self> {
        let Value::Struct(fields) = logical else { return None };
        let (which, about) = fields.first()?;
        let per_second = |unit: Option<&Value>| match unit {
            Some(Value::Struct(fields)) => match fields.first()?.0 {
                1 => Some(1000),
                2 => Some(1_000_000),
                3 => Some(1_000_000_000),
                _ => None,
            },
            _ => None,
        };
        Some(match which {
            5 => Self::Decimal(places(about.number(1))),
            6 => Self::Date,
            7 => Self::Time(per_second(about.field(2))?),
            8 => Self::Moments { per_second: per_second(about.field(2))?, utc: about.truth(1).unwrap_or(false) },
            10 if about.truth(2) == Some(false) => Self::Unsigned,
            15 => Self::Half,
            _ => return None,
        })
    }

    /// The description before.
    fn converted(element: &Value) -> Self {
        match element.number(6) {
            Some(5) => Self::Decimal(places(element.number(7))),
            Some(6) => Self::Date,
            Some(7) => Self::Time(1000),
            Some(8) => Self::Time(1_000_000),
            Some(9) => Self::Moments { per_second: 1000, utc: true },
            Some(10) => Self::Moments { per_second: 1_000_000, utc: true },
            Some(11..=14) => Self::Unsigned,
            _ => Self::Nothing,
        }
    }
}

/// Places of a decimal fraction.
fn places(places: Option<i64>) -> i32 {
    places.and_then(|places| i32::try_from(places).ok()).unwrap_or(0).max(0)
}

/// How a column is packed, by its number in a file. Error: the name of one that is not unpacked.
fn codec_of(number: i64) -> Result<Codec, &'static str> {
    Err(match number {
        0 => return Ok(Codec::Plain),
        1 => return Ok(Codec::Snappy),
        2 => return Ok(Codec::Gzip),
        4 => return Ok(Codec::Brotli),
        6 => return Ok(Codec::Zstandard),
        7 => return Ok(Codec::Lz4),
        3 => "LZO",
        5 => "LZ4 in Hadoop's frames",
        _ => "an unknown codec",
    })
}
