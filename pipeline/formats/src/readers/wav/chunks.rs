//! The chunks of a WAV file.

use crate::fields::Fields;
use crate::number::Order;
use crate::opened::Opened;
use crate::{FormatError, fail};

/// More chunks are no recording: headers, cues and notes come to some ten.
const MOST_CHUNKS: usize = 1 << 12;

/// A size that says that it was not known when the header was written.
const UNKNOWN: u64 = 0xFFFF_FFFF;

/// Bytes of `fmt ` that are looked at: all that the extensible form has.
const FORMAT_BYTES: u64 = 40;

/// What the chunks say.
#[derive(Debug)]
pub(super) struct Chunks {
    /// `RIFF`, `RIFX`, `RF64` or `BW64`.
    pub(super) kind: &'static str,
    pub(super) big_endian: bool,
    /// The chunk `fmt ` and its byte.
    pub(super) format: Vec<u8>,
    pub(super) format_from: u64,
    pub(super) data_from: u64,
    /// Bytes of samples that are there.
    pub(super) data_bytes: u64,
}

/// The kind of a file that begins with these bytes; none if it is no WAV file.
pub(super) fn kind_of(head: &[u8]) -> Option<&'static str> {
    let mark = head.get(..4)?;
    let kind = ["RIFF", "RIFX", "RF64", "BW64"].into_iter().find(|kind| kind.as_bytes() == mark)?;
    (head.get(8..12)? == b"WAVE").then_some(kind)
}

impl Chunks {
    /// Reads the headers of all chunks up to the samples. Errors: no WAV file; no description or no samples in it.
    pub(super) fn read(file: &Opened, remarks: &mut Vec<String>) -> Result<Self, FormatError> {
        let head = file.head(12)?;
        let Some(kind) = kind_of(&head) else {
            return Err(fail::at(0, "found no RIFF header of the form WAVE, wanted a WAV file", fail::COPY_AGAIN));
        };
        let order = if kind == "RIFX" { Order::Big } else { Order::Little };
        let (mut at, mut format, mut long_bytes) = (12_u64, None, None);
        for _ in 0..MOST_CHUNKS {
            if at.saturating_add(8) > file.bytes() {
                break;
            }
            let header = file.read("the header of a chunk", at, 8)?;
            let size = u64::from(Fields { bytes: &header, order }.u32(4));
            let from = at + 8;
            match header.get(..4) {
                Some(b"ds64") => {
                    let sizes = file.read("the chunk ds64", from, size.min(28))?;
                    long_bytes = Some(Fields { bytes: &sizes, order }.u64(8));
                }
                Some(b"fmt ") => format = Some((from, file.read("the chunk fmt", from, size.min(FORMAT_BYTES))?)),
                Some(b"data") => {
                    let Some((format_from, format)) = format else {
                        let problem = "found the chunk data without a chunk fmt before it, which describes the samples";
                        return Err(fail::at(at, problem, fail::COPY_AGAIN));
                    };
                    let stated = long_bytes.filter(|_| size == UNKNOWN).unwrap_or(size);
                    let whole = u64::from(Fields { bytes: &head, order }.u32(4));
                    // A recorder that was cut off left the sizes of an empty file, or none.
                    let unknown = stated == UNKNOWN || (stated == 0 && (whole == UNKNOWN || whole <= from - 8));
                    let data_bytes = there((!unknown).then_some(stated), from, file.bytes(), remarks);
                    let big_endian = order == Order::Big;
                    return Ok(Self { kind, big_endian, format, format_from, data_from: from, data_bytes });
                }
                _ => {}
            }
            // chunks begin at even bytes
            at = from.saturating_add(size).saturating_add(size % 2);
        }
        Err(fail::at(at.min(file.bytes()), "found no chunk data, wanted the samples", fail::COPY_AGAIN))
    }
}

/// Bytes of samples that are there, of those that are stated.
fn there(stated: Option<u64>, from: u64, file_bytes: u64, remarks: &mut Vec<String>) -> u64 {
    let rest = file_bytes.saturating_sub(from);
    let Some(stated) = stated else {
        remarks.push("the header does not say how many samples there are: read up to the end of the file".to_owned());
        return rest;
    };
    if stated > rest {
        remarks.push(format!("the file is cut off: its header says {stated} bytes of samples, there are {rest}"));
    }
    stated.min(rest)
}
