//! Hashes of input files, kept between runs in small files: bulk data is hashed once.
//!
//! A stamp serves only to skip hashing: no key and no result contains it. Whatever is wrong with one, the file is hashed again.

use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock};

use super::hash::{Inspected, Stamp};
use crate::cache::replace_unsynced;

/// Begins every stamp; another layout gets another number.
const TITLE: &str = "afmid stamp 1";

static FOLDER: RwLock<Option<PathBuf>> = RwLock::new(None);

/// From now on hashes are kept in this folder, which is made when the first one is.
pub(crate) fn keep_in(folder: PathBuf) {
    *FOLDER.write().unwrap_or_else(PoisonError::into_inner) = Some(folder);
}

/// Where the stamp of a file lies: under the hash of its absolute path.
fn place(path: &Path) -> Option<PathBuf> {
    let folder = FOLDER.read().unwrap_or_else(PoisonError::into_inner).clone()?;
    Some(folder.join(blake3::hash(path.as_os_str().as_bytes()).to_hex().as_str()))
}

/// What an earlier run found in a file that is still in this state.
pub(super) fn known(path: &Path, stamp: &Stamp) -> Option<Inspected> {
    let text = fs::read_to_string(place(path)?).ok()?;
    let (title, rest) = text.split_once('\n')?;
    let (state, found) = rest.trim_end().split_once(" = ")?;
    if title != TITLE || state != stamp.to_string() {
        return None;
    }
    let (blake3, endless) = found.split_once(' ')?;
    let is_hash = blake3.len() == 64 && blake3.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
    let endless = match endless {
        "whole" => false,
        "endless" => true,
        _ => return None,
    };
    is_hash.then(|| Inspected { blake3: blake3.to_owned(), endless })
}

/// Keeps what was found. Where it cannot be kept the next run hashes again.
pub(super) fn keep(path: &Path, stamp: &Stamp, found: &Inspected) {
    let Some(place) = place(path) else { return };
    let Some(folder) = place.parent() else { return };
    let state = if found.endless { "endless" } else { "whole" };
    let text = format!("{TITLE}\n{stamp} = {} {state}\n", found.blake3);
    let _ = fs::create_dir_all(folder).map(|()| replace_unsynced(&place, text.as_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fixture::Folder;

    #[test]
    fn a_stamp_is_known_in_its_own_state_only_and_damage_is_no_stamp() {
        let folder = Folder::new("stamps");
        keep_in(folder.file("stamps"));
        let path = folder.file("a.h5");
        let stamp = Stamp { size: 7, modified_ns: -5, inode: 3, device: 1 };
        let found = Inspected { blake3: "ab".repeat(32), endless: true };
        // another test of this process may have set its own folder in between
        let kept = loop {
            keep_in(folder.file("stamps"));
            keep(&path, &stamp, &found);
            keep_in(folder.file("stamps"));
            let there = folder.file("stamps").join(blake3::hash(path.as_os_str().as_bytes()).to_hex().as_str());
            if there.is_file() {
                break there;
            }
        };
        let read = |stamp: &Stamp| {
            keep_in(folder.file("stamps"));
            known(&path, stamp)
        };
        assert!(read(&stamp).is_some_and(|read| read.blake3 == found.blake3 && read.endless));
        assert!(read(&Stamp { modified_ns: -4, ..stamp.clone() }).is_none());
        let whole = fs::read_to_string(&kept).unwrap();
        for broken in
            ["", "afmid stamp 1\n", &whole.replace("ab", "zz"), &whole.replace("endless", ""), "\u{0}\n = x y"]
        {
            fs::write(&kept, broken).unwrap();
            assert!(read(&stamp).is_none(), "{broken:?}");
        }
    }
}
