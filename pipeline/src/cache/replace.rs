//! Files that are either whole or not there: written under a temporary name, synced, renamed, the folder synced.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use crate::runner::RunResult;
use crate::store::{self, StoreError};

/// A temporary file that nobody has touched for a day has no owner any more.
const STALE: Duration = Duration::from_secs(24 * 3600);

/// Writes a file so that a kill at any moment leaves the old one, the new one or none, never half of one.
///
/// `write` gets a name of its own in the same folder and leaves a closed file there.
/// Errors: those of `write`; the folder is missing or cannot be written.
pub fn replace_file(path: &Path, write: impl FnOnce(&Path) -> Result<(), StoreError>) -> Result<(), StoreError> {
    let folder = folder_of(path);
    let temporary = temporary_path(path);
    let io = |doing: &str, error: &std::io::Error| StoreError::io(doing, path, error);
    if !folder.is_dir() {
        return Err(StoreError::new("its folder does not exist").file(path).help("make the folder first"));
    }
    let written = write(&temporary)
        .and_then(|()| {
            File::open(&temporary).and_then(|file| file.sync_all()).map_err(|error| io("cannot be synced", &error))
        })
        .and_then(|()| fs::rename(&temporary, path).map_err(|error| io("cannot be renamed", &error)));
    if let Err(error) = written {
        // nothing more can be done about a file that cannot be removed: the next sweep takes it
        let _ = fs::remove_file(&temporary);
        // the temporary name is gone and tells nobody anything
        let problem = error.problem.replace(&*temporary.to_string_lossy(), &path.to_string_lossy());
        let file = if error.file == temporary { path.to_owned() } else { error.file };
        return Err(StoreError { file, problem, ..error });
    }
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(|error| io("its folder cannot be synced", &error))
}

/// As [`replace_file`], for files that are none of the store's. Errors: those of `fill`, and as there.
pub fn replace_with(path: &Path, fill: impl FnOnce(&Path) -> std::io::Result<()>) -> Result<(), StoreError> {
    replace_file(path, |temporary| fill(temporary).map_err(|error| StoreError::io("cannot be written", path, &error)))
}

/// As [`replace_file`] with these bytes, without waiting for the disk: after a power cut the file may be empty. For what is only convenient.
pub(crate) fn replace_unsynced(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let temporary = temporary_path(path);
    fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path)).map_err(|error| {
        // as above: the next sweep takes it
        let _ = fs::remove_file(&temporary);
        StoreError::io("cannot be written", path, &error)
    })
}

/// Finds out whether [`replace_file`] could write `path`, by making a temporary file beside it and removing it. Errors: why not, in the
/// system's words.
pub fn probe(path: &Path) -> std::io::Result<()> {
    let temporary = temporary_path(path);
    File::create_new(&temporary)?;
    fs::remove_file(&temporary)
}

/// Writes a run's result file, whole or not at all, and sweeps what killed runs left beside it. Errors: as [`replace_file`].
pub fn write_result(path: &Path, run: &RunResult) -> Result<(), StoreError> {
    let prefix = format!(".{}.", file_name(path));
    sweep(folder_of(path), &prefix);
    replace_file(path, |temporary| {
        store::write_result(temporary, run).map_err(|error| StoreError { file: path.to_owned(), ..error })
    })
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// A path beside `path` that nobody else uses; [`sweep`] removes what a dead process left there.
pub(crate) fn temporary_path(path: &Path) -> PathBuf {
    folder_of(path).join(temporary_name(path))
}

/// `.NAME.HOST.PID.COUNT.tmp`: no other attempt has it, on this machine, in another container on it, or on another machine that shares the folder.
fn temporary_name(path: &Path) -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!(".{}.{}.{}.{count}.tmp", file_name(path), host(), std::process::id())
}

/// Where this process's number means this process: twelve digits for the machine since its start, its name and the namespace of process numbers.
/// Names alone are not enough: cloned machines share them, and containers of one machine share the name but not the numbers.
pub(super) fn host() -> &'static str {
    static HOST: LazyLock<String> = LazyLock::new(|| {
        let mut hasher = blake3::Hasher::new();
        for file in ["/proc/sys/kernel/random/boot_id", "/proc/sys/kernel/hostname", "/etc/hostname"] {
            // what a system does not have tells nothing apart
            hasher.update(&fs::read(file).unwrap_or_default());
        }
        let namespace = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        hasher.update(namespace.to_string_lossy().as_bytes());
        hasher.finalize().to_hex()[..12].to_owned()
    });
    &HOST
}

/// Removes temporary files whose names begin with `prefix` and whose owner is dead, or that are older than a day.
///
/// Files that cannot be removed stay: another process may have been faster.
pub fn sweep(folder: &Path, prefix: &str) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') && name.starts_with(prefix) && name.ends_with(".tmp") && stale(&entry.path(), &name) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether nobody writes a temporary file any more.
pub(super) fn stale(path: &Path, name: &str) -> bool {
    let modified = fs::metadata(path).and_then(|metadata| metadata.modified());
    let age = modified.ok().and_then(|modified| SystemTime::now().duration_since(modified).ok());
    if age.is_some_and(|age| age > STALE) {
        return true;
    }
    let mut parts = name.trim_end_matches(".tmp").rsplit('.');
    match (parts.next(), parts.next().and_then(|pid| pid.parse::<u32>().ok()), parts.next()) {
        (Some(_), Some(pid), Some(host)) if host == self::host() => dead(pid),
        _ => false,
    }
}

/// Whether a process of this machine has ended; unknown counts as alive.
fn dead(pid: u32) -> bool {
    let processes = PathBuf::from("/proc");
    processes.join("self").exists() && !processes.join(pid.to_string()).exists()
}
