//! Raw data index: how an object's values lie in each chunk.

use super::bytes::Bytes;
use super::daqmx::{self, DIGITAL_LINE, Daqmx, FORMAT_CHANGING};
use super::kind::Kind;
use crate::FormatError;
use crate::fail;

const NO_RAW_DATA: u32 = u32::MAX;
const SAME_AS_BEFORE: u32 = 0;

/// An object's values in one chunk.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Index {
    pub(super) kind: Kind,
    /// Values per chunk.
    pub(super) values: u64,
    /// Bytes per chunk (0 for DAQmx data, which share their bytes).
    pub(super) bytes: u64,
    pub(super) daqmx: Option<Daqmx>,
}

/// What a segment says about an object's raw data.
#[derive(Debug)]
pub(super) enum Stated {
    Nothing,
    AsBefore,
    New(Index),
}

/// Reads an index.
pub(super) fn read(bytes: &mut Bytes) -> Result<Stated, FormatError> {
    let at = bytes.at();
    let header = bytes.u32("a raw data index")?;
    match header {
        NO_RAW_DATA => return Ok(Stated::Nothing),
        SAME_AS_BEFORE => return Ok(Stated::AsBefore),
        // The index's length is 20, with the size of text 28; others are no index.
        FORMAT_CHANGING | 20 | 28 => {}
        header if DIGITAL_LINE.contains(&header) => {}
        _ => {
            let problem = format!("a raw data index begins with 0x{header:08X}, 20, 28 or a DAQmx scaler was wanted");
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
    }
    let code = bytes.u32("a type")?;
    let kind = Kind::of_code(code).ok_or_else(|| {
        fail::at(at + 4, format!("raw data are of type 0x{code:08X}, which TDMS does not have"), fail::COPY_AGAIN)
    })?;
    let dimension = bytes.u32("a dimension")?;
    if dimension != 1 {
        let problem = format!("raw data have {dimension} dimensions, TDMS 2.0 has only 1");
        return Err(fail::at(at + 8, problem, fail::COPY_AGAIN));
    }
    let values = bytes.u64("a number of values")?;
    let daqmx = match header {
        FORMAT_CHANGING => Some(daqmx::read(bytes, false)?),
        header if DIGITAL_LINE.contains(&header) => Some(daqmx::read(bytes, true)?),
        _ => None,
    };
    let size = match (&daqmx, kind) {
        (Some(_), _) => 0,
        (None, Kind::Text) => bytes.u64("the size of text")?,
        (None, kind) => size(kind, values, at)?,
    };
    Ok(Stated::New(Index { kind, values, bytes: size, daqmx }))
}

fn size(kind: Kind, values: u64, at: u64) -> Result<u64, FormatError> {
    let Some(width) = kind.width() else {
        let problem = format!("raw data are of type {}, whose size in a file is not defined", kind.name());
        return Err(fail::at(at + 4, problem, "save the channel as float64 and the file again"));
    };
    values.checked_mul(u64::from(width)).ok_or_else(|| {
        fail::at(at + 12, format!("{values} values of {width} bytes: no file holds that"), fail::COPY_AGAIN)
    })
}
