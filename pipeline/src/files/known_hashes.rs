//! What was found in files, kept between runs in small files: bulk data is read once.
//!
//! An entry serves only to skip reading: no key and no result contains it. Each ends with the hash of its own text: whatever is wrong with one, the
//! file is read again.

use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use super::{FileState, read_regular, replace_unsynced};

/// Begins every entry; another layout gets another number.
const TITLE: &str = "afmid stamp 2";

/// The largest entry that is read.
const MOST_BYTES: u64 = 1 << 16;

/// A folder of entries: one per file, under the hash of its absolute path.
#[derive(Debug, Clone)]
pub(crate) struct KnownHashes {
    folder: PathBuf,
    /// Entries of earlier runs are ignored; new ones are kept.
    fresh: bool,
}

impl KnownHashes {
    /// Entries in `folder`, which is made when the first one is; those of earlier runs count unless `fresh`.
    pub(crate) fn new(folder: &Path, fresh: bool) -> Self {
        Self { folder: folder.to_owned(), fresh }
    }

    fn place(&self, path: &Path) -> PathBuf {
        self.folder.join(blake3::hash(path.as_os_str().as_bytes()).to_hex().as_str())
    }

    /// What an earlier run found in the file at an absolute path, if it is still in this state.
    pub(crate) fn find(&self, path: &Path, state: &FileState) -> Option<String> {
        if self.fresh {
            return None;
        }
        let text = String::from_utf8(read_regular(&self.place(path), MOST_BYTES).ok()?).ok()?;
        let (body, hash) = text.trim_end().rsplit_once('\n')?;
        if blake3::hash(body.as_bytes()).to_hex().as_str() != hash {
            return None;
        }
        let (title, entry) = body.split_once('\n')?;
        let (known, found) = entry.split_once(" = ")?;
        (title == TITLE && known == state.to_string()).then(|| found.to_owned())
    }

    /// Keeps what was found, one line. Where it cannot be kept the next run reads the file again.
    pub(crate) fn keep(&self, path: &Path, state: &FileState, found: &str) {
        let body = format!("{TITLE}\n{state} = {found}");
        let text = format!("{body}\n{}\n", blake3::hash(body.as_bytes()).to_hex());
        let _ = fs::create_dir_all(&self.folder).map(|()| replace_unsynced(&self.place(path), text.as_bytes()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::fixture::Folder;

    #[test]
    fn an_entry_counts_in_its_own_state_only_and_a_damaged_one_never() {
        let folder = Folder::new("known");
        let known = KnownHashes::new(&folder.file("stamps"), false);
        let path = folder.file("a.h5");
        fs::write(&path, "x").unwrap();
        let state = FileState::at(&path).unwrap();
        known.keep(&path, &state, "abc whole");
        assert_eq!(known.find(&path, &state).as_deref(), Some("abc whole"));
        assert_eq!(known.find(&path, &state.with_modified_ns(1)), None);
        assert_eq!(KnownHashes::new(&folder.file("stamps"), true).find(&path, &state), None, "fresh reads none");
        let place = known.place(&path);
        let whole = fs::read(&place).unwrap();
        for at in 0..whole.len() {
            let mut broken = whole.clone();
            broken[at] ^= 1;
            fs::write(&place, &broken).unwrap();
            // the last byte ends the line and says nothing
            let found = known.find(&path, &state);
            assert!(found.is_none() || (at + 1 == whole.len() && found.as_deref() == Some("abc whole")), "byte {at}");
        }
        for end in 0..whole.len() - 1 {
            fs::write(&place, &whole[..end]).unwrap();
            assert_eq!(known.find(&path, &state), None, "cut at {end}");
        }
    }
}
