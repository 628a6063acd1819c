//! What lies in a cache's folder, by the names and sizes of its files alone.

use std::collections::HashMap;
use std::fs::{self, DirEntry};
use std::os::unix::fs::DirEntryExt;
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
    /// Looks through a cache's folder; a folder that does not exist is empty. Files with other names than the cache
    /// gives are not seen.
    ///
    /// Errors: the folder cannot be listed.
    pub fn list(folder: &Path) -> Result<Self, StoreError> {
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(StoreError::io("the cache folder cannot be listed", folder, &error)),
        };
        let now = SystemTime::now();
        let seen: HashMap<String, Seen> = in_order_of_inodes(entries).iter().filter_map(see).collect();
        let mut files: Vec<Stored> =
            seen.iter().filter_map(|(name, file)| stored(folder, name, file, &seen, now)).collect();
        // a missing folder of stamps is an empty one
        let stamps = fs::read_dir(folder.join(STAMPS)).ok().map(in_order_of_inodes).unwrap_or_default();
        files.extend(stamps.iter().filter_map(stamp));
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

/// Size and last use of a file with a name that the cache gives.
struct Seen {
    bytes: u64,
    used: SystemTime,
}

/// The order in which a file system keeps what it knows of its files: that of a folder's names costs a walk through all
/// of it for each.
fn in_order_of_inodes(entries: fs::ReadDir) -> Vec<DirEntry> {
    let mut entries: Vec<DirEntry> = entries.flatten().collect();
    entries.sort_unstable_by_key(DirEntry::ino);
    entries
}

/// Each file is looked at once.
fn see(entry: &DirEntry) -> Option<(String, Seen)> {
    let name = entry.file_name().into_string().ok()?;
    kind_of(&name)?;
    let metadata = entry.metadata().ok().filter(fs::Metadata::is_file)?;
    let used = metadata.modified().ok()?;
    Some((name, Seen { bytes: metadata.len(), used }))
}

fn stored(folder: &Path, name: &str, file: &Seen, seen: &HashMap<String, Seen>, now: SystemTime) -> Option<Stored> {
    let path = folder.join(name);
    let (sort, bytes) = match kind_of(name)? {
        Kind::Result(key) => {
            let origin = seen.get(&format!("{key}.json")).map_or(0, |origin| origin.bytes);
            (Sort::Result, file.bytes + origin)
        }
        Kind::Origin(key) if seen.contains_key(&format!("{key}.h5")) || age(file.used, now) < ORPHANED => return None,
        Kind::Temporary(temporary) if !stale(&path, &temporary) => return None,
        Kind::Origin(_) | Kind::Temporary(_) => (Sort::Leftover, file.bytes),
    };
    Some(Stored { path, sort, bytes, used: file.used })
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
