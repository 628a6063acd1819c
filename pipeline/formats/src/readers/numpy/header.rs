//! The header of an NPY file: magic, version, length, and a Python dictionary.

use super::dtype::{self, Field, Part};
use super::literal::{self, Literal};
use crate::FormatError;
use crate::fail;

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// Magic, version, and the longest length.
pub(super) const LEAD_BYTES: usize = 12;

/// A description of 65536 fields with their names is about as long.
const MOST_HEADER_BYTES: u64 = 4 << 20;

const DAMAGED: &str = "the file is damaged or was not written by NumPy: save the array again with numpy.save";

/// What the header says.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) version: (u8, u8),
    pub(super) fields: Vec<Field>,
    pub(super) item_bytes: u64,
    pub(super) fortran: bool,
    pub(super) shape: Vec<usize>,
    /// Bytes of the header, that is, the first byte of data.
    pub(super) bytes: u64,
    /// Bytes of data.
    pub(super) data_bytes: u64,
}

/// Version, first byte and size of the dictionary, of a file with `available` bytes. Error: what is wrong.
pub(super) fn lead(head: &[u8], available: u64) -> Result<((u8, u8), u64, u64), FormatError> {
    let wrong = |at, problem: String| fail::at(at, problem, DAMAGED);
    let rest = head.strip_prefix(MAGIC).ok_or_else(|| wrong(0, "no magic \\x93NUMPY where the array begins".into()))?;
    let (version, at, length) = match *rest {
        [1, minor, low, high, ..] => ((1, minor), 10, u64::from(u16::from_le_bytes([low, high]))),
        [major @ (2 | 3), minor, a, b, c, d] | [major @ (2 | 3), minor, a, b, c, d, ..] => {
            ((major, minor), 12, u64::from(u32::from_le_bytes([a, b, c, d])))
        }
        [major, minor, ..] if major == 0 || major > 3 => {
            return Err(wrong(6, format!("NPY version {major}.{minor}, 1.0 to 3.0 were wanted")));
        }
        _ => return Err(wrong(6, "the file ends in the middle of its header".into())),
    };
    if length > available.saturating_sub(at) || length > MOST_HEADER_BYTES {
        return Err(wrong(
            8,
            format!("a header of {length} bytes in {available}, at most {MOST_HEADER_BYTES} are wanted"),
        ));
    }
    Ok((version, at, length))
}

impl Header {
    /// Whether the data are a pickle instead of elements.
    pub(super) fn is_pickled(&self) -> bool {
        self.fields.iter().any(|field| matches!(&field.what, Part::Other(what) if what == dtype::PICKLED))
    }

    /// Reads the dictionary that begins at byte `at`.
    pub(super) fn of(version: (u8, u8), at: u64, dictionary: &[u8]) -> Result<Self, FormatError> {
        let wrong = |at, problem: String| fail::at(at, problem, DAMAGED);
        // Versions 1 and 2 are Latin-1, 3 is UTF-8.
        let text = if version.0 < 3 {
            dictionary.iter().map(|&byte| char::from(byte)).collect()
        } else {
            String::from_utf8_lossy(dictionary).into_owned()
        };
        let found = literal::parse(text.trim_end_matches('\0'))
            .map_err(|stop| wrong(at + stop as u64, "the header is no Python dictionary from here on".into()))?;
        let key = |name| found.get(name).ok_or_else(|| wrong(at, format!("the header has no '{name}'")));
        let (fields, item_bytes) = dtype::of(key("descr")?).map_err(|problem| wrong(at, problem))?;
        let Literal::Truth(fortran) = *key("fortran_order")? else {
            return Err(wrong(at, "fortran_order is neither True nor False".into()));
        };
        let Literal::Row(sizes) = key("shape")? else { return Err(wrong(at, "the shape is no tuple".into())) };
        let size = |size: &Literal| match size {
            Literal::Number(size) => usize::try_from(*size).ok(),
            _ => None,
        };
        let shape: Option<Vec<usize>> = sizes.iter().map(size).collect();
        let shape = shape.ok_or_else(|| wrong(at, format!("the shape {sizes:?} is none of numbers")))?;
        // An empty array stays empty however long its other axes are.
        let data_bytes = if shape.contains(&0) { Some(0) } else { product(&shape, item_bytes) };
        let data_bytes = data_bytes.ok_or_else(|| wrong(at, format!("an array of shape {shape:?} cannot exist")))?;
        Ok(Self { version, fields, item_bytes, fortran, shape, bytes: at + dictionary.len() as u64, data_bytes })
    }
}

fn product(shape: &[usize], item_bytes: u64) -> Option<u64> {
    shape.iter().try_fold(item_bytes, |bytes, &size| bytes.checked_mul(size as u64))
}
