//! Files that are either whole or not there: written under a temporary name, synced, renamed, the folder synced.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use crate::runner::{RunInfo, RunResult, StageRecord, StageResult};
use crate::store::{self, ResultWriter, RunHead, StoreError};

/// A temporary file that nobody has touched for a day has no owner any more.
const STALE: Duration = Duration::from_secs(24 * 3600);

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
struct Replacement {
    path: PathBuf,
    temporary: PathBuf,
}

impl Replacement {
    /// Nothing is written yet. Errors: the folder is missing.
    fn new(path: &Path) -> Result<Self, StoreError> {
        if !folder_of(path).is_dir() {
            return Err(StoreError::new("its folder does not exist").file(path).help("make the folder first"));
        }
        Ok(Self { path: path.to_owned(), temporary: temporary_path(path) })
    }

    /// Takes the place, once it is `written` and synced. Errors: those of writing it; it cannot be renamed, or the folder not be synced.
    fn take(self, written: Result<(), StoreError>) -> Result<(), StoreError> {
        let Self { path, temporary } = &self;
        let io = |doing: &str, error: &std::io::Error| StoreError::io(doing, path, error);
        written
            .and_then(|()| fs::rename(temporary, path).map_err(|error| io("cannot be renamed", &error)))
            .map_err(|error| self.told(error))?;
        File::open(folder_of(path))
            .and_then(|folder| folder.sync_all())
            .map_err(|error| io("its folder cannot be synced", &error))
    }

    /// The error without the temporary name, which is gone then and tells nobody anything.
    fn told(&self, error: StoreError) -> StoreError {
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
    sweep_beside(path);
    replace_file(path, |temporary| {
        store::write_result(temporary, run).map_err(|error| StoreError { file: path.to_owned(), ..error })
    })
}

/// A result file in the making: what is at its path stays until it is whole. As [`write_result`], stage by stage.
pub(crate) struct PendingResult {
    // before the replacement, which removes the file
    writer: ResultWriter,
    replacement: Replacement,
    /// The file's length when it was last on its way to the disk.
    sent: u64,
}

/// What a file must grow by to be sent to the disk before it ends: less is there in no time.
const SHARE: u64 = 1 << 20;

impl PendingResult {
    /// Begins the file beside `path`. Errors: as [`replace_file`].
    pub(crate) fn new(path: &Path, run: &RunHead) -> Result<Self, StoreError> {
        sweep_beside(path);
        let replacement = Replacement::new(path)?;
        match ResultWriter::new(&replacement.temporary, run) {
            Ok(writer) => Ok(Self { writer, replacement, sent: 0 }),
            Err(error) => Err(replacement.told(error)),
        }
    }

    /// The place in the plan of the stage that is to be written next. None: all are written.
    pub(crate) fn wanted(&self) -> Option<usize> {
        self.writer.wanted()
    }

    /// Writes the stage that is wanted. Errors: the file cannot be written; an artifact is not valid.
    pub(crate) fn stage(&mut self, stage: &StageRecord) -> Result<(), StoreError> {
        self.writer.stage(stage).map_err(|error| self.replacement.told(error))
    }

    /// The file as it is, if it has grown so much that another thread should send it to the disk: little is left to wait for when it ends.
    pub(crate) fn next_share(&mut self) -> Option<File> {
        // one that cannot be opened is told of at the end
        let file = File::open(&self.replacement.temporary).ok()?;
        let length = file.metadata().ok()?.len();
        (length >= self.sent + SHARE).then(|| {
            self.sent = length;
            file
        })
    }

    /// Puts the whole file in its place. Errors: as [`replace_file`].
    pub(crate) fn finish(self, info: &RunInfo) -> Result<(), StoreError> {
        let Self { writer, replacement, .. } = self;
        let written = writer.finish(info);
        replacement.take(written)
    }
}

/// A stage's file that is written, and not yet sealed, synced and in its place.
pub(crate) struct PendingStage(Replacement);

impl PendingStage {
    /// Writes the file beside `path`. Errors: as [`replace_file`]; an artifact is not valid.
    pub(super) fn write(path: &Path, result: &StageResult) -> Result<Self, StoreError> {
        let replacement = Replacement::new(path)?;
        match store::write_unsealed_stage(&replacement.temporary, result) {
            Ok(()) => Ok(Self(replacement)),
            Err(error) => Err(replacement.told(error)),
        }
    }

    /// Seals and syncs the file and puts it in its place: nothing here waits for the HDF5 library. Errors: as [`replace_file`].
    pub(crate) fn finish(self) -> Result<(), StoreError> {
        let sealed = store::seal(&self.0.temporary);
        self.0.take(sealed)
    }
}

/// Sweeps what killed runs left beside a result file.
fn sweep_beside(path: &Path) {
    sweep(folder_of(path), &format!(".{}.", file_name(path)));
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
