//! What was found in files, kept between runs: bulk data is read once.
//!
//! What is known serves only to skip reading: no key and no result contains it. Each line ends in the hash of its own
//! text: whatever is wrong with one, that file is read again. One small file for all files of a folder: looking at a
//! hundred thousand of them opens one.

use std::collections::HashMap;
use std::fs;
use std::hash::{DefaultHasher, Hasher};
use std::io::Write;
use std::ops::Range;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::{FileState, append_regular, read_regular, replace_unsynced};

/// Begins the text of every line, though it is not written: another layout gets another number, and with it other
/// hashes.
const TITLE: &str = "afmid stamp 3";

/// The largest file of lines that is read: a million of them.
const MOST_BYTES: u64 = 1 << 28;

/// Digits of a line's own hash.
const DIGITS: usize = 32;

/// A file of lines is written again when its outdated lines exceed the valid ones by more than this.
const SPARE: usize = 1000;

/// A folder of stamps: for each folder of input files one, under the hash of its path.
#[derive(Debug)]
pub(crate) struct KnownHashes {
    folder: PathBuf,
    /// Lines of earlier runs are ignored; new ones are kept.
    fresh: bool,
    read: Mutex<HashMap<PathBuf, Arc<Lines>>>,
}

/// The lines about the files of one folder, as they were when they were first wanted.
#[derive(Debug, Default)]
struct Lines {
    text: Vec<u8>,
    /// The last line about a file, by a hash of its name: the line itself tells whether it is that one.
    places: HashMap<u64, Range<u32>>,
    /// Lines about files that later lines are about too.
    outdated: usize,
}

impl KnownHashes {
    /// Stamps in `folder`, which is made when the first one is; those of earlier runs count unless `fresh`.
    pub(crate) fn new(folder: &Path, fresh: bool) -> Self {
        Self { folder: folder.to_owned(), fresh, read: Mutex::default() }
    }

    fn place(&self, parent: &Path) -> PathBuf {
        self.folder.join(blake3::hash(parent.as_os_str().as_bytes()).to_hex().as_str())
    }

    /// What an earlier run found in the file at an absolute path, if it is still in this state.
    pub(crate) fn find(&self, path: &Path, state: &FileState) -> Option<String> {
        if self.fresh {
            return None;
        }
        let (parent, name) = parts(path)?;
        let lines = self.lines(parent);
        let line = std::str::from_utf8(lines.line(lines.places.get(&name_hash(name.as_bytes()))?)?).ok()?;
        let (hash, body) = line.split_at_checked(DIGITS)?;
        let body = body.strip_prefix('\t')?;
        let (known, rest) = body.split_once('\t')?;
        let (found, named) = rest.split_once('\t')?;
        (named == name && known == state.to_string() && hash_of(body) == hash).then(|| found.to_owned())
    }

    /// Keeps what was found, one line without tabs. Where it cannot be kept the next run reads the file again.
    pub(crate) fn keep(&self, path: &Path, state: &FileState, found: &str) {
        let Some((parent, name)) = parts(path) else { return };
        let body = format!("{state}\t{found}\t{name}");
        let line = format!("{}\t{body}\n", hash_of(&body));
        let append = || -> std::io::Result<()> {
            fs::create_dir_all(&self.folder)?;
            // in one piece: other runs append too
            append_regular(&self.place(parent))?.write_all(line.as_bytes())
        };
        let _ = append();
    }

    fn lines(&self, parent: &Path) -> Arc<Lines> {
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(lines) = read.get(parent) {
            return lines.clone();
        }
        let place = self.place(parent);
        let lines = Arc::new(Lines::of(read_regular(&place, MOST_BYTES).unwrap_or_default()));
        if lines.outdated > lines.places.len() + SPARE {
            // what others append meanwhile is lost: they hash again
            let _ = replace_unsynced(&place, &lines.last_of_each());
        }
        read.insert(parent.to_owned(), lines.clone());
        lines
    }
}

impl Lines {
    fn of(text: Vec<u8>) -> Self {
        let (mut places, mut outdated, mut start) = (HashMap::new(), 0, 0);
        for end in memchr::memchr_iter(b'\n', &text) {
            if let Some(tab) = memchr::memrchr(b'\t', &text[start..end]) {
                // no text of more than MOST_BYTES is read
                let line = start as u32..end as u32;
                outdated += usize::from(places.insert(name_hash(&text[start + tab + 1..end]), line).is_some());
            }
            start = end + 1;
        }
        Self { text, places, outdated }
    }

    fn line(&self, place: &Range<u32>) -> Option<&[u8]> {
        self.text.get(place.start as usize..place.end as usize)
    }

    /// In the order in which they were written.
    fn last_of_each(&self) -> Vec<u8> {
        let mut places: Vec<&Range<u32>> = self.places.values().collect();
        places.sort_unstable_by_key(|place| place.start);
        let lines = places.into_iter().filter_map(|place| self.line(place));
        lines.flat_map(|line| line.iter().chain(b"\n").copied()).collect()
    }
}

/// Folder and name of a file; the name without bytes that end a line or a field.
fn parts(path: &Path) -> Option<(&Path, String)> {
    Some((path.parent()?, path.file_name()?.as_bytes().escape_ascii().to_string()))
}

/// Two names of one hash: the files of the earlier one are read again.
fn name_hash(name: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(name);
    hasher.finish()
}

fn hash_of(body: &str) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(TITLE.as_bytes()).update(body.as_bytes());
    hasher.finalize().to_hex()[..DIGITS].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::fixture::Folder;

    #[test]
    fn a_stamp_counts_in_its_own_state_only_and_a_damaged_one_never() {
        let folder = Folder::new("known");
        let known = |fresh| KnownHashes::new(&folder.file("stamps"), fresh);
        let (path, other) = (folder.file("a\n\t\u{fc}.h5"), folder.file("b.h5"));
        fs::write(&path, "x").unwrap();
        let state = FileState::at(&path).unwrap();
        known(false).keep(&other, &state, "first");
        known(false).keep(&path, &state, "abc whole");
        assert_eq!(known(false).find(&path, &state).as_deref(), Some("abc whole"));
        assert_eq!(known(false).find(&other, &state).as_deref(), Some("first"));
        assert_eq!(known(false).find(&path, &state.with_modified_ns(1)), None);
        assert_eq!(known(true).find(&path, &state), None, "fresh reads none");
        let place = known(false).place(path.parent().unwrap());
        let whole = fs::read(&place).unwrap();
        let second = memchr::memchr(b'\n', &whole).unwrap() + 1;
        for at in 0..whole.len() {
            let mut broken = whole.clone();
            broken[at] ^= 1;
            fs::write(&place, &broken).unwrap();
            let known = known(false);
            for (file, said, own) in [(&other, "first", at < second), (&path, "abc whole", at >= second)] {
                // a line feed that is gone joins two lines
                let lost = own || (at + 1 == second);
                let found = known.find(file, &state);
                assert!(found.is_none() || (!lost && found.as_deref() == Some(said)), "byte {at}: {found:?}");
            }
        }
        for end in second..whole.len() {
            fs::write(&place, &whole[..end]).unwrap();
            assert_eq!(known(false).find(&path, &state), None, "cut at {end}");
            assert_eq!(known(false).find(&other, &state).as_deref(), Some("first"), "cut at {end}");
        }
    }

    #[test]
    fn what_is_no_regular_file_is_neither_waited_for_nor_replaced() {
        let folder = Folder::new("odd-stamps");
        let known = || KnownHashes::new(&folder.file("stamps"), false);
        let path = folder.file("a.h5");
        fs::write(&path, "x").unwrap();
        let state = FileState::at(&path).unwrap();
        let place = known().place(path.parent().unwrap());
        fs::create_dir(folder.file("stamps")).unwrap();
        rustix::fs::mknodat(rustix::fs::CWD, &place, rustix::fs::FileType::Fifo, 0o600.into(), 0).unwrap();
        known().keep(&path, &state, "x");
        assert_eq!(known().find(&path, &state), None);
        assert!(!fs::metadata(&place).unwrap().is_file(), "it is still there");
    }

    #[test]
    fn the_last_line_about_a_file_counts_and_the_others_go() {
        let folder = Folder::new("last");
        let known = || KnownHashes::new(&folder.file("stamps"), false);
        let path = folder.file("a.h5");
        fs::write(&path, "x").unwrap();
        let state = FileState::at(&path).unwrap();
        known().keep(&folder.file("b.h5"), &state, "other");
        let writer = known();
        (0..SPARE + 4).for_each(|number| writer.keep(&path, &state, &number.to_string()));
        let last = (SPARE + 3).to_string();
        let place = known().place(path.parent().unwrap());
        for lines in [SPARE + 5, 2] {
            assert_eq!(fs::read_to_string(&place).unwrap().lines().count(), lines);
            assert_eq!(known().find(&path, &state), Some(last.clone()));
        }
        assert_eq!(known().find(&folder.file("b.h5"), &state).as_deref(), Some("other"));
    }
}
