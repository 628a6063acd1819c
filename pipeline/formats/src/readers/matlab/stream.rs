//! Reading forwards through a file, or through the inflated bytes of a variable.

use crate::FormatError;
use crate::fail;
use crate::inflating::Inflating;
use crate::pinned::read_at;
use std::fs::File;

/// Bytes read at once from a plain file: headers are short and data are skipped.
const WINDOW_BYTES: u64 = 4096;

/// Bytes that can be read or skipped, forwards only.
pub(super) struct Stream {
    position: u64,
    from: From,
}

enum From {
    File { file: File, bytes: u64, window: Vec<u8>, window_at: u64 },
    Inflating { inflating: Box<Inflating>, element_at: u64 },
}

impl Stream {
    /// A file of `bytes` bytes, from `position` on.
    pub(super) fn plain(file: File, position: u64, bytes: u64) -> Self {
        Self { position, from: From::File { file, bytes, window: Vec::new(), window_at: 0 } }
    }

    /// The inflated bytes of the element at byte `element_at` of the file; positions count inflated bytes.
    pub(super) fn inflating(inflating: Inflating, element_at: u64) -> Self {
        Self { position: 0, from: From::Inflating { inflating: Box::new(inflating), element_at } }
    }

    /// Byte that comes next.
    pub(super) fn position(&self) -> u64 {
        self.position
    }

    /// An error at a position of this stream. In compressed data the byte given is where the compressed element begins.
    pub(super) fn error(&self, position: u64, problem: impl Into<String>, help: &str) -> FormatError {
        match &self.from {
            From::File { .. } => fail::at(position, problem, help),
            From::Inflating { element_at, .. } => {
                let problem = format!("{} (byte {position} of the inflated variable)", problem.into());
                fail::at(*element_at, problem, help)
            }
        }
    }

    /// `count` bytes, which must end at `end` at the latest and be there at all before anything is allocated for them.
    pub(super) fn bytes(&mut self, count: u64, end: u64, what: &str) -> Result<Vec<u8>, FormatError> {
        self.must_end(count, end, what)?;
        let mut bytes = vec![0; count as usize];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    /// `N` bytes, which must end at `end` at the latest.
    pub(super) fn array<const N: usize>(&mut self, end: u64, what: &str) -> Result<[u8; N], FormatError> {
        self.must_end(N as u64, end, what)?;
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    /// Passes over `count` bytes, which must end at `end` at the latest.
    pub(super) fn skip(&mut self, count: u64, end: u64) -> Result<(), FormatError> {
        self.must_end(count, end, "the data")?;
        if let From::Inflating { inflating, .. } = &mut self.from {
            inflating.skip(count)?;
        }
        self.position += count;
        Ok(())
    }

    fn must_end(&self, count: u64, end: u64, what: &str) -> Result<(), FormatError> {
        let left = end.saturating_sub(self.position);
        if count <= left {
            return Ok(());
        }
        Err(self.error(self.position, format!("{what} takes {count} bytes, {left} are left"), fail::COPY_AGAIN))
    }

    fn fill(&mut self, into: &mut [u8]) -> Result<(), FormatError> {
        match &mut self.from {
            From::Inflating { inflating, .. } => inflating.fill(into)?,
            From::File { file, bytes, window, window_at } => {
                if in_window(window, *window_at, self.position, into.len()).is_none() {
                    let size = bytes.saturating_sub(self.position).min(WINDOW_BYTES.max(into.len() as u64));
                    window.resize(size as usize, 0);
                    *window_at = self.position;
                    read_at(file, self.position, window)?;
                }
                match in_window(window, *window_at, self.position, into.len()) {
                    Some(found) => into.copy_from_slice(found),
                    None => read_at(file, self.position, into)?,
                }
            }
        }
        self.position += into.len() as u64;
        Ok(())
    }
}

fn in_window(window: &[u8], window_at: u64, position: u64, count: usize) -> Option<&[u8]> {
    let from = usize::try_from(position.checked_sub(window_at)?).ok()?;
    window.get(from..from.checked_add(count)?)
}
