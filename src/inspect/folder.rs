//! The files of a folder.

use std::path::{Path, PathBuf};

use afmid_stages::io::natural_order;

/// The files of a folder, in natural order; hidden ones and folders in it are passed over. Errors: it cannot be listed.
pub fn files_of(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with('.') && entry.path().is_file() {
            names.push((name, entry.path()));
        }
    }
    names.sort_by(|a, b| natural_order(&a.0, &b.0));
    Ok(names.into_iter().map(|(_, path)| path).collect())
}
