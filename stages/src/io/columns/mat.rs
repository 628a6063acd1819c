//! Columns from MATLAB files of version 5 to 7.

use std::io::Read;

use afmid_pipeline::recording::most_inflated;
use flate2::read::ZlibDecoder;

use super::table::{ColumnError, ColumnTable, NamedColumn};

const HEADER: usize = 128;
const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;
/// Reads all real two-dimensional matrices: a vector is one column of the variable's name, a matrix `x` of k columns is
/// `x:1` to `x:k`.
///
/// # Method
/// Data elements one after the other, compressed ones unpacked; either byte order; all numeric classes become `f64`
/// (64-bit integers beyond 2^53 are rounded). Structs, cells, texts, sparse and complex matrices are named, not read.
/// # Shapes
/// A row vector counts as a column. Columns of different variables may differ in length.
/// # Errors
/// Version 4 or 7.3; a file that is cut short or contradicts itself; unpacked variables of more than 64 MiB and 32
/// times the file, or numbers of half of that; no matrix at all.
/// # Source
/// MathWorks, MAT-File Format, chapter 1 (Level 5 MAT-file format).
pub fn read_mat(bytes: &[u8]) -> Result<ColumnTable, ColumnError> {
    // a version 7.3 file has a MATLAB header of 512 bytes before HDF5's own
    let hdf5 = |at: usize| bytes.get(at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n"));
    if hdf5(0) || hdf5(512) {
        return Err(ColumnError::Hdf5);
    }
    let big = match bytes.get(126..HEADER) {
        Some(b"MI") => true,
        Some(b"IM") => false,
        _ => return Err(ColumnError::NotMat5),
    };
    let mut table = ColumnTable::default();
    let mut elements = Elements { bytes, at: HEADER, big };
    let most = most_inflated(bytes.len() as u64);
    // the numbers are kept some five times until they are stored
    let (mut packed_left, mut values_left) = (most, most / 2);
    while let Some(element) = elements.next()? {
        match element.kind {
            COMPRESSED => {
                let unpacked = inflate(&element, packed_left)?;
                packed_left -= unpacked.len() as u64;
                if let Some(inner) = (Elements { bytes: &unpacked, at: 0, big }).next()? {
                    read_element(&inner, big, &mut values_left, &mut table)?;
                }
            }
            _ => read_element(&element, big, &mut values_left, &mut table)?,
        }
    }
    if table.columns.is_empty() {
        let others = if table.others.is_empty() { "nothing".to_owned() } else { table.others.join(", ") };
        return Err(ColumnError::NoMatrix(others));
    }
    Ok(table)
}

/// Errors: damaged; more than `most` bytes.
fn inflate(element: &Element<'_>, most: u64) -> Result<Vec<u8>, ColumnError> {
    let mut unpacked = Vec::new();
    match ZlibDecoder::new(element.data).take(most + 1).read_to_end(&mut unpacked) {
        Ok(count) if count as u64 <= most => Ok(unpacked),
        Ok(_) => Err(ColumnError::Damaged { at: element.at, what: TOO_LARGE }),
        Err(_) => Err(ColumnError::Damaged { at: element.at, what: "a compressed variable cannot be unpacked" }),
    }
}

const TOO_LARGE: &str = "variables unpack to far more than the file has; wanted at most 64 MiB or 32 times the file (half of that in numbers)";

/// A data element: its type, where it stands, its bytes.
struct Element<'a> {
    kind: u32,
    at: usize,
    data: &'a [u8],
}

/// Elements one after the other.
struct Elements<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Option<u32> {
        let word: [u8; 4] = self.bytes.get(at..at + 4)?.try_into().ok()?;
        Some(if self.big { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    /// The next one; `None` at the end.
    fn next(&mut self) -> Result<Option<Element<'a>>, ColumnError> {
        let at = self.at;
        if at >= self.bytes.len() {
            return Ok(None);
        }
        let cut = ColumnError::Damaged { at, what: "the file ends within a variable" };
        let Some(tag) = self.word(at) else { return Err(cut) };
        // the short form: both words in one, at most four bytes of data
        let (kind, start, size) = match (tag >> 16) as usize {
            0 => (tag, at + 8, self.word(at + 4).ok_or(cut.clone())? as usize),
            short if short <= 4 => (tag & 0xffff, at + 4, short),
            _ => return Err(ColumnError::Damaged { at, what: "a tag that is none" }),
        };
        let data = start.checked_add(size).and_then(|end| self.bytes.get(start..end)).ok_or(cut)?;
        let padded = if start == at + 4 { at + 8 } else { start + size.next_multiple_of(8) };
        // compressed elements are not padded
        self.at = if kind == COMPRESSED { start + size } else { padded };
        Ok(Some(Element { kind, at, data }))
    }
}

fn read_element(
    element: &Element<'_>,
    big: bool,
    values_left: &mut u64,
    table: &mut ColumnTable,
) -> Result<(), ColumnError> {
    if element.kind != MATRIX {
        return Ok(());
    }
    let damaged = |what| ColumnError::Damaged { at: element.at, what };
    let mut parts = Elements { bytes: element.data, at: 0, big };
    let mut part = |what| parts.next()?.ok_or(damaged(what));
    let flags = numbers(&part("a variable without flags")?, big).ok_or(damaged("flags that are no numbers"))?;
    let sizes = numbers(&part("a variable without dimensions")?, big).ok_or(damaged("dimensions of another type"))?;
    let name = String::from_utf8_lossy(part("a variable without a name")?.data).into_owned();
    let flags = flags.first().copied().unwrap_or(0.0) as u32;
    let (class, complex) = (flags & 0xff, flags & 0x800 != 0);
    let what = match class {
        1 => "cell",
        2 => "struct",
        3 => "object",
        4 => "text",
        5 => "sparse matrix",
        6..=15 if complex => "complex matrix",
        6..=15 if sizes.len() != 2 => "array of more than two dimensions",
        6..=15 => "",
        _ => "variable of unknown class",
    };
    if !what.is_empty() {
        table.others.push(format!("{name} ({what})"));
        return Ok(());
    }
    let real = part("a matrix without values")?;
    // one number takes a byte at least
    let bytes = 8.0 * sizes.iter().product::<f64>().min(real.data.len() as f64);
    *values_left = values_left.checked_sub(bytes as u64).ok_or(damaged(TOO_LARGE))?;
    let values = numbers(&real, big).ok_or(damaged("values of an unknown type"))?;
    let (rows, columns) = (sizes[0] as usize, sizes[1] as usize);
    if rows.checked_mul(columns) != Some(values.len()) {
        return Err(damaged("a matrix with more or fewer values than its dimensions"));
    }
    let column = |name: String, values: Vec<f64>| NamedColumn { name, values, text: None };
    if rows == 1 || columns == 1 {
        table.columns.push(column(name, values));
    } else if rows > 0 {
        let all =
            values.chunks(rows).enumerate().map(|(i, values)| column(format!("{name}:{}", i + 1), values.to_vec()));
        table.columns.extend(all);
    }
    Ok(())
}

/// The numbers in an element; `None` for a type that holds none, or a size that is no multiple of the type's.
fn numbers(element: &Element<'_>, big: bool) -> Option<Vec<f64>> {
    let data = element.data;
    match element.kind {
        1 => fixed(data, big, |b| f64::from(i8::from_le_bytes(b))),
        2 => fixed(data, big, |b| f64::from(u8::from_le_bytes(b))),
        3 => fixed(data, big, |b| f64::from(i16::from_le_bytes(b))),
        4 => fixed(data, big, |b| f64::from(u16::from_le_bytes(b))),
        5 => fixed(data, big, |b| f64::from(i32::from_le_bytes(b))),
        6 => fixed(data, big, |b| f64::from(u32::from_le_bytes(b))),
        7 => fixed(data, big, |b| f64::from(f32::from_le_bytes(b))),
        9 => fixed(data, big, f64::from_le_bytes),
        12 => fixed(data, big, |b| i64::from_le_bytes(b) as f64),
        13 => fixed(data, big, |b| u64::from_le_bytes(b) as f64),
        _ => None,
    }
}

/// Values of N bytes each, turned round where the file's byte order is big.
fn fixed<const N: usize>(data: &[u8], big: bool, value: fn([u8; N]) -> f64) -> Option<Vec<f64>> {
    let (chunks, rest) = data.as_chunks::<N>();
    let read = |chunk: &[u8; N]| {
        let mut bytes = *chunk;
        if big {
            bytes.reverse();
        }
        value(bytes)
    };
    rest.is_empty().then(|| chunks.iter().map(read).collect())
}
