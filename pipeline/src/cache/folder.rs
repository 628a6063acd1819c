//! The cache's folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use super::names::{Kind, STAMPS, kind_of};
use super::origin::Origin;
use super::pending_stage::PendingStage;
use crate::error::StoreError;
use crate::files::{open_regular, sweep};
use crate::outcome::StageResult;
use crate::recording::InputFiles;
use crate::store::{StageIdentity, read_untouched_stage};

/// A folder of stage results by key.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    notes: Mutex<Notes>,
}

#[derive(Debug, Default)]
struct Notes {
    texts: Vec<String>,
    /// It was said that results are not kept.
    unkept: bool,
}

impl Cache {
    /// Opens the cache in `folder`, makes the folder if it is missing, and removes what killed runs left.
    ///
    /// Where the folder cannot be made, nothing is found and nothing kept, and [`Cache::take_notes`] says so, once: a
    /// run goes on to its result.
    pub fn open(folder: &Path) -> Self {
        let cache = Self { folder: folder.to_owned(), notes: Mutex::default() };
        match cache.make_folder() {
            Ok(()) => [folder, &folder.join(STAMPS)].into_iter().for_each(sweep),
            Err(error) => cache.unkept(&error),
        }
        cache
    }

    /// The input files of a run, with what earlier runs hashed: kept beside the results. `fresh` hashes every file
    /// again.
    pub fn input_files(&self, fresh: bool) -> InputFiles {
        InputFiles::keeping_hashes(&self.folder.join(STAMPS), fresh)
    }

    fn make_folder(&self) -> Result<(), StoreError> {
        fs::create_dir_all(&self.folder)
            .map_err(|error| StoreError::io("its folder cannot be made", &self.folder, &error))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where the result with this key lies, or would lie.
    pub fn path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.h5"))
    }

    /// Where the origin of the result with this key lies, or would lie.
    pub fn origin_path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.json"))
    }

    /// Whether there is a result with this key, without reading it. It may be gone a moment later: another process may
    /// free the cache.
    pub fn contains(&self, key: &str) -> bool {
        self.path(key).is_file()
    }

    /// The result of this stage with this key, marked as used. A file that is damaged, or the result of something else,
    /// counts as absent: it is removed, and [`Cache::take_notes`] says so.
    ///
    /// What comes back is in memory, or in the file, held open: removing it afterwards takes nothing from a run, and
    /// changing it makes reading it an error.
    /// Recordings in it are read through `files`.
    pub fn get(&self, identity: &StageIdentity, files: &InputFiles) -> Option<StageResult> {
        let path = self.path(identity.key);
        if !path.is_file() {
            return None;
        }
        let read = || read_untouched_stage(&path, identity, files);
        // twice: another process may remove the file and put it again between looking and reading
        match read().or_else(|_| read()) {
            Ok(Some(result)) => {
                mark_used(&path);
                Some(result)
            }
            // others are at it: it is computed instead
            Ok(None) => None,
            // another process removed it in between
            Err(_) if !path.exists() => None,
            Err(error) => {
                let removed = if fs::remove_file(&path).is_ok() { "removed" } else { "ignored" };
                self.note(format!("a file in the cache was {removed}, its stage runs again: {error}"));
                None
            }
        }
    }

    /// Keeps a result; makes the folder again if somebody removed it. Errors: the folder cannot be written; an artifact
    /// is not valid.
    pub fn put(&self, identity: &StageIdentity, result: &StageResult) -> Result<(), StoreError> {
        self.make_folder()?;
        PendingStage::write(&self.path(identity.key), identity, result)?.finish()
    }

    /// Keeps a result with its origin, which is written first: the file is written, and not yet what the cache has
    /// under its key. Errors: as [`Cache::put`].
    pub(crate) fn write_with_origin(
        &self,
        origin: &Origin,
        identity: &StageIdentity,
        result: &StageResult,
    ) -> Result<PendingStage, StoreError> {
        self.make_folder()?;
        let explained = origin.write(&self.origin_path(&origin.key));
        let pending = PendingStage::write(&self.path(&origin.key), identity, result)?;
        // only explanations need the origin: the result is kept without
        explained.unwrap_or_else(|error| self.unkept(&error));
        Ok(pending)
    }

    /// The origin of the result with this key, whether the result is still there or not.
    pub fn origin(&self, key: &str) -> Option<Origin> {
        Origin::read(&self.origin_path(key)).filter(|origin| origin.key == key)
    }

    /// The origins of all results that are there, with the times of their last use; by key. Unreadable ones are left
    /// out.
    pub fn origins(&self) -> Vec<(Origin, SystemTime)> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let mut names: Vec<String> =
            entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort_unstable();
        names.iter().filter_map(|name| self.origin_of(name)).collect()
    }

    fn origin_of(&self, name: &str) -> Option<(Origin, SystemTime)> {
        let Some(Kind::Origin(key)) = kind_of(name) else { return None };
        let used = fs::metadata(self.path(key)).and_then(|metadata| metadata.modified()).ok()?;
        Some((self.origin(key)?, used))
    }

    /// Something that the user should know.
    fn note(&self, note: String) {
        self.notes().texts.push(note);
    }

    /// A result that is not kept costs the next run its time, and this one nothing. What stops one stops the others as
    /// a rule (a full disk, a folder that may only be read): only the first is reported.
    pub(crate) fn unkept(&self, error: &StoreError) {
        let mut notes = self.notes();
        if !std::mem::replace(&mut notes.unkept, true) {
            let folder = self.folder.display();
            notes.texts.push(format!(
                "the cache {folder} cannot be written, the next run computes again what this one does not keep: \
                 {error}\n  help: make room or choose another with --cache"
            ));
        }
    }

    /// What the user should know of damaged files and of results that are not kept, since the last call.
    pub fn take_notes(&self) -> Vec<String> {
        std::mem::take(&mut self.notes().texts)
    }

    fn notes(&self) -> MutexGuard<'_, Notes> {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A result that was marked as used is not marked again before. Why: a process that reads it meanwhile has to begin
/// again, and what is freed is chosen by hours and days.
const MARK_AGAIN: Duration = Duration::from_secs(60);

/// A result's time of modification is that of its last use, to a minute: times of access are switched off on many
/// machines. Where a file may only be read the time stays: the cache works all the same, it only forgets in another
/// order.
fn mark_used(path: &Path) {
    let mark = || -> std::io::Result<()> {
        let (file, now) = (open_regular(path)?, SystemTime::now());
        let marked = file.metadata()?.modified()?;
        // a time to come is a clock's that was wrong
        match now.duration_since(marked) {
            Ok(age) if age < MARK_AGAIN => Ok(()),
            _ => file.set_modified(now),
        }
    };
    let _ = mark();
}
