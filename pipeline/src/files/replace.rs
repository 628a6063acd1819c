//! Files that are either whole or not there: written under a temporary name, synced, renamed, the folder synced.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::temporary::{folder_of, temporary_path};
use crate::error::StoreError;

/// Writes a file so that a kill at any moment leaves the old one, the new one or none, never half of one.
///
/// `write` gets a name of its own in the same folder and leaves a closed file there.
/// Errors: those of `write`; the folder is missing or cannot be written.
pub fn replace_file(path: &Path, write: impl FnOnce(&Path) -> Result<(), StoreError>) -> Result<(), StoreError> {
    let replacement = Replacement::new(path)?;
    let io = |error: std::io::Error| StoreError::io("cannot be synced", path, &error);
    let sync = || File::open(&replacement.temporary).and_then(|file| file.sync_all()).map_err(io);
    let written = write(&replacement.temporary).and_then(|()| sync());
    replacement.take(written)
}

/// A file that is going to take another's place; dropped before, it is removed.
pub(crate) struct Replacement {
    path: PathBuf,
    temporary: PathBuf,
}

impl Replacement {
    /// Nothing is written yet. Errors: the folder is missing.
    pub(crate) fn new(path: &Path) -> Result<Self, StoreError> {
        if !folder_of(path).is_dir() {
            return Err(StoreError::new("its folder does not exist").file(path).help("make the folder first"));
        }
        Ok(Self { path: path.to_owned(), temporary: temporary_path(path) })
    }

    /// Takes the place, once it is `written` and synced. Errors: those of writing it; it cannot be renamed, or the
    /// folder not be synced.
    pub(crate) fn take(self, written: Result<(), StoreError>) -> Result<(), StoreError> {
        let Self { path, temporary } = &self;
        let io = |doing: &str, error: &std::io::Error| StoreError::io(doing, path, error);
        written
            .and_then(|()| fs::rename(temporary, path).map_err(|error| io("cannot be renamed", &error)))
            .map_err(|error| self.named(error))?;
        File::open(folder_of(path))
            .and_then(|folder| folder.sync_all())
            .map_err(|error| io("its folder cannot be synced", &error))
    }

    /// Where the file is written before it takes its place.
    pub(crate) fn temporary(&self) -> &Path {
        &self.temporary
    }

    /// The error about the file that is to be replaced, instead of the temporary one.
    pub(crate) fn named(&self, error: StoreError) -> StoreError {
        let problem = error.problem.replace(&*self.temporary.to_string_lossy(), &self.path.to_string_lossy());
        let file = if error.file == self.temporary { self.path.clone() } else { error.file };
        StoreError { file, problem, ..error }
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        // renamed, never made, or in the way of nobody: the next sweep takes what cannot be removed
        let _ = fs::remove_file(&self.temporary);
    }
}

/// As [`replace_file`], for files that are none of the store's. Errors: those of `fill`, and as there.
pub fn replace_with(path: &Path, fill: impl FnOnce(&Path) -> std::io::Result<()>) -> Result<(), StoreError> {
    replace_file(path, |temporary| fill(temporary).map_err(|error| StoreError::io("cannot be written", path, &error)))
}

/// As [`replace_file`] with these bytes, without waiting for the disk: after a power cut the file may be empty. For
/// what is only convenient.
pub(crate) fn replace_unsynced(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let temporary = temporary_path(path);
    fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path)).map_err(|error| {
        // as above: the next sweep takes it
        let _ = fs::remove_file(&temporary);
        StoreError::io("cannot be written", path, &error)
    })
}

/// Finds out whether [`replace_file`] could write `path`, by making a temporary file beside it and removing it. Errors:
/// why not, in the system's words.
pub fn probe(path: &Path) -> std::io::Result<()> {
    let temporary = temporary_path(path);
    File::create_new(&temporary)?;
    fs::remove_file(&temporary)
}
