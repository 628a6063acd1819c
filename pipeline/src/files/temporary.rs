//! Names of temporary files: whose they are, and which of them nobody will finish.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use rustix::process::{Pid, test_kill_process};

/// On another machine nothing tells whether a process lives: its temporary file counts as left behind once nobody has
/// touched it for a day.
const STALE: Duration = Duration::from_secs(24 * 3600);

/// Digits that name a machine.
const HOST_DIGITS: usize = 12;

pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Folders where this process has or had files under temporary names. A process has one set of them: whatever ends it
/// sweeps them all.
static FOLDERS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// A path beside `path` that nobody else uses; [`sweep`] removes what a dead process left there.
pub(crate) fn temporary_path(path: &Path) -> PathBuf {
    let folder = folder_of(path);
    // the working directory does not change, but absolute paths are the same folder once
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).insert(whole);
    folder.join(temporary_name(path))
}

/// The folders where this process has made temporary names so far.
pub(super) fn own_folders() -> Vec<PathBuf> {
    FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
}

/// `.NAME.HOST.PID-STARTED.COUNT.tmp`: no other attempt has it, on this machine, in another container on it, or on
/// another machine that shares the folder. A process is known by its number and the moment of its start: numbers are
/// given again.
fn temporary_name(path: &Path) -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    static OWNER: LazyLock<String> = LazyLock::new(|| {
        let pid = std::process::id();
        started(pid).map_or_else(|| pid.to_string(), |started| format!("{pid}-{started}"))
    });
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!(".{}.{}.{}.{count}.tmp", file_name(path), host(), *OWNER)
}

/// Where this process's number means this process: twelve digits for the machine since its start, its name and the
/// namespace of process numbers. Names alone are not enough: cloned machines share them, and containers of one machine
/// share the name but not the numbers.
pub(crate) fn host() -> &'static str {
    static HOST: LazyLock<String> = LazyLock::new(|| {
        let mut hasher = blake3::Hasher::new();
        for file in ["/proc/sys/kernel/random/boot_id", "/proc/sys/kernel/hostname", "/etc/hostname"] {
            // what a system does not have tells nothing apart
            hasher.update(&fs::read(file).unwrap_or_default());
        }
        let namespace = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        hasher.update(namespace.to_string_lossy().as_bytes());
        hasher.finalize().to_hex()[..HOST_DIGITS].to_owned()
    });
    &HOST
}

/// A temporary name, taken apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TemporaryName<'a> {
    /// The name that the file is going to take.
    pub(crate) target: &'a str,
    host: &'a str,
    pid: u32,
    /// When the process was started; earlier versions did not state it.
    started: Option<u64>,
}

impl<'a> TemporaryName<'a> {
    /// None: it is not exactly what this program gives, and the file is another's.
    pub(crate) fn parse(name: &'a str) -> Option<Self> {
        let mut parts = name.strip_prefix('.')?.strip_suffix(".tmp")?.rsplitn(4, '.');
        let [count, owner, host, target] = [parts.next()?, parts.next()?, parts.next()?, parts.next()?];
        let (pid, started) = match owner.split_once('-') {
            Some((pid, started)) => (pid, Some(number(started)?)),
            None => (owner, None),
        };
        let is_host = host.len() == HOST_DIGITS && host.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        number(count)?;
        let pid = u32::try_from(number(pid)?).ok()?;
        (is_host && !target.is_empty()).then_some(Self { target, host, pid, started })
    }

    /// Whether this process is its owner.
    pub(super) fn is_own(&self) -> bool {
        self.host == host() && self.pid == std::process::id()
    }

    /// Whether its owner is known to live, or to be gone; none if nothing tells.
    fn lives(&self) -> Option<bool> {
        if self.host != host() {
            return None;
        }
        let pid = i32::try_from(self.pid).ok().and_then(Pid::from_raw)?;
        // a process that may not be signalled is there
        if test_kill_process(pid).is_err_and(|error| error == rustix::io::Errno::SRCH) {
            return Some(false);
        }
        match (self.started, started(self.pid)) {
            (Some(then), Some(now)) => Some(then == now),
            _ => Some(true),
        }
    }
}

/// Digits alone: `+1` and the like are other names.
fn number(text: &str) -> Option<u64> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok()).flatten()
}

/// When a process was started, in ticks since the machine's start; none if the system does not say.
fn started(pid: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // the name, in brackets, may hold anything; behind it the third column follows, the start is the 22nd
    stat.rsplit_once(')')?.1.split_ascii_whitespace().nth(19)?.parse().ok()
}

/// Removes the temporary files of a folder that nobody will finish: those with exactly this program's names whose owner
/// is dead, or which another machine left a day ago.
///
/// Files that cannot be removed stay: another process may have been faster.
pub fn sweep(folder: &Path) {
    sweep_where(folder, |_| true);
}

/// The same for one file: what killed runs left beside it.
pub fn sweep_beside(path: &Path) {
    let own = file_name(path);
    sweep_where(folder_of(path), |target| target == own);
}

/// As [`sweep`], for a folder and all folders below it; links are not followed.
pub fn sweep_below(folder: &Path) {
    sweep(folder);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            sweep_below(&entry.path());
        }
    }
}

/// Whether a file has exactly a temporary name of this program's: it is under way, or left behind.
pub fn is_temporary(path: &Path) -> bool {
    path.file_name().and_then(|name| name.to_str()).and_then(TemporaryName::parse).is_some()
}

fn sweep_where(folder: &Path, of: impl Fn(&str) -> bool) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str().and_then(TemporaryName::parse) else { continue };
        let path = entry.path();
        if of(name.target) && stale(&path, &name) {
            let _ = fs::remove_file(path);
        }
    }
}

/// Whether nobody writes a temporary file any more. A folder or link of that name is none.
pub(crate) fn stale(path: &Path, name: &TemporaryName) -> bool {
    let Some(metadata) = fs::symlink_metadata(path).ok().filter(fs::Metadata::is_file) else { return false };
    match name.lives() {
        Some(lives) => !lives,
        None => {
            let age = metadata.modified().ok().and_then(|modified| SystemTime::now().duration_since(modified).ok());
            age.is_some_and(|age| age > STALE)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::fixture::Folder;

    /// `pid_max` is at most 2^22.
    const NOBODY: u32 = 4_194_999;

    fn aged(path: &Path, days: u64) {
        fs::write(path, "x").unwrap();
        let then = SystemTime::now() - Duration::from_secs(days * 24 * 3600 + 60);
        fs::File::options().write(true).open(path).unwrap().set_modified(then).unwrap();
    }

    #[test]
    fn names_come_back_and_others_are_none() {
        let path = temporary_path(Path::new("a/k.b.h5"));
        let name = path.file_name().unwrap().to_str().unwrap();
        let parsed = TemporaryName::parse(name).unwrap();
        assert_eq!((parsed.target, parsed.host, parsed.pid), ("k.b.h5", host(), std::process::id()));
        assert_eq!(parsed.lives(), Some(true));
        let earlier = TemporaryName::parse(".k.h5.0123456789ab.12.3.tmp").unwrap();
        assert_eq!((earlier.target, earlier.pid, earlier.started, earlier.lives()), ("k.h5", 12, None, None));
        for other in [
            ".notes.tmp",
            ".k.h5.0123456789ab.12.tmp",
            ".k.h5.another-host.12.3.tmp",
            ".k.h5.0123456789AB.12.3.tmp",
            ".k.h5.0123456789ab.+12.3.tmp",
            ".k.h5.0123456789ab.12-.3.tmp.bak",
            ".k.h5.0123456789ab.12.x.tmp",
            "k.h5.0123456789ab.12.3.tmp",
            ".0123456789ab.12.3.tmp",
            ".tmp",
            "",
        ] {
            assert_eq!(TemporaryName::parse(other), None, "{other}");
        }
    }

    #[test]
    fn only_what_dead_processes_left_is_swept() {
        let folder = Folder::new("swept");
        let (pid, host) = (std::process::id(), host());
        let begun = started(pid).unwrap_or_default();
        let stay = [
            format!(".k.h5.{host}.{pid}-{begun}.0.tmp"),
            format!(".k.h5.{host}.{pid}.0.tmp"),
            format!(".k.h5.{host}.1.0.tmp"),
            ".notes.tmp".to_owned(),
            ".k.h5.mine.tmp".to_owned(),
        ];
        let go = [
            format!(".k.h5.{host}.{NOBODY}-1.0.tmp"),
            format!(".k.h5.{host}.{NOBODY}.0.tmp"),
            ".k.h5.0123456789ab.1-1.0.tmp".to_owned(),
        ];
        stay.iter().chain(&go).for_each(|name| aged(&folder.file(name), 3));
        let recent = folder.file(".k.h5.0123456789ab.1-1.1.tmp");
        aged(&recent, 0);
        // a number that was given again
        let again = folder.file(&format!(".k.h5.{host}.{pid}-{}.0.tmp", begun + 1));
        aged(&again, 0);
        sweep_beside(&folder.file("other.h5"));
        assert!(go.iter().all(|name| folder.file(name).exists()), "they are another file's");
        sweep_beside(&folder.file("k.h5"));
        assert!(go.iter().all(|name| !folder.file(name).exists()));
        assert!(stay.iter().all(|name| folder.file(name).exists()) && recent.exists());
        assert_eq!(again.exists(), begun == 0);
    }

    #[test]
    fn folders_below_are_swept_and_what_links_lead_to_is_not() {
        let (folder, other) = (Folder::new("below"), Folder::new("elsewhere"));
        let name = format!(".a.h5.{}.{NOBODY}.0.tmp", host());
        fs::create_dir_all(folder.file("a/b")).unwrap();
        std::os::unix::fs::symlink(&other.0, folder.file("link")).unwrap();
        let go = [folder.file(&name), folder.file("a").join(&name), folder.file("a/b").join(&name)];
        go.iter().for_each(|path| fs::write(path, "x").unwrap());
        fs::write(other.file(&name), "x").unwrap();
        sweep_below(&folder.0);
        assert!(go.iter().all(|path| !path.exists()) && other.file(&name).exists());
        assert!(is_temporary(&go[0]) && !is_temporary(Path::new("a.h5")));
    }

    #[test]
    fn every_folder_of_a_temporary_name_is_known() {
        let folder = Folder::new("known-folders");
        temporary_path(&folder.file("a/b.h5"));
        assert!(own_folders().contains(&folder.file("a")));
    }
}
