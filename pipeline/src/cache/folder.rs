//! The cache's folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::replace::{replace_file, sweep};
use crate::runner::StageResult;
use crate::store::{StoreError, read_stage, write_stage};

/// A folder of stage results by key.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    notes: Mutex<Vec<String>>,
}

impl Cache {
    /// Opens the cache in `folder`, makes the folder if it is missing, and sweeps what killed runs left. Errors: it cannot be made.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(|error| {
            StoreError::io("the cache folder cannot be made", folder, &error).help("choose another with --cache")
        })?;
        sweep(folder, ".");
        Ok(Self { folder: folder.to_owned(), notes: Mutex::default() })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where the result with this key lies, or would lie.
    pub fn path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.h5"))
    }

    /// Whether there is a result with this key, without reading it.
    pub fn contains(&self, key: &str) -> bool {
        self.path(key).is_file()
    }

    /// The result with this key. A damaged file counts as absent: it is removed, and [`Cache::take_notes`] says so.
    pub fn get(&self, key: &str) -> Option<StageResult> {
        let path = self.path(key);
        if !path.is_file() {
            return None;
        }
        match read_stage(&path) {
            Ok(result) => Some(result),
            // another process removed it in between
            Err(_) if !path.exists() => None,
            Err(error) => {
                let removed = if fs::remove_file(&path).is_ok() { "removed" } else { "ignored" };
                self.notes
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .push(format!("a damaged file in the cache was {removed}: {error}"));
                None
            }
        }
    }

    /// Keeps a result. Errors: the folder cannot be written; an artifact is not valid.
    pub fn put(&self, key: &str, result: &StageResult) -> Result<(), StoreError> {
        replace_file(&self.path(key), |temporary| write_stage(temporary, result))
    }

    /// Notes about damaged files since the last call.
    pub fn take_notes(&self) -> Vec<String> {
        std::mem::take(&mut self.notes.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
