//! A file that is read in stretches and must not change its size meanwhile.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use common::FormatError;

use crate::damage;

/// An open file and the size it had when it was opened.
#[derive(Debug)]
pub(crate) struct Opened {
    file: File,
    bytes: u64,
}

impl Opened {
    /// Opens a file. Errors: it cannot be opened or is no regular file.
    pub(crate) fn new(path: &Path) -> Result<Self, FormatError> {
        let fail =
            |e| damage::whole(format!("cannot open {}: {e}", path.display()), "check the path and the permissions");
        let file = File::open(path).map_err(fail)?;
        let meta = file.metadata().map_err(fail)?;
        if !meta.is_file() {
            return Err(damage::whole(format!("{} is no regular file", path.display()), "name a file"));
        }
        Ok(Self { file, bytes: meta.len() })
    }

    /// Opens a file again. Errors: as `new`; its size is no longer `bytes`.
    pub(crate) fn again(path: &Path, bytes: u64) -> Result<Self, FormatError> {
        let opened = Self::new(path)?;
        if opened.bytes == bytes {
            return Ok(opened);
        }
        Err(damage::whole(
            format!("{} had {bytes} bytes when it was opened and has {} now", path.display(), opened.bytes),
            "wait until it is written, then open it again",
        ))
    }

    /// The file's size.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The handle, for readers of archives.
    pub(crate) fn into_file(self) -> File {
        self.file
    }

    /// Reads exactly `count` bytes from byte `from`; allocates only what the file can hold. Errors: beyond the end; unreadable.
    pub(crate) fn read(&self, what: &str, from: u64, count: u64) -> Result<Vec<u8>, FormatError> {
        let inside = from.checked_add(count).is_some_and(|end| end <= self.bytes);
        let (true, Ok(len)) = (inside, usize::try_from(count)) else {
            return Err(damage::truncated(what, from, count, self.bytes));
        };
        let mut buffer = vec![0; len];
        self.file
            .read_exact_at(&mut buffer, from)
            .map_err(|e| damage::at(from, format!("{what}: cannot read {count} bytes: {e}"), "check the disk"))?;
        Ok(buffer)
    }

    /// The first `count` bytes, or the whole file if it is shorter.
    pub(crate) fn head(&self, count: u64) -> Result<Vec<u8>, FormatError> {
        self.read("the head", 0, count.min(self.bytes))
    }
}
