//! Walks through the bytes of a header.

use crate::FormatError;
use crate::fail;
use crate::text::decode;

/// Why a header cannot be read on.
#[derive(Debug)]
pub(super) enum Stop {
    /// It goes on behind the bytes at hand.
    Short,
    Wrong(FormatError),
}

/// A place in a header. Sizes have 32 bits up to CDF-2 and 64 in CDF-5; offsets 32 in CDF-1 only.
#[derive(Debug)]
pub(super) struct Cursor<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    pub(super) version: u8,
}

impl<'a> Cursor<'a> {
    pub(super) fn wrong<T>(&self, problem: impl Into<String>) -> Result<T, Stop> {
        Err(Stop::Wrong(fail::at(self.at as u64, problem, fail::COPY_AGAIN)))
    }

    pub(super) fn take(&mut self, count: u64) -> Result<&'a [u8], Stop> {
        let end = usize::try_from(count).ok().and_then(|count| self.at.checked_add(count)).ok_or(Stop::Short)?;
        let bytes = self.bytes.get(self.at..end).ok_or(Stop::Short)?;
        self.at = end;
        Ok(bytes)
    }

    fn word<const N: usize>(&mut self) -> Result<[u8; N], Stop> {
        self.take(N as u64)?.first_chunk().copied().ok_or(Stop::Short)
    }

    /// A tag or type.
    pub(super) fn code(&mut self) -> Result<u32, Stop> {
        self.word().map(u32::from_be_bytes)
    }

    /// A size or an offset as it is written.
    fn size_of(&mut self, wide: bool) -> Result<u64, Stop> {
        if wide { self.word().map(u64::from_be_bytes) } else { self.code().map(u64::from) }
    }

    /// A count, size or number of a dimension.
    pub(super) fn size(&mut self) -> Result<u64, Stop> {
        self.size_of(self.version == 5)
    }

    /// A byte of the file.
    pub(super) fn offset(&mut self) -> Result<u64, Stop> {
        self.size_of(self.version != 1)
    }

    /// The largest size: stands for records that are not counted.
    pub(super) fn largest_size(&self) -> u64 {
        if self.version == 5 { u64::MAX } else { u64::from(u32::MAX) }
    }

    /// Bytes that are filled up to a multiple of four.
    pub(super) fn padded(&mut self, count: u64) -> Result<&'a [u8], Stop> {
        let bytes = self.take(count)?;
        self.take((4 - count % 4) % 4)?;
        Ok(bytes)
    }

    pub(super) fn name(&mut self) -> Result<String, Stop> {
        let length = self.size()?;
        self.padded(length).map(decode)
    }

    /// The elements of a list: as many as are stated behind the tag, or none where both are 0.
    pub(super) fn list<T>(
        &mut self,
        tag: u32,
        what: &str,
        mut element: impl FnMut(&mut Self) -> Result<T, Stop>,
    ) -> Result<Vec<T>, Stop> {
        let found = self.code()?;
        let count = self.size()?;
        if !(found == tag || (found == 0 && count == 0)) {
            return self.wrong(format!("found the tag {found:#x} with {count} elements, wanted {tag:#x}: {what}"));
        }
        // each takes some bytes: what is not there ends the loop
        let mut elements = Vec::new();
        for _ in 0..count {
            elements.push(element(self)?);
        }
        Ok(elements)
    }
}
