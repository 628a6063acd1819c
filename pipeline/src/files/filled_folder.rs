//! Folders that this program fills with files: what it wrote there is listed with its hash, so that nothing else is
//! ever replaced.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::FileExt;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::replace::Replacement;
use super::temporary::sweep;
use super::{append_regular, open_regular, read_regular};
use crate::error::StoreError;

/// The list in such a folder: a line per file, BLAKE3 hash and name, as `b3sum --check` takes them. A name may have
/// several lines: what was written there before.
pub const LIST: &str = ".afmid-files";

/// The largest list that is read: a million files, each written ten times.
const MOST_LIST_BYTES: u64 = 1 << 30;

/// A folder that this program fills with files.
///
/// A file that it wrote is replaced as long as it is as it was written; a file of others, or one that somebody edited
/// since, never. Several threads and processes may fill one folder at once.
#[derive(Debug)]
pub struct FilledFolder {
    folder: PathBuf,
    /// Hashes of what was written under a name.
    listed: Mutex<HashMap<String, Vec<String>>>,
    /// Levels below the folder from which was removed what killed runs left.
    swept: Mutex<HashSet<PathBuf>>,
}

impl FilledFolder {
    /// A folder that exists; removes what killed runs left there and where the files lie that it lists. Errors: its
    /// list cannot be read.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        sweep(folder);
        let filled =
            Self { folder: folder.to_owned(), listed: Mutex::new(read_list(folder)?), swept: Mutex::default() };
        let names: Vec<String> = filled.listed().keys().cloned().collect();
        names.iter().for_each(|name| filled.sweep_level(name));
        Ok(filled)
    }

    /// Removes what killed runs left in the folder of a name, once; of levels below this folder alone.
    fn sweep_level(&self, name: &str) {
        let Some(level) = Path::new(name).parent().filter(|level| !level.as_os_str().is_empty()) else { return };
        let is_below = level.components().all(|part| matches!(part, Component::Normal(_)));
        let mut swept = self.swept.lock().unwrap_or_else(PoisonError::into_inner);
        if is_below && swept.insert(level.to_owned()) {
            sweep(&self.folder.join(level));
        }
    }

    /// Whether the file with this name lies there as it was written here, with this BLAKE3 hash in hexadecimal: it need
    /// not be written again.
    pub fn holds(&self, name: &str, blake3: &str) -> bool {
        let path = self.folder.join(name);
        let listed = self.listed().get(name).is_some_and(|hashes| hashes.iter().any(|hash| hash == blake3));
        listed
            && fs::symlink_metadata(&path).is_ok_and(|found| found.is_file())
            && hash(&path).is_ok_and(|h| h == blake3)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn listed(&self) -> MutexGuard<'_, HashMap<String, Vec<String>>> {
        self.listed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sees that nothing of others lies at a name in the folder (with `/` in levels below it). `earlier` knows files of
    /// earlier versions, which kept no list: it is asked where the list does not have the name. An empty file holds
    /// nothing that could be lost.
    ///
    /// Errors: the file is not one that was written here, or it was changed since; it cannot be read.
    pub fn require_own(&self, name: &str, earlier: impl FnOnce(&Path) -> bool) -> Result<(), StoreError> {
        let path = self.folder.join(name);
        let metadata = match fs::symlink_metadata(&path) {
            Ok(metadata) => metadata,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(StoreError::io("cannot be looked at", &path, &error)),
        };
        let refused = |found: &str| {
            StoreError::new(format!("{found}: it is not replaced"))
                .file(&path)
                .help("choose another place, or remove the file first if it is no longer needed")
        };
        if !metadata.is_file() {
            return Err(refused("exists and is no regular file"));
        }
        if metadata.len() == 0 {
            return Ok(());
        }
        let now = hash(&path).map_err(|error| StoreError::io("cannot be read", &path, &error))?;
        let is_listed = |listed: &HashMap<String, Vec<String>>| listed.get(name).map(|hashes| hashes.contains(&now));
        if is_listed(&self.listed()) == Some(true) {
            return Ok(());
        }
        // another process may have written it meanwhile: its line came before its file
        let now_listed = read_list(&self.folder)?;
        let found = is_listed(&now_listed);
        *self.listed() = now_listed;
        match found {
            Some(true) => Ok(()),
            Some(false) => Err(refused("was changed since afmid wrote it")),
            None if earlier(&path) => Ok(()),
            None => Err(refused("exists, and afmid did not write it")),
        }
    }

    /// Writes a file, whole or not at all, synced, and lists it. `fill` gets a name of its own in the same folder and
    /// leaves a closed file there.
    ///
    /// Errors: as [`FilledFolder::require_own`]; those of `fill`; the folder cannot be written.
    pub fn replace(
        &self,
        name: &str,
        earlier: impl FnOnce(&Path) -> bool,
        fill: impl FnOnce(&Path) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        self.require_own(name, earlier)?;
        self.sweep_level(name);
        let path = self.folder.join(name);
        let replacement = Replacement::new(&path)?;
        let temporary = replacement.temporary();
        let io = |error: std::io::Error| StoreError::io("cannot be written", &path, &error);
        let listed = || {
            let hash = hash(temporary).map_err(io)?;
            File::open(temporary).and_then(|file| file.sync_all()).map_err(io)?;
            // before the file is there: a kill in between leaves a line about what lies nowhere, not a file that nobody
            // knows
            self.list(name, hash)
        };
        let written = fill(temporary).and_then(|()| listed());
        replacement.take(written)
    }

    /// The same; a file that the list does not have stays, and is listed, if it has the bytes that `fill` makes: it may
    /// be of a version that kept no list, or copied without it, and nothing is lost.
    ///
    /// Errors: as there; such a file has other bytes.
    pub fn replace_or_same(
        &self,
        name: &str,
        fill: impl FnOnce(&Path) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let Err(refused) = self.require_own(name, |_| false) else {
            return self.replace(name, |_| false, fill);
        };
        let path = self.folder.join(name);
        let unknown = !self.listed().contains_key(name);
        if !(unknown && fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_file())) {
            return Err(refused);
        }
        let replacement = Replacement::new(&path)?;
        fill(replacement.temporary()).map_err(|error| replacement.named(error))?;
        let hash = |path: &Path| hash(path).map_err(|error| StoreError::io("cannot be read", path, &error));
        let (wanted, found) = (hash(replacement.temporary())?, hash(&path)?);
        if wanted != found {
            let problem =
                format!("exists, {LIST} does not list it, and it is not what would be written: it is not replaced");
            return Err(StoreError { problem, ..refused });
        }
        self.list(name, wanted)
    }

    /// The same with these bytes. Errors: as there.
    pub fn write_or_same(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let path = self.folder.join(name);
        let io = |error: std::io::Error| StoreError::io("cannot be written", &path, &error);
        self.replace_or_same(name, |temporary| fs::write(temporary, bytes).map_err(io))
    }

    /// As [`FilledFolder::replace`] for files that are none of the store's. Errors: those of `fill`, and as there.
    pub fn replace_with(
        &self,
        name: &str,
        earlier: impl FnOnce(&Path) -> bool,
        fill: impl FnOnce(&Path) -> std::io::Result<()>,
    ) -> Result<(), StoreError> {
        let path = self.folder.join(name);
        let fill =
            |temporary: &Path| fill(temporary).map_err(|error| StoreError::io("cannot be written", &path, &error));
        self.replace(name, earlier, fill)
    }

    /// The same with these bytes. Errors: as there.
    pub fn write(&self, name: &str, earlier: impl FnOnce(&Path) -> bool, bytes: &[u8]) -> Result<(), StoreError> {
        self.replace_with(name, earlier, |temporary| fs::write(temporary, bytes))
    }

    fn list(&self, name: &str, hash: String) -> Result<(), StoreError> {
        let mut listed = self.listed();
        let hashes = listed.entry(name.to_owned()).or_default();
        if hashes.contains(&hash) {
            return Ok(());
        }
        let path = self.folder.join(LIST);
        let append = || -> std::io::Result<()> {
            let mut file = append_regular(&path)?;
            // a line that a kill left half written spoils no other
            let mut last = [b'\n'];
            if let Some(end) = file.metadata()?.len().checked_sub(1) {
                file.read_exact_at(&mut last, end)?;
            }
            let begin = if last == [b'\n'] { "" } else { "\n" };
            file.write_all(format!("{begin}{}\n", line(name, &hash)).as_bytes())?;
            file.sync_data()
        };
        append().map_err(|error| StoreError::io("cannot be written", &path, &error))?;
        hashes.push(hash);
        Ok(())
    }
}

/// Hashes by name, as they stand in the folder's list now; none where there is no list. Errors: it cannot be read.
fn read_list(folder: &Path) -> Result<HashMap<String, Vec<String>>, StoreError> {
    let list = folder.join(LIST);
    match read_regular(&list, MOST_LIST_BYTES) {
        Ok(bytes) => Ok(parse(&String::from_utf8_lossy(&bytes))),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(HashMap::new()),
        Err(error) => Err(StoreError::io("cannot be read", &list, &error)),
    }
}

/// As `b3sum` has it: a name with a backslash or the end of a line in it is escaped, and its line begins with a
/// backslash.
fn line(name: &str, hash: &str) -> String {
    let escaped = name.replace('\\', "\\\\").replace('\n', "\\n");
    let mark = if escaped == name { "" } else { "\\" };
    format!("{mark}{hash}  {escaped}")
}

fn parse(text: &str) -> HashMap<String, Vec<String>> {
    let mut listed: HashMap<String, Vec<String>> = HashMap::new();
    for line in text.lines() {
        let (escaped, line) = line.strip_prefix('\\').map_or((false, line), |rest| (true, rest));
        let Some((hash, name)) = line.split_once("  ") else { continue };
        let whole = hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
        if whole && !name.is_empty() {
            let name = if escaped { unescaped(name) } else { name.to_owned() };
            listed.entry(name).or_default().push(hash.to_owned());
        }
    }
    listed
}

fn unescaped(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    let mut letters = name.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => out.extend(letters.next().map(|next| if next == 'n' { '\n' } else { next })),
            letter => out.push(letter),
        }
    }
    out
}

fn hash(path: &Path) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(open_regular(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::fixture::Folder;

    fn nobody(_: &Path) -> bool {
        false
    }

    #[test]
    fn what_was_written_is_replaced_and_what_others_wrote_or_edited_is_not() {
        let folder = Folder::new("filled");
        let own = FilledFolder::open(&folder.0).unwrap();
        own.write("a.csv", nobody, b"1").unwrap();
        own.write("a.csv", nobody, b"2").unwrap();
        // another process, which began earlier than the last change
        let again = FilledFolder::open(&folder.0).unwrap();
        again.write("a.csv", nobody, b"3").unwrap();
        own.write("a.csv", nobody, b"2").unwrap();
        again.write("new.csv", nobody, b"1").unwrap();
        own.write("new.csv", nobody, b"2").unwrap();
        fs::write(folder.file("a.csv"), "2").unwrap();
        again.write("a.csv", nobody, b"4").unwrap();
        fs::write(folder.file("a.csv"), "mine").unwrap();
        let error = again.write("a.csv", |_| true, b"5").unwrap_err();
        assert!(error.problem.contains("changed since"), "{error}");
        assert_eq!(fs::read(folder.file("a.csv")).unwrap(), b"mine");
        fs::write(folder.file("b.csv"), "theirs").unwrap();
        let error = again.write("b.csv", nobody, b"5").unwrap_err();
        assert!(error.problem.contains("afmid did not write it") && error.help.is_some(), "{error}");
        again.write("b.csv", |_| true, b"of an earlier version").unwrap();
        fs::create_dir(folder.file("c")).unwrap();
        assert!(again.write("c", |_| true, b"").is_err());
        std::os::unix::fs::symlink(folder.file("nowhere"), folder.file("link")).unwrap();
        assert!(again.write("link", |_| true, b"").is_err(), "what a link leads to is another's");
        fs::write(folder.file("reserved"), "").unwrap();
        again.write("reserved", nobody, b"x").unwrap();
        let mut names: Vec<String> =
            fs::read_dir(&folder.0).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        assert_eq!(names, [LIST, "a.csv", "b.csv", "c", "link", "new.csv", "reserved"]);
    }

    #[test]
    fn what_no_list_knows_stays_unless_it_is_the_same() {
        let folder = Folder::new("same");
        let own = FilledFolder::open(&folder.0).unwrap();
        let put = |bytes: &[u8]| own.write_or_same("a", bytes);
        fs::write(folder.file("a"), "other").unwrap();
        let error = put(b"mine").unwrap_err();
        assert!(error.problem.contains("not what would be written") && error.help.is_some(), "{error}");
        assert_eq!(fs::read(folder.file("a")).unwrap(), b"other");
        put(b"other").unwrap();
        // it is listed now
        put(b"mine").unwrap();
        fs::write(folder.file("a"), "edited").unwrap();
        assert!(put(b"edited").unwrap_err().problem.contains("changed since"));
        assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 2, "the file and the list");
    }

    #[test]
    fn what_lies_there_as_it_was_written_is_held_and_the_levels_of_its_files_are_swept() {
        let folder = Folder::new("held");
        fs::create_dir(folder.file("below")).unwrap();
        let own = FilledFolder::open(&folder.0).unwrap();
        own.write("below/a", nobody, b"1").unwrap();
        let one = blake3::hash(b"1").to_hex();
        assert!(own.holds("below/a", &one) && !own.holds("below/a", &blake3::hash(b"2").to_hex()));
        fs::write(folder.file("b"), "1").unwrap();
        assert!(!own.holds("b", &one), "nobody listed it");
        let left = folder.file(&format!("below/.a.{}.4194999.0.tmp", crate::files::host()));
        fs::write(&left, "x").unwrap();
        FilledFolder::open(&folder.0).unwrap();
        assert!(!left.exists());
        fs::write(&left, "x").unwrap();
        fs::remove_file(folder.file(LIST)).unwrap();
        FilledFolder::open(&folder.0).unwrap().write("below/c", nobody, b"1").unwrap();
        assert!(!left.exists());
        fs::write(folder.file("below/a"), "2").unwrap();
        assert!(!own.holds("below/a", &one), "somebody edited it");
    }

    #[test]
    fn odd_names_and_half_lines_come_back() {
        let folder = Folder::new("lines");
        let own = FilledFolder::open(&folder.0).unwrap();
        fs::write(folder.file(LIST), "0123456789abcdef".repeat(2)).unwrap();
        for name in ["a  b", "a\\n", "ä\n"] {
            own.write(name, nobody, name.as_bytes()).unwrap();
        }
        let again = FilledFolder::open(&folder.0).unwrap();
        for name in ["a  b", "a\\n", "ä\n"] {
            again.write(name, nobody, b"other").unwrap();
        }
    }
}
