//! A file whose header is being read.

use crate::FormatError;
use crate::fail;
use crate::pinned::{Pinned, read_at};
use std::fs::File;
use std::path::Path;

/// An open file and what it was when it was opened.
#[derive(Debug)]
pub(crate) struct Opened {
    pinned: Pinned,
    file: File,
}

impl Opened {
    /// Opens a file. Errors: it cannot be opened or is no regular file.
    pub(crate) fn new(path: &Path) -> Result<Self, FormatError> {
        Pinned::open(path).map(|(pinned, file)| Self { pinned, file })
    }

    /// The file's size.
    pub(crate) fn bytes(&self) -> u64 {
        self.pinned.bytes()
    }

    /// For readers of samples, which open it again.
    pub(crate) fn pinned(&self) -> &Pinned {
        &self.pinned
    }

    /// Reads exactly `count` bytes from byte `from`; allocates only what the file can hold. Errors: beyond the end;
    /// unreadable.
    pub(crate) fn read(&self, what: &str, from: u64, count: u64) -> Result<Vec<u8>, FormatError> {
        let inside = from.checked_add(count).is_some_and(|end| end <= self.bytes());
        let (true, Ok(length)) = (inside, usize::try_from(count)) else {
            return Err(fail::truncated(what, from, count, self.bytes()));
        };
        let mut buffer = vec![0; length];
        read_at(&self.file, from, &mut buffer)?;
        Ok(buffer)
    }

    /// The first `count` bytes, or the whole file if it is shorter.
    pub(crate) fn head(&self, count: u64) -> Result<Vec<u8>, FormatError> {
        self.read("the head", 0, count.min(self.bytes()))
    }
}
