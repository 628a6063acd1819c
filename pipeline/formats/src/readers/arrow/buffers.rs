//! The numbers of a column.

use super::batch::{Part, Span};
use crate::columnar::{Groups, Values, bits, truths};
use crate::pinned::{Pinned, read_at};
use crate::{FormatError, fail};
use std::fs::File;

/// Bytes of the length that stands before a packed buffer.
const LENGTH_BYTES: u64 = 8;

/// By how many bytes a buffer may be longer than twice its numbers: some programs fill up, some save what they had set
/// aside. More would let a small file be unpacked for long.
const MOST_FILLING_BYTES: u64 = 1024;

/// Where the numbers of a column are.
#[derive(Debug)]
pub(super) struct Buffers {
    pub(super) file: Pinned,
    pub(super) location: String,
    /// Bytes of each number that count, and bits that it has.
    pub(super) number_bytes: usize,
    pub(super) bits: usize,
    pub(super) parts: Vec<Part>,
}

impl Groups for Buffers {
    fn values(&self, group: usize) -> Result<Values, FormatError> {
        let rows = self.parts.get(group).map_or(0, |part| part.rows);
        self.rows(group, 0, rows as usize)
    }

    fn stretch(&self, group: usize, from: usize, to: usize) -> Option<Result<Values, FormatError>> {
        let is_plain = self.parts.get(group).is_some_and(|part| part.codec.is_none());
        is_plain.then(|| self.rows(group, from, to))
    }

    fn is_direct(&self) -> bool {
        self.parts.iter().all(|part| part.codec.is_none())
    }
}

impl Buffers {
    /// Values of the rows from `from` to before `to`.
    fn rows(&self, group: usize, from: usize, to: usize) -> Result<Values, FormatError> {
        let wrong = |at, problem: String| fail::at(at, format!("{}: {problem}", self.location), fail::COPY_AGAIN);
        let part = self.parts.get(group).ok_or_else(|| wrong(0, "a record batch is missing".to_owned()))?;
        let file = self.file.reopen()?;
        let read = |span: &Span, bits: usize| -> Result<(Vec<u8>, usize), FormatError> {
            let first = from * bits / 8;
            let bytes = Buffer { file: &file, part, span, bits }.bytes(first, (to * bits).div_ceil(8))?;
            bytes.map(|bytes| (bytes, from * bits % 8)).map_err(|problem| wrong(span.at, problem))
        };
        let mut there = vec![true; to - from];
        for span in &part.there {
            let (bytes, first) = read(span, 1)?;
            for (row, there) in there.iter_mut().enumerate() {
                *there &= bits(&bytes, first + row, 1) == Some(1);
            }
        }
        let (mut bytes, first) = read(&part.data, self.bits)?;
        if self.bits == 1 {
            bytes = truths(&bytes, first, to - from).unwrap_or_default();
        }
        let stored_bytes = if self.bits == 1 { 1 } else { self.bits / 8 };
        if stored_bytes > self.number_bytes || there.contains(&false) {
            let rows = bytes.chunks(stored_bytes).zip(&there).filter(|(_, there)| **there);
            bytes = rows.flat_map(|(number, _)| number.iter().take(self.number_bytes)).copied().collect();
        }
        Ok(Values { bytes, there })
    }
}

/// A buffer of numbers of so many bits.
#[derive(Debug)]
struct Buffer<'a> {
    file: &'a File,
    part: &'a Part,
    span: &'a Span,
    bits: usize,
}

impl Buffer<'_> {
    /// The bytes from `from` to before `to`. The inner error: what is wrong with them.
    fn bytes(&self, from: usize, to: usize) -> Result<Result<Vec<u8>, String>, FormatError> {
        let Span { at, bytes } = *self.span;
        let Some(codec) = self.part.codec.filter(|_| bytes > 0) else { return self.plain(at, bytes, from, to) };
        if bytes < LENGTH_BYTES {
            return Ok(Err(format!("a packed buffer has {bytes} bytes")));
        }
        let mut length = [0; LENGTH_BYTES as usize];
        read_at(self.file, at, &mut length)?;
        let (packed_at, packed_bytes) = (at + LENGTH_BYTES, bytes - LENGTH_BYTES);
        // what would be longer if it was packed
        let length = i64::from_le_bytes(length);
        if length == -1 {
            return self.plain(packed_at, packed_bytes, from, to);
        }
        let wanted = self.part.rows.saturating_mul(self.bits as u64).div_ceil(8);
        let most = wanted.saturating_mul(2).saturating_add(MOST_FILLING_BYTES);
        let Some(length) = u64::try_from(length).ok().filter(|length| (wanted..=most).contains(length)) else {
            return Ok(Err(format!("a packed buffer comes to {length} bytes, wanted {wanted}")));
        };
        // no program packs so that the bytes become much more
        if packed_bytes > length.saturating_mul(2).saturating_add(MOST_FILLING_BYTES) {
            return Ok(Err(format!("{packed_bytes} packed bytes come to {length}")));
        }
        let mut packed = vec![0; packed_bytes as usize];
        read_at(self.file, packed_at, &mut packed)?;
        let whole = codec.unpack(&packed, length as usize);
        let bytes = whole.and_then(|whole| whole.get(from..to).map(<[u8]>::to_vec));
        Ok(bytes.ok_or_else(|| format!("a buffer cannot be unpacked to {length} bytes")))
    }

    fn plain(&self, at: u64, bytes: u64, from: usize, to: usize) -> Result<Result<Vec<u8>, String>, FormatError> {
        if to as u64 > bytes {
            return Ok(Err(format!("a buffer has {bytes} bytes, wanted {to} for {} rows", self.part.rows)));
        }
        let mut found = vec![0; to - from];
        read_at(self.file, at + from as u64, &mut found)?;
        Ok(Ok(found))
    }
}
