//! Raw data as DAQmx writes it: rows of bytes, one buffer per device, of which each channel's scalers take their part.

use super::bytes::Bytes;
use super::kind::Kind;
use crate::FormatError;
use crate::fail;

/// Index header of a format changing scaler.
pub(super) const FORMAT_CHANGING: u32 = 0x1269;
/// Index header of a digital line scaler: the second is the one NI's article gives, the first the one files have.
pub(super) const DIGITAL_LINE: [u32; 2] = [0x126A, 0x1369];

/// Where a channel's values lie in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scaler {
    /// The number `NI_Scale` properties call it by.
    pub(super) id: u32,
    pub(super) kind: Kind,
    pub(super) buffer: usize,
    /// Byte in the row.
    pub(super) offset: u32,
    /// Bit of the value, for a digital line.
    pub(super) bit: Option<u8>,
}

/// A channel's raw data index.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Daqmx {
    pub(super) scalers: Vec<Scaler>,
    /// Bytes of a row, one number per buffer.
    pub(super) row_widths: Vec<u32>,
}

/// Reads what follows the count of values.
pub(super) fn read(bytes: &mut Bytes, digital: bool) -> Result<Daqmx, FormatError> {
    let count = bytes.u32("the number of scalers")?;
    // No capacity from the count: it may lie, and each scaler takes bytes that have to be there.
    let mut scalers = Vec::new();
    let mut places = Vec::new();
    for _ in 0..count {
        places.push(bytes.at());
        scalers.push(if digital { digital_line(bytes)? } else { format_changing(bytes)? });
    }
    let count = bytes.u32("the number of raw buffers")?;
    let mut row_widths = Vec::new();
    for _ in 0..count {
        row_widths.push(bytes.u32("a raw buffer's width")?);
    }
    for (scaler, &at) in scalers.iter().zip(&places) {
        let end = u64::from(scaler.offset) + u64::from(scaler.kind.width().unwrap_or(0));
        match row_widths.get(scaler.buffer) {
            Some(&width) if end <= u64::from(width) => {}
            Some(width) => {
                let problem = format!("a scaler's value ends at byte {end} of its row, the row has {width} bytes");
                return Err(fail::at(at, problem, fail::COPY_AGAIN));
            }
            None => {
                let problem = format!("a scaler reads raw buffer {}, there are {}", scaler.buffer, row_widths.len());
                return Err(fail::at(at, problem, fail::COPY_AGAIN));
            }
        }
    }
    if scalers.is_empty() {
        return Err(fail::at(bytes.at(), "a DAQmx channel has no scaler, one or more were wanted", fail::COPY_AGAIN));
    }
    Ok(Daqmx { scalers, row_widths })
}

fn format_changing(bytes: &mut Bytes) -> Result<Scaler, FormatError> {
    let kind = kind(bytes)?;
    let buffer = bytes.u32("a scaler's raw buffer")? as usize;
    let offset = bytes.u32("a scaler's byte offset")?;
    bytes.u32("a scaler's sample format")?;
    Ok(Scaler { id: bytes.u32("a scaler's number")?, kind, buffer, offset, bit: None })
}

fn digital_line(bytes: &mut Bytes) -> Result<Scaler, FormatError> {
    let at = bytes.at();
    let kind = kind(bytes)?;
    if matches!(kind, Kind::Float32 | Kind::Float64 | Kind::Stamp) {
        let problem = format!("a digital line is of type {}, whole numbers were wanted", kind.name());
        return Err(fail::at(at, problem, fail::COPY_AGAIN));
    }
    let buffer = bytes.u32("a scaler's raw buffer")? as usize;
    let bit_offset = bytes.u32("a scaler's bit offset")?;
    bytes.u8("a scaler's sample format")?;
    let bit = Some((bit_offset % 8) as u8);
    Ok(Scaler { id: bytes.u32("a scaler's number")?, kind, buffer, offset: bit_offset / 8, bit })
}

fn kind(bytes: &mut Bytes) -> Result<Kind, FormatError> {
    let at = bytes.at();
    let code = bytes.u32("a scaler's type")?;
    Kind::of_daqmx_code(code)
        .ok_or_else(|| fail::at(at, format!("a scaler's type is {code}, 0 to 9 was wanted"), fail::COPY_AGAIN))
}
