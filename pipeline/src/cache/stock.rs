//! What lies in a cache's folder, by the names and sizes of its files alone.

use std::fs::{self, DirEntry};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::names::{Kind, STAMPS, is_stamp, kind_of, temporary_stamp};
use crate::error::StoreError;
use crate::files::stale;

/// An origin without a result that is older has no result to come: writing the longest takes minutes.
const ORPHANED: Duration = Duration::from_secs(3600);

/// What a file of the cache is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sort {
    /// A stage's result, with its origin.
    Result,
    /// What an input file hashed to.
    Stamp,
    /// Of no use to anybody: a temporary file whose owner is dead, an origin without a result.
    Leftover,
}

impl Sort {
    /// Its name in messages and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Result => "result",
            Self::Stamp => "stamp",
            Self::Leftover => "leftover",
        }
    }
}

/// A file of the cache.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// Its path.
    pub path: PathBuf,
    /// What it is.
    pub sort: Sort,
    /// Bytes, a result's with those of its origin.
    pub bytes: u64,
    /// When it was last used.
    pub used: SystemTime,
}

/// The files of a cache, least recently used first.
#[derive(Debug, Clone, Default)]
pub struct Stock {
    /// The files.
    pub files: Vec<Stored>,
}

impl Stock {
    /// Looks through a cache's folder; a folder that does not exist is empty. Files with other names than the cache gives are not seen.
    ///
    /// Errors: the folder cannot be listed.
    pub fn list(folder: &Path) -> Result<Self, StoreError> {
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(StoreError::io("the cache folder cannot be listed", folder, &error)),
        };
        let now = SystemTime::now();
        let mut files: Vec<Stored> = entries.flatten().filter_map(|entry| stored(&entry, now)).collect();
        // a missing folder of stamps is an empty one
        let stamps = fs::read_dir(folder.join(STAMPS)).into_iter().flatten().flatten();
        files.extend(stamps.filter_map(|entry| stamp(&entry)));
        files.sort_by(|a, b| (a.used, &a.path).cmp(&(b.used, &b.path)));
        Ok(Self { files })
    }

    /// How many files of a sort, and their bytes.
    pub fn total(&self, sort: Sort) -> (usize, u64) {
        let of = self.files.iter().filter(|file| file.sort == sort);
        of.fold((0, 0), |(count, bytes), file| (count + 1, bytes + file.bytes))
    }

    /// How many results have not been used for a time, and their bytes.
    pub fn idle(&self, at_least: Duration, now: SystemTime) -> (usize, u64) {
        let idle = |file: &&Stored| file.sort == Sort::Result && age(file.used, now) >= at_least;
        self.files.iter().filter(idle).fold((0, 0), |(count, bytes), file| (count + 1, bytes + file.bytes))
    }
}

/// Time since then; of a time to come, none.
pub(super) fn age(then: SystemTime, now: SystemTime) -> Duration {
    now.duration_since(then).unwrap_or_default()
}

fn stored(entry: &DirEntry, now: SystemTime) -> Option<Stored> {
    let (name, path) = (entry.file_name().to_string_lossy().into_owned(), entry.path());
    let metadata = entry.metadata().ok().filter(fs::Metadata::is_file)?;
    let used = metadata.modified().ok()?;
    let (sort, bytes) = match kind_of(&name)? {
        Kind::Result(_) => {
            let origin = fs::metadata(path.with_extension("json")).map_or(0, |origin| origin.len());
            (Sort::Result, metadata.len() + origin)
        }
        Kind::Origin(_) if path.with_extension("h5").exists() || age(used, now) < ORPHANED => return None,
        Kind::Temporary(temporary) if !stale(&path, &temporary) => return None,
        Kind::Origin(_) | Kind::Temporary(_) => (Sort::Leftover, metadata.len()),
    };
    Some(Stored { path, sort, bytes, used })
}

fn stamp(entry: &DirEntry) -> Option<Stored> {
    let metadata = entry.metadata().ok().filter(fs::Metadata::is_file)?;
    let (name, path, used) =
        (entry.file_name().to_string_lossy().into_owned(), entry.path(), metadata.modified().ok()?);
    let sort = match temporary_stamp(&name) {
        Some(temporary) if stale(&path, &temporary) => Sort::Leftover,
        None if is_stamp(&name) => Sort::Stamp,
        _ => return None,
    };
    Some(Stored { path, sort, bytes: metadata.len(), used })
}
