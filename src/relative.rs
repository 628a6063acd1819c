//! Paths as seen from a folder.

use std::path::{Component, Path, PathBuf};

/// A path or pattern of the working directory as seen from a folder; absolute where they share no beginning.
///
/// The folder is taken as what it really is, without links and `..`: from there each `..` leads where it says. Links in
/// the path stay as they were written, unless it shares a beginning with the folder only without them.
pub fn relative(path: &Path, folder: &Path) -> PathBuf {
    let folder = folder.canonicalize().unwrap_or_else(|_| absolute(folder));
    let path = absolute(path);
    let shared = |path: &Path| path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let seen = |path: &Path| -> PathBuf {
        let up = folder.components().skip(shared(path)).map(|_| Component::ParentDir);
        up.chain(path.components().skip(shared(path))).collect()
    };
    if shared(&path) >= 2 {
        return seen(&path);
    }
    match really(&path) {
        Some(real) if shared(&real) >= 2 => seen(&real),
        _ => path,
    }
}

/// The absolute path; the `..` that it begins with are undone: the working directory has no links in it.
fn absolute(path: &Path) -> PathBuf {
    if path.is_absolute() {
        return path.to_owned();
    }
    let Ok(mut whole) = std::env::current_dir() else { return path.to_owned() };
    let mut parts = path.components().filter(|part| *part != Component::CurDir).peekable();
    while parts.next_if_eq(&Component::ParentDir).is_some() {
        whole.pop();
    }
    whole.extend(parts);
    whole
}

/// The path of a file or pattern, its folder without links; none if that is not there.
fn really(path: &Path) -> Option<PathBuf> {
    Some(path.parent()?.canonicalize().ok()?.join(path.file_name()?))
}

/// A path as part of a pattern of files: what has a meaning in patterns is escaped.
pub fn literally(text: &str) -> String {
    let escape = |c: char| if matches!(c, '*' | '?' | '[' | ']') { format!("[{c}]") } else { c.to_string() };
    text.chars().map(escape).collect()
}

/// The folder of a file that may be given without one.
pub fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A relative path as an address in a page: what addresses give a meaning is escaped.
pub fn address(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/._-~".contains(&byte);
    text.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_what_it_is_without_links() {
        let scratch = tempfile::tempdir().unwrap();
        let top = scratch.path().canonicalize().unwrap();
        std::fs::create_dir_all(top.join("far/away")).unwrap();
        std::fs::create_dir_all(top.join("data")).unwrap();
        std::os::unix::fs::symlink(top.join("far/away"), top.join("near")).unwrap();
        let see = |path: &str, folder: &str| relative(&top.join(path), &top.join(folder)).display().to_string();
        assert_eq!(see("data/*.h5", "near"), "../../data/*.h5");
        assert_eq!(see("near/*.h5", "data"), "../near/*.h5");
        assert_eq!(see("data/*.h5", "near/.."), "../data/*.h5");
        assert_eq!(literally("a[1]*"), "a[[]1[]][*]");
    }

    #[test]
    fn paths_are_seen_from_a_folder() {
        let see = |path: &str, folder: &str| relative(Path::new(path), Path::new(folder)).display().to_string();
        assert_eq!(see("/a/b/c.h5", "/a/b"), "c.h5");
        assert_eq!(see("/a/b/c.h5", "/a/x/y"), "../../b/c.h5");
        assert_eq!(see("/a/b", "/x"), "/a/b");
        let here = std::env::current_dir().unwrap();
        let name = here.file_name().unwrap().to_string_lossy().into_owned();
        assert_eq!(see("a/*.h5", "."), "a/*.h5");
        assert_eq!(see("a/*.h5", ".."), format!("{name}/a/*.h5"));
        assert_eq!(see("../a/*.h5", ".."), "a/*.h5");
        assert_eq!(see("../a/*.h5", "."), "../a/*.h5");
        assert_eq!(address(Path::new("../set 1#%.h5")), "../set%201%23%25.h5");
        assert_eq!(folder_of(Path::new("a.h5")), Path::new("."));
    }
}
