//! What this process, or one that is dead, put into folders for a while.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rustix::process::{Pid, test_kill_process};
use tempfile::TempDir;

use super::temporary::{TemporaryName, host, own_folders};

/// Begins the names of folders in the system's one for temporary files.
const TITLE: &str = "afmid-";

/// A folder in the system's one for temporary files, removed when it is dropped. Its name says whose it is: what a kill
/// leaves is found.
///
/// Errors: the system refuses.
pub fn temporary_folder(what: &str) -> std::io::Result<TempDir> {
    tempfile::Builder::new().prefix(&format!("{TITLE}{what}.{}.{}.", host(), std::process::id())).tempdir()
}

/// Removes what this process has under way in a folder: files under temporary names, folders of [`temporary_folder`].
/// For a process that ends without its own tidying up; what cannot be removed is left to the next one. Whether there
/// was something.
pub fn sweep_own(folder: &Path) -> bool {
    let own = std::process::id();
    each(
        folder,
        |name| TemporaryName::parse(name).is_some_and(|name| name.is_own()),
        |name| folder_of(name) == Some(own),
    )
}

/// The same in all folders where this process has put files under temporary names so far, and in the system's one.
pub fn sweep_all_own() -> bool {
    let folders = own_folders().into_iter().chain([std::env::temp_dir()]);
    folders.map(|folder| sweep_own(&folder)).fold(false, |found, one| found | one)
}

/// Removes the folders of [`temporary_folder`] whose owner is dead.
pub fn sweep_folders() {
    each(&std::env::temp_dir(), |_| false, |name| folder_of(name).is_some_and(dead));
}

/// Removes files and folders with such names, the user's own. Whether there were any.
fn each(folder: &Path, is_file: impl Fn(&str) -> bool, is_folder: impl Fn(&str) -> bool) -> bool {
    let mut found = false;
    let Ok(user) = fs::metadata("/proc/self").map(|own| own.uid()) else { return found };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        let (file, folder) = (is_file(name), is_folder(name));
        // not followed: a link of such a name is nobody's temporary file
        let Some(metadata) = (file || folder).then(|| fs::symlink_metadata(entry.path()).ok()).flatten() else {
            continue;
        };
        if metadata.uid() != user {
            continue;
        }
        if file && metadata.is_file() {
            let _ = fs::remove_file(entry.path());
            found = true;
        } else if folder && metadata.is_dir() {
            let _ = fs::remove_dir_all(entry.path());
            found = true;
        }
    }
    found
}

/// Whether a process of this machine has ended; unknown counts as alive.
fn dead(pid: u32) -> bool {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw);
    pid.is_some_and(|pid| test_kill_process(pid).is_err_and(|error| error == rustix::io::Errno::SRCH))
}

/// The process whose temporary folder this is: `afmid-WHAT.HOST.PID.RANDOM`. None: no such name, or another machine's.
fn folder_of(name: &str) -> Option<u32> {
    let (rest, _) = name.strip_prefix(TITLE)?.rsplit_once('.')?;
    let (rest, pid) = rest.rsplit_once('.')?;
    let own = rest.strip_suffix(host()).is_some_and(|what| what.ends_with('.'));
    pid.parse().ok().filter(|_| own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::fixture::Folder;
    use crate::files::temporary_path;

    #[test]
    fn only_what_is_this_process_s_own_goes() {
        let folder = Folder::new("own");
        let own = temporary_path(&folder.file("a.h5"));
        fs::write(&own, "x").unwrap();
        let others =
            [".a.h5.tmp".to_owned(), format!(".a.h5.{}.1.0.tmp", host()), ".notes.tmp".to_owned(), "a.h5".to_owned()];
        others.iter().for_each(|name| fs::write(folder.file(name), "x").unwrap());
        sweep_own(&folder.0);
        assert!(!own.exists());
        others.iter().for_each(|name| assert!(folder.file(name).exists(), "{name}"));
    }

    #[test]
    fn a_folder_says_whose_it_is_and_goes_with_its_owner() {
        let folder = temporary_folder("test").unwrap();
        let name = folder.path().file_name().unwrap().to_str().unwrap().to_owned();
        assert_eq!(folder_of(&name), Some(std::process::id()));
        // no process has this number: the kernel gives at most 2^22
        let orphan = folder.path().with_file_name(format!("afmid-test.{}.4194305.x", host()));
        fs::create_dir(&orphan).unwrap();
        fs::write(orphan.join("a"), "x").unwrap();
        sweep_folders();
        assert!(folder.path().is_dir() && !orphan.exists());
    }
}
