//! BLAKE3 hashes of whole files, streamed; remembered within a process while a file does not change.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use crate::error::StageError;

/// What tells two states of a file apart without reading it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Stamp {
    size: u64,
    modified_ns: i128,
    inode: u64,
    device: u64,
}

static KNOWN: LazyLock<Mutex<HashMap<PathBuf, (Stamp, String)>>> = LazyLock::new(Mutex::default);

/// A file that changed this recently may change again within the same tick of its time stamp: not remembered.
const SETTLED: Duration = Duration::from_secs(2);

/// BLAKE3 hash of a file's bytes, in hexadecimal. Streams; remembers the hash while size, time and inode stay the same.
///
/// Errors: the file cannot be read.
pub fn hash_file(path: &Path) -> Result<String, StageError> {
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
    let known = |map: &HashMap<PathBuf, (Stamp, String)>| {
        map.get(&key).filter(|(have, _)| *have == stamp).map(|(_, hash)| hash.clone())
    };
    if let Some(hash) = known(&KNOWN.lock().unwrap_or_else(PoisonError::into_inner)) {
        return Ok(hash);
    }
    let hash = hash_reader(&mut file).map_err(fail)?;
    let settled = metadata
        .modified()
        .ok()
        .and_then(|modified| SystemTime::now().duration_since(modified).ok())
        .is_some_and(|age| age > SETTLED);
    if settled {
        KNOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(key, (stamp, hash.clone()));
    }
    Ok(hash)
}

fn hash_reader(file: &mut File) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hasher.finalize().to_hex().to_string()),
            count => hasher.update(&buffer[..count]),
        };
    }
}
