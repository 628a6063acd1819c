//! What a plugin is made of, as far as its command line says: part of the cache key.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use super::error::PluginError;
use super::launch::Launch;
use crate::recording::InputFiles;

/// File name and BLAKE3 hash of the program, and of every argument that is a file.
pub(super) type Fingerprint = Vec<String>;

/// Larger files are hashed again only when their size or time has changed: an interpreter, not a script.
const SMALL_BYTES: u64 = 1 << 20;

type Stamp = (PathBuf, u64, Option<SystemTime>);

static HASHES: Mutex<BTreeMap<Stamp, String>> = Mutex::new(BTreeMap::new());

/// Hashes the program and the files among its arguments. Errors: one cannot be read.
pub(super) fn fingerprint(launch: &Launch) -> Result<Fingerprint, PluginError> {
    let files = launch.arguments.iter().map(|argument| launch.folder.join(argument)).filter(|path| path.is_file());
    std::iter::once(launch.program.clone()).chain(files).map(|path| described(&path)).collect()
}

/// Name without folders: a plugin that was moved is the same.
fn described(path: &Path) -> Result<String, PluginError> {
    let unreadable = |error: String| {
        PluginError::new(format!("cannot be read: {}: {error}", path.display()), "its bytes are part of the cache key")
    };
    let metadata = std::fs::metadata(path).map_err(|error| unreadable(error.to_string()))?;
    let stamp = (path.to_owned(), metadata.len(), metadata.modified().ok());
    let known = || HASHES.lock().unwrap_or_else(PoisonError::into_inner);
    let kept = if metadata.len() > SMALL_BYTES { known().get(&stamp).cloned() } else { None };
    let hash = match kept {
        Some(hash) => hash,
        None => InputFiles::new().hash(path).map_err(|error| unreadable(error.to_string()))?,
    };
    known().insert(stamp, hash.clone());
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(format!("{name} blake3:{hash}"))
}
