//! The ledger: what became of each data set, a small file each, so that processes share neither lock nor database.

use std::collections::HashSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use afmid_pipeline::files::{read_regular, replace_with, sweep};
use serde::{Deserialize, Serialize};

use super::dataset::result_name;
use super::harvest::Harvest;

/// What became of a data set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Layout of these files.
    pub version: u32,
    /// The data set.
    pub name: String,
    /// One hash of all stages' content addresses; none if the files could not be read.
    pub key: Option<String>,
    /// Bytes of the result file, from [`Ledger::finish`]; none if the run failed.
    pub result_bytes: Option<u64>,
    /// Why it failed; none if it did not.
    pub error: Option<String>,
    /// What the run found.
    pub found: Harvest,
}

/// How every entry begins.
const HEAD: &[u8] = b"{\n  \"version\": ";
/// The largest entry that is read.
const MOST_BYTES: u64 = 64 << 20;

/// The layout that this version writes.
const VERSION: u32 = 2;

impl Entry {
    /// A run that failed.
    pub fn failed(name: &str, key: Option<String>, error: String) -> Self {
        let (version, name) = (VERSION, name.to_owned());
        Self { version, name, key, result_bytes: None, error: Some(error), found: Harvest::default() }
    }

    /// A run that went through.
    pub fn done(name: &str, key: String, found: Harvest) -> Self {
        let (version, name) = (VERSION, name.to_owned());
        Self { version, name, key: Some(key), result_bytes: None, error: None, found }
    }

    /// Whether it went through.
    pub fn is_done(&self) -> bool {
        self.error.is_none()
    }
}

/// A batch's folder.
#[derive(Debug, Clone)]
pub struct Ledger {
    folder: PathBuf,
}

impl Ledger {
    /// In the folder of results; removes what killed runs left in both. Errors: its own folder cannot be made.
    pub fn open(folder: &Path) -> std::io::Result<Self> {
        let own = folder.join("ledger");
        std::fs::create_dir_all(&own)?;
        [folder, &own].into_iter().for_each(sweep);
        Ok(Self { folder: folder.to_owned() })
    }

    /// Where the result of a data set lies.
    pub fn result(&self, name: &str) -> PathBuf {
        self.folder.join(result_name(name))
    }

    fn place(&self, name: &str) -> PathBuf {
        self.folder.join("ledger").join(format!("{name}.json"))
    }

    /// What became of a data set; none if nothing is known, or what is there is damaged or of another layout: then it
    /// is run again.
    pub fn read(&self, name: &str) -> Option<Entry> {
        let entry: Entry = serde_json::from_slice(&read_regular(&self.place(name), MOST_BYTES).ok()?).ok()?;
        (entry.version == VERSION && entry.name == name).then_some(entry)
    }

    /// Keeps what became of a data set, whole or not at all. Errors: the folder cannot be written.
    pub fn write(&self, entry: &Entry) -> Result<(), String> {
        let text = serde_json::to_vec_pretty(entry).map_err(|error| error.to_string())?;
        let place = self.place(&entry.name);
        match read_regular(&place, MOST_BYTES) {
            Ok(there) if there.is_empty() || there.starts_with(HEAD) => {}
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            _ => return Err(format!("{} is no entry of a ledger: it is not replaced", place.display())),
        }
        replace_with(&place, |temporary| std::fs::write(temporary, &text)).map_err(|error| error.to_string())
    }

    /// Keeps that a run went through, with the length of the result file as it lies there now. Errors: as
    /// [`Self::write`]; there is no result file.
    ///
    /// The same data set may have been run twice at once, and results of one content differ in length by what
    /// `/entry/run` says of the run: the last writer here looks at the file after that, and one that replaces the file
    /// still later writes after it.
    pub fn finish(&self, mut entry: Entry) -> Result<Entry, String> {
        let path = self.result(&entry.name);
        let length = || match std::fs::metadata(&path) {
            Ok(there) => Ok(Some(there.len())),
            Err(error) => Err(format!("{}: {error}", path.display())),
        };
        entry.result_bytes = length()?;
        loop {
            self.write(&entry)?;
            let there = length()?;
            if there == entry.result_bytes {
                return Ok(entry);
            }
            entry.result_bytes = there;
        }
    }

    /// How many data sets it has beside these.
    pub fn beside(&self, names: &HashSet<&str>) -> usize {
        let listed = std::fs::read_dir(self.folder.join("ledger")).into_iter().flatten().flatten();
        let name = |file: std::fs::DirEntry| Some(file.file_name().to_str()?.strip_suffix(".json")?.to_owned());
        listed.filter_map(name).filter(|name| !name.starts_with('.') && !names.contains(&name[..])).count()
    }

    /// Whether the result file of a finished data set is there, as long as it was.
    pub fn holds(&self, entry: &Entry) -> bool {
        let there = std::fs::metadata(self.result(&entry.name)).map(|metadata| metadata.len()).ok();
        entry.is_done() && there.is_some() && there == entry.result_bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_comes_back_and_a_damaged_one_is_unknown() {
        let folder = tempfile::tempdir().unwrap();
        let ledger = Ledger::open(folder.path()).unwrap();
        assert!(ledger.read("a").is_none());
        let done = Entry::done("a", "k".into(), Harvest { verdict: Some("clean".into()), ..Harvest::default() });
        assert!(ledger.finish(done.clone()).is_err(), "there is no result file");
        std::fs::write(ledger.result("a"), "abc").unwrap();
        let done = ledger.finish(done).unwrap();
        assert_eq!(ledger.read("a"), Some(done.clone()));
        assert!(ledger.holds(&done) && done.result_bytes == Some(3));
        std::fs::write(ledger.result("a"), "ab").unwrap();
        assert!(!ledger.holds(&done), "it is cut short");
        let place = folder.path().join("ledger/a.json");
        let whole = std::fs::read(&place).unwrap();
        std::fs::write(&place, &whole[..whole.len() / 2]).unwrap();
        assert!(ledger.read("a").is_none());
        ledger.write(&Entry::failed("a", None, "no".into())).unwrap();
        std::fs::write(&place, "my notes").unwrap();
        assert!(ledger.write(&done).unwrap_err().contains("no entry of a ledger"));
        ledger.write(&Entry::failed("b", None, "no".into())).unwrap();
        assert!(!ledger.read("b").unwrap().is_done());
    }
}
