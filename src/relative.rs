//! Paths as seen from a folder.

use std::path::{Component, Path, PathBuf};

/// A path as seen from a folder; absolute where they share no beginning.
pub fn relative(path: &Path, folder: &Path) -> PathBuf {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let (path, folder) = (absolute(path), absolute(folder));
    let common = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if common < 2 {
        return path;
    }
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(path.components().skip(common)).collect()
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
    fn paths_are_seen_from_a_folder() {
        let see = |path: &str, folder: &str| relative(Path::new(path), Path::new(folder)).display().to_string();
        assert_eq!(see("/a/b/c.h5", "/a/b"), "c.h5");
        assert_eq!(see("/a/b/c.h5", "/a/x/y"), "../../b/c.h5");
        assert_eq!(see("/a/b", "/x"), "/a/b");
        assert_eq!(address(Path::new("../set 1#%.h5")), "../set%201%23%25.h5");
        assert_eq!(folder_of(Path::new("a.h5")), Path::new("."));
    }
}
