//! A segment's first 28 bytes.

use super::bytes::Bytes;
use crate::FormatError;
use crate::fail;
use crate::number::Order;

/// What every segment begins with.
pub(super) const TAG: &[u8] = b"TDSm";
/// Bytes of a lead-in.
pub(super) const LEAD_IN: u64 = 28;

const META_DATA: u32 = 1 << 1;
const NEW_OBJECT_LIST: u32 = 1 << 2;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
/// LabVIEW leaves this length where a program ended before it closed the file.
const NEVER_CLOSED: u64 = u64::MAX;

/// A segment's place and contents.
#[derive(Debug, Clone, Copy)]
pub(super) struct LeadIn {
    pub(super) version: u32,
    pub(super) order: Order,
    pub(super) has_metadata: bool,
    pub(super) has_raw_data: bool,
    pub(super) new_object_list: bool,
    pub(super) interleaved: bool,
    /// Byte of the lead-in.
    pub(super) at: u64,
    /// Byte of the raw data, behind the metadata; may lie beyond the file's end.
    pub(super) data_at: u64,
    /// Byte behind the segment, at most the file's end.
    pub(super) end: u64,
    /// Whether the segment was to be longer than the file.
    pub(super) cut_off: bool,
}

impl LeadIn {
    /// Reads the lead-in at byte `at` of a file of `file_bytes`.
    pub(super) fn read(lead: &[u8; LEAD_IN as usize], at: u64, file_bytes: u64) -> Result<Self, FormatError> {
        if !lead.starts_with(TAG) {
            let found = lead.get(..4).unwrap_or_default().escape_ascii();
            let help = match lead.starts_with(b"TDSh") {
                true => "this is a .tdms_index file: name the .tdms file beside it",
                false => fail::COPY_AGAIN,
            };
            return Err(fail::at(at, format!("a segment begins with «{found}», «TDSm» was wanted"), help));
        }
        // The flags are little-endian in any file: they are where the byte order is said.
        let flags = Bytes::new(lead.get(4..8).unwrap_or_default(), at + 4, Order::Little).u32("the flags")?;
        let order = if flags & BIG_ENDIAN == 0 { Order::Little } else { Order::Big };
        let mut bytes = Bytes::new(lead.get(8..).unwrap_or_default(), at + 8, order);
        let version = bytes.u32("the version")?;
        let (segment, metadata) = (bytes.u64("the segment's length")?, bytes.u64("the metadata's length")?);
        if !matches!(version, 4712 | 4713) {
            let problem = format!("the segment's version is {version}, 4712 (1.0) or 4713 (2.0) was wanted");
            return Err(fail::at(at + 8, problem, fail::COPY_AGAIN));
        }
        if metadata > segment {
            let problem = format!("the segment's metadata have {metadata} bytes, the whole segment {segment}");
            return Err(fail::at(at + 12, problem, fail::COPY_AGAIN));
        }
        let body = at + LEAD_IN;
        let wanted_end = body.saturating_add(segment);
        Ok(Self {
            version,
            order,
            has_metadata: flags & META_DATA != 0,
            has_raw_data: flags & RAW_DATA != 0,
            new_object_list: flags & NEW_OBJECT_LIST != 0,
            interleaved: flags & INTERLEAVED != 0,
            at,
            data_at: body.saturating_add(metadata),
            end: wanted_end.min(file_bytes),
            cut_off: segment == NEVER_CLOSED || wanted_end > file_bytes,
        })
    }
}
