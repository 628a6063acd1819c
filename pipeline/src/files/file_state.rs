//! What tells two states of a file apart without reading it.

use std::fs::{File, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// A file changed this recently may change again within one tick of its time stamps, which some file systems count in
/// seconds: its state alone does not show that.
const SETTLED: Duration = Duration::from_secs(2);

/// Device, inode, size and both time stamps of a file. The time of the last change of state (`ctime`) is the system's
/// own: programs can set the time of modification back, not this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FileState {
    size: u64,
    modified_ns: i128,
    changed_ns: i128,
    inode: u64,
    device: u64,
}

impl std::fmt::Display for FileState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { size, modified_ns, changed_ns, inode, device } = self;
        write!(f, "{size} {modified_ns} {changed_ns} {inode} {device}")
    }
}

impl From<&Metadata> for FileState {
    fn from(metadata: &Metadata) -> Self {
        let nanoseconds = |seconds: i64, rest: i64| i128::from(seconds) * 1_000_000_000 + i128::from(rest);
        Self {
            size: metadata.len(),
            modified_ns: nanoseconds(metadata.mtime(), metadata.mtime_nsec()),
            changed_ns: nanoseconds(metadata.ctime(), metadata.ctime_nsec()),
            inode: metadata.ino(),
            device: metadata.dev(),
        }
    }
}

impl FileState {
    /// Of an open file. Errors: the system's.
    pub(crate) fn of(file: &File) -> std::io::Result<Self> {
        Ok(Self::from(&file.metadata()?))
    }

    /// Of the file that lies at a path now. Errors: the system's.
    pub(crate) fn at(path: &Path) -> std::io::Result<Self> {
        Ok(Self::from(&std::fs::metadata(path)?))
    }

    /// Bytes.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// Whether every later change must show in the state: the last one lies some time back. A clock that was set back
    /// counts as no.
    pub(crate) fn is_settled(&self) -> bool {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |now| now.as_nanos());
        let last = self.changed_ns.max(self.modified_ns);
        i128::try_from(now).is_ok_and(|now| now - last > SETTLED.as_nanos() as i128)
    }

    #[cfg(test)]
    pub(crate) fn with_modified_ns(self, modified_ns: i128) -> Self {
        Self { modified_ns, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::FileState;
    use crate::files::fixture::Folder;

    #[test]
    fn a_change_shows_although_size_and_time_of_modification_are_set_back() {
        let folder = Folder::new("state");
        let path = folder.file("a");
        std::fs::write(&path, "one").unwrap();
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        let modified = file.metadata().unwrap().modified().unwrap();
        let before = FileState::of(&file).unwrap();
        assert!(!before.is_settled(), "it was just written");
        // longer than a tick of the time stamps
        std::thread::sleep(std::time::Duration::from_millis(50));
        std::fs::write(&path, "two").unwrap();
        file.set_modified(modified).unwrap();
        let after = FileState::at(&path).unwrap();
        assert_eq!((after.size, after.modified_ns, after.inode), (before.size, before.modified_ns, before.inode));
        assert_ne!(after, before);
    }
}
