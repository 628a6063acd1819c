//! Data elements: a type, a size, and that many bytes.

use super::class;
use super::stream::Stream;
use crate::FormatError;
use crate::fail;

/// The beginning of an element.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tag {
    /// Where it begins.
    pub(super) at: u64,
    /// Code of its type.
    pub(super) kind: u32,
    /// Bytes of its data.
    pub(super) bytes: u64,
    /// First byte of its data.
    pub(super) data_at: u64,
    /// First byte behind it, with what fills it up to a multiple of 8.
    pub(super) next_at: u64,
}

/// A stream with its byte order.
pub(super) struct Elements {
    pub(super) stream: Stream,
    pub(super) big_endian: bool,
}

impl Elements {
    pub(super) fn u32(&self, word: [u8; 4]) -> u32 {
        if self.big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) }
    }

    /// Reads a tag; the element must end at `end` at the latest. A last element without its filling is accepted: some
    /// programs leave it out.
    pub(super) fn tag(&mut self, end: u64, what: &str) -> Result<Tag, FormatError> {
        let at = self.stream.position();
        let first = self.stream.array(end, what)?;
        let first = self.u32(first);
        // Up to 4 bytes of data lie in the tag: the size is then in the half where it makes the word exceed 65535.
        if first >> 16 != 0 {
            let (kind, bytes) = (first & 0xffff, u64::from(first >> 16));
            if bytes > 4 {
                let problem =
                    format!("{what}: an element of type {kind} in short form has {bytes} bytes, at most 4 fit");
                return Err(self.stream.error(at, problem, fail::COPY_AGAIN));
            }
            self.reach(at + 8, end, what, bytes)?;
            return Ok(Tag { at, kind, bytes, data_at: at + 4, next_at: at + 8 });
        }
        let bytes = self.stream.array(end, what)?;
        let bytes = u64::from(self.u32(bytes));
        self.reach(at + 8 + bytes, end, what, bytes)?;
        // Compressed elements are not filled up; in arrays their last part is.
        let whole = matches!(first, class::COMPRESSED | class::MATRIX);
        let filled = if whole { bytes } else { bytes.next_multiple_of(8) };
        Ok(Tag { at, kind: first, bytes, data_at: at + 8, next_at: (at + 8 + filled).min(end) })
    }

    /// A tag of a certain type.
    pub(super) fn tag_of(&mut self, kinds: &[u32], end: u64, what: &str) -> Result<Tag, FormatError> {
        let tag = self.tag(end, what)?;
        if kinds.contains(&tag.kind) {
            return Ok(tag);
        }
        let wanted: Vec<String> = kinds.iter().map(u32::to_string).collect();
        let problem = format!("{what} has type {}, type {} was wanted", tag.kind, wanted.join(" or "));
        Err(self.stream.error(tag.at, problem, fail::COPY_AGAIN))
    }

    /// The data of an element, of which there may be at most `most` bytes.
    pub(super) fn data(&mut self, tag: Tag, most: u64, end: u64, what: &str) -> Result<Vec<u8>, FormatError> {
        if tag.bytes > most {
            let problem = format!("{what} has {} bytes, at most {most} were wanted", tag.bytes);
            return Err(self.stream.error(tag.at, problem, fail::COPY_AGAIN));
        }
        let bytes = self.stream.bytes(tag.bytes, end, what)?;
        self.go_on(tag.next_at, end)?;
        Ok(bytes)
    }

    /// Passes over everything up to `next_at`.
    pub(super) fn go_on(&mut self, next_at: u64, end: u64) -> Result<(), FormatError> {
        self.stream.skip(next_at.saturating_sub(self.stream.position()), end)
    }

    fn reach(&self, to: u64, end: u64, what: &str, bytes: u64) -> Result<(), FormatError> {
        if to <= end {
            return Ok(());
        }
        let at = self.stream.position();
        let problem = format!("{what}: an element of {bytes} bytes ends {} bytes behind what it is part of", to - end);
        Err(self.stream.error(at, problem, HELP))
    }
}

const HELP: &str = "the file is damaged or cut off, perhaps by a transfer in text mode, which adds a byte 0d before \
    each 0a: copy it again from where it was recorded";
