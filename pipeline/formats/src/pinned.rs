//! A file that must stay as it was when it was opened.

use crate::budget::most_inflated;
use crate::fail;
use crate::regular::open_regular;
use crate::{FormatError, Raw};
use std::fs::{File, Metadata};
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A file's path, size and state when it was opened. Holds no open file.
#[derive(Debug, Clone)]
pub(crate) struct Pinned {
    path: PathBuf,
    bytes: u64,
    state: State,
    /// What its compressed data may still come to. Clones share it.
    inflatable: Arc<AtomicU64>,
}

/// Device, inode, times of modification and of the last change: what tells that it is the same file, unchanged.
type State = [i64; 6];

fn state(about: &Metadata) -> State {
    let [device, inode] = [about.dev().cast_signed(), about.ino().cast_signed()];
    [device, inode, about.mtime(), about.mtime_nsec(), about.ctime(), about.ctime_nsec()]
}

impl Pinned {
    /// Opens a file for the first time.
    pub(crate) fn open(path: &Path) -> Result<(Self, File), FormatError> {
        let cannot = |e| fail::plain(format!("the file cannot be opened: {e}"), "check its path and permissions");
        let file = open_regular(path).map_err(cannot)?;
        let about = file.metadata().map_err(cannot)?;
        let inflatable = Arc::new(AtomicU64::new(most_inflated(about.len())));
        Ok((Self { path: path.to_owned(), bytes: about.len(), state: state(&about), inflatable }, file))
    }

    /// Size in bytes.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Takes the inflated bytes of a part of it into account; whether all so far are within [`most_inflated`].
    pub(crate) fn may_inflate(&self, bytes: u64) -> bool {
        self.inflatable.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(bytes)).is_ok()
    }

    /// Opens it once more. Errors: gone, or changed by now.
    pub(crate) fn reopen(&self) -> Result<File, FormatError> {
        let (now, file) = Self::open(&self.path)?;
        if now.bytes != self.bytes {
            let problem = format!("the file had {} bytes when it was opened and has {} now", self.bytes, now.bytes);
            return Err(fail::plain(problem, "wait until the recording has ended, then open it again"));
        }
        if now.state != self.state {
            let problem = "the file was changed since it was opened";
            return Err(fail::plain(problem, "wait until nothing writes to it, then open it again"));
        }
        Ok(file)
    }
}

/// Fills `into` with the bytes from `at`.
pub(crate) fn read_at(file: &File, at: u64, into: &mut [u8]) -> Result<(), FormatError> {
    let wanted = into.len();
    file.read_exact_at(into, at)
        .map_err(|e| fail::at(at, format!("{wanted} bytes cannot be read: {e}"), fail::COPY_AGAIN))
}

/// Whether `count` samples from `start` lie within a channel of `samples`; gives the sample behind the last.
pub(crate) fn stretch_end(start: usize, count: usize, samples: usize) -> Result<usize, FormatError> {
    start.checked_add(count).filter(|&end| end <= samples).ok_or_else(|| {
        let problem = format!("{count} samples from sample {start} were wanted, the channel has {samples}");
        fail::plain(problem, "ask for a stretch that ends with the channel")
    })
}

/// A stretch of samples kept in memory.
pub(crate) fn stretch_of(kept: &[f64], start: usize, count: usize) -> Result<Raw, FormatError> {
    let end = stretch_end(start, count, kept.len())?;
    Ok(Raw::Float64(kept.get(start..end).unwrap_or_default().to_vec()))
}
