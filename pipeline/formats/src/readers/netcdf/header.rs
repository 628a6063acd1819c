//! The header: dimensions, attributes and variables.

use super::attributes::Attribute;
use super::cursor::{Cursor, Stop};
use super::kind::Kind;
use crate::opened::Opened;
use crate::{FormatError, fail};

/// Bytes that are read first; few headers are longer.
const FIRST_BYTES: u64 = 1 << 16;
/// Longer headers are no recording's.
const MOST_BYTES: u64 = 1 << 24;

const DIMENSIONS: u32 = 10;
const VARIABLES: u32 = 11;
const ATTRIBUTES: u32 = 12;

/// A dimension; a length of 0 is that of the records.
#[derive(Debug)]
pub(super) struct Dimension {
    pub(super) name: String,
    pub(super) length: u64,
}

/// A variable as the header states it.
#[derive(Debug)]
pub(super) struct Variable {
    pub(super) name: String,
    /// Numbers of its dimensions, the slowest first.
    pub(super) dimensions: Vec<usize>,
    pub(super) attributes: Vec<Attribute>,
    pub(super) kind: Kind,
    /// Bytes of it, or of it in each record.
    pub(super) stated_bytes: u64,
    /// Byte of its first element.
    pub(super) begin: u64,
}

/// What the header says.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) version: u8,
    /// Number of records; none if they were not counted.
    pub(super) records: Option<u64>,
    pub(super) dimensions: Vec<Dimension>,
    pub(super) attributes: Vec<Attribute>,
    pub(super) variables: Vec<Variable>,
    /// Byte behind it.
    pub(super) end: u64,
}

impl Header {
    /// Reads it, and no more of the file than it takes. Errors: no header of a known version; damaged or cut off.
    pub(super) fn of(file: &Opened) -> Result<Self, FormatError> {
        let mut wanted = FIRST_BYTES;
        loop {
            let bytes = file.head(wanted)?;
            match Self::read(&bytes) {
                Ok(header) => return Ok(header),
                Err(Stop::Wrong(error)) => return Err(error),
                Err(Stop::Short) if wanted < file.bytes().min(MOST_BYTES) => wanted *= 4,
                Err(Stop::Short) => {
                    let problem =
                        format!("found no end of the header in {} bytes, wanted its last variable", bytes.len());
                    return Err(fail::at(bytes.len() as u64, problem, fail::COPY_AGAIN));
                }
            }
        }
    }

    fn read(bytes: &[u8]) -> Result<Self, Stop> {
        let version = match bytes {
            [b'C', b'D', b'F', version @ (1 | 2 | 5), ..] => *version,
            [b'C', b'D', b'F', version, ..] => {
                let problem = format!("not read: this file is netCDF of version {version}, wanted 1, 2 or 5");
                return Err(Stop::Wrong(fail::at(3, problem, "convert it with nccopy -k classic")));
            }
            _ => {
                let problem = "found no «CDF», wanted a classic netCDF file";
                return Err(Stop::Wrong(fail::at(0, problem, fail::COPY_AGAIN)));
            }
        };
        let mut cursor = Cursor { bytes, at: 4, version };
        let records = cursor.size()?;
        let records = (records != cursor.largest_size()).then_some(records);
        let dimensions = cursor
            .list(DIMENSIONS, "dimensions", |cursor| Ok(Dimension { name: cursor.name()?, length: cursor.size()? }))?;
        if dimensions.iter().filter(|dimension| dimension.length == 0).count() > 1 {
            return cursor.wrong("found two dimensions of records, wanted one");
        }
        let attributes = cursor.list(ATTRIBUTES, "attributes", Attribute::read)?;
        let variables = cursor.list(VARIABLES, "variables", |cursor| variable(cursor, &dimensions))?;
        Ok(Self { version, records, dimensions, attributes, variables, end: cursor.at as u64 })
    }
}

fn variable(cursor: &mut Cursor, all: &[Dimension]) -> Result<Variable, Stop> {
    let name = cursor.name()?;
    let count = cursor.size()?;
    let mut dimensions = Vec::new();
    for place in 0..count {
        let number = cursor.size()?;
        let dimension = usize::try_from(number).ok().and_then(|number| all.get(number));
        let Some(length) = dimension.map(|dimension| dimension.length) else {
            let wanted = all.len();
            return cursor.wrong(format!("{} has the dimension {number} of {wanted}", name.escape_debug()));
        };
        if length == 0 && place > 0 {
            return cursor.wrong(format!("records are not the first dimension of {}", name.escape_debug()));
        }
        dimensions.push(number as usize);
    }
    let attributes = cursor.list(ATTRIBUTES, "attributes", Attribute::read)?;
    let code = cursor.code()?;
    let Some(kind) = Kind::of(code, cursor.version) else {
        let wanted = if cursor.version == 5 { 11 } else { 6 };
        return cursor.wrong(format!("{} is of type {code}, wanted 1 to {wanted}", name.escape_debug()));
    };
    let (stated_bytes, begin) = (cursor.size()?, cursor.offset()?);
    Ok(Variable { name, dimensions, attributes, kind, stated_bytes, begin })
}
