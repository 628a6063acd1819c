//! BLAKE3 hashes of whole files, streamed; remembered while a file does not change.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use super::global_heap::HeapGuard;
use super::stamps;
use crate::error::StageError;

/// What tells two states of a file apart without reading it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stamp {
    pub(super) size: u64,
    pub(super) modified_ns: i128,
    pub(super) inode: u64,
    pub(super) device: u64,
}

impl std::fmt::Display for Stamp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {} {} {}", self.size, self.modified_ns, self.inode, self.device)
    }
}

static KNOWN: LazyLock<Mutex<HashMap<PathBuf, (Stamp, Inspected)>>> = LazyLock::new(Mutex::default);

/// A file that changed this recently may change again within the same tick of its time stamp: not remembered.
const SETTLED: Duration = Duration::from_secs(2);

/// BLAKE3 hash of a file's bytes, in hexadecimal. Streams; remembers the hash while size, time and inode stay the same.
///
/// Errors: the file cannot be read.
pub fn hash_file(path: &Path) -> Result<String, StageError> {
    inspect_file(path).map(|found| found.blake3)
}

/// The same for a file that the HDF5 library is to open. Errors: as [`hash_file`]; damage that it does not survive.
pub(super) fn inspect_hdf5(path: &Path) -> Result<Inspected, StageError> {
    let inspected = inspect_file(path)?;
    if inspected.endless {
        return Err(StageError::new("damaged: a heap collection of the HDF5 file never ends").at(path));
    }
    Ok(inspected)
}

/// What one pass through a file tells.
#[derive(Debug, Clone)]
pub(super) struct Inspected {
    pub(super) blake3: String,
    /// See [`HeapGuard`].
    pub(super) endless: bool,
}

/// Hashes a file and looks for damage that the HDF5 library does not survive. Errors: the file cannot be read.
fn inspect_file(path: &Path) -> Result<Inspected, StageError> {
    let fail = |error: std::io::Error| StageError::new(format!("the file cannot be read: {error}")).at(path);
    let mut file = File::open(path).map_err(fail)?;
    let metadata = file.metadata().map_err(fail)?;
    let stamp = Stamp {
        size: metadata.len(),
        modified_ns: i128::from(metadata.mtime()) * 1_000_000_000 + i128::from(metadata.mtime_nsec()),
        inode: metadata.ino(),
        device: metadata.dev(),
    };
    let key = std::path::absolute(path).map_err(fail)?;
    let known = |map: &HashMap<PathBuf, (Stamp, Inspected)>| {
        map.get(&key).filter(|(have, _)| *have == stamp).map(|(_, found)| found.clone())
    };
    if let Some(found) = known(&KNOWN.lock().unwrap_or_else(PoisonError::into_inner)) {
        return Ok(found);
    }
    let remember = |found: &Inspected| {
        KNOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(key.clone(), (stamp.clone(), found.clone()));
    };
    if let Some(found) = stamps::known(&key, &stamp) {
        remember(&found);
        return Ok(found);
    }
    let found = inspect(&mut file).map_err(fail)?;
    let settled = metadata
        .modified()
        .ok()
        .and_then(|modified| SystemTime::now().duration_since(modified).ok())
        .is_some_and(|age| age > SETTLED);
    if settled {
        remember(&found);
        stamps::keep(&key, &stamp, &found);
    }
    Ok(found)
}

fn inspect(file: &mut File) -> std::io::Result<Inspected> {
    let (mut hasher, mut guard) = (blake3::Hasher::new(), HeapGuard::default());
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = file.read(&mut buffer)?;
        if count == 0 {
            return Ok(Inspected { blake3: hasher.finalize().to_hex().to_string(), endless: guard.finish() });
        }
        hasher.update(&buffer[..count]);
        guard.update(&buffer[..count]);
    }
}
