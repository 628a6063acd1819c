//! Names of temporary files: whose they are, and which of them nobody will finish.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// A temporary file that nobody has touched for a day has no owner any more.
const STALE: Duration = Duration::from_secs(24 * 3600);

pub(super) fn folder_of(path: &Path) -> &Path {
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
pub(crate) fn host() -> &'static str {
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
pub(crate) fn stale(path: &Path, name: &str) -> bool {
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

/// Sweeps what killed runs left beside a result file. The whole folder is listed: once per command, not per file.
pub fn sweep_beside(path: &Path) {
    sweep(folder_of(path), &format!(".{}.", file_name(path)));
}
