//! Files that a command had under way.

use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use super::common;

/// A folder for commands with a cache and a folder for temporary files of their own.
pub struct Place(tempfile::TempDir);

impl Place {
    /// One with both folders.
    pub fn new() -> Self {
        let place = Self(tempfile::tempdir().expect("a folder"));
        ["cache", "tmp"].iter().for_each(|name| std::fs::create_dir(place.path(name)).expect("a folder"));
        place
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.0.path()
    }

    /// A file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program in it.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = common::command(self.folder(), arguments);
        command.env("TMPDIR", self.path("tmp")).env("AFMID_CACHE", self.path("cache")).env_remove("AFMID_DATA");
        command
    }

    /// What lies below it under a temporary name, and all that lies in the folder for temporary files.
    pub fn leftovers(&self) -> Vec<PathBuf> {
        let temporary = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            name.ends_with(".tmp") || (path.starts_with(self.path("tmp")) && *path != self.path("tmp"))
        };
        below(self.folder()).into_iter().filter(temporary).collect()
    }
}

/// All files and folders below a folder.
pub fn below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            found.extend(below(&path));
        }
        found.push(path);
    }
    found.sort();
    found
}

/// How many files of a folder end so.
pub fn count(folder: &Path, ending: &str) -> usize {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            !name.starts_with('.') && name.ends_with(ending)
        })
        .count()
}

/// Waits until something is so, a minute at most; whether the process still runs.
pub fn wait_until(child: &mut Child, is_so: impl Fn() -> bool) -> bool {
    let most = Instant::now() + Duration::from_secs(60);
    while !is_so() && Instant::now() < most {
        if child.try_wait().expect("a child").is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(is_so(), "nothing happened within a minute");
    child.try_wait().expect("a child").is_none()
}

/// Sends a signal.
pub fn signal(child: &Child, name: &str) {
    let sent = Command::new("sh").args(["-c", &format!("kill -{name} {}", child.id())]).status().expect("sh starts");
    assert!(sent.success(), "no signal {name}");
}
