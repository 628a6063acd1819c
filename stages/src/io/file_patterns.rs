//! Files by pattern.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use afmid_pipeline::recording::recognised;
use afmid_pipeline::{InputFiles, StageError};
use rayon::prelude::*;

use super::natural_order::natural_order;
use super::pattern_walk::{MOST_FOLDERS, Parts, matches};

/// The files that match `patterns`, relative to `base`, each once: patterns in their order, the matches of each in
/// natural order.
///
/// # Method
/// `*`, `?`, `[...]` and `**` as in a shell, names that begin with a dot not matched by them, links to folders not
/// followed by `**`; a pattern that names a folder means its `*.h5` or, if there are none, its files of any format that
/// is recognised.
/// # Errors
/// A pattern that is none, a folder that cannot be read, more folders than are searched, or a pattern without a match:
/// with the pattern, the folder that was looked at, and what is there.
pub fn matching_files(patterns: &[String], base: &Path, files: &InputFiles) -> Result<Vec<Match>, StageError> {
    let mut all = Vec::new();
    for pattern in patterns {
        let matches = matches_of(pattern, base, files)?;
        if matches.is_empty() {
            return Err(no_match(pattern, base));
        }
        all.extend(matches);
    }
    // one pattern matches no file twice
    if patterns.len() > 1 {
        let mut seen = HashSet::new();
        all.retain(|file| seen.insert(file.path.clone()));
    }
    Ok(all)
}

/// A regular file that a pattern matches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Match {
    /// Its path.
    pub path: PathBuf,
    /// Whether it is a stage or result file of afmid's.
    pub is_result: bool,
}

impl Match {
    /// None: no regular file. One that cannot be read counts as no result: opening it gives the error.
    fn of(path: PathBuf, files: &InputFiles) -> Option<Self> {
        match files.is_result(&path) {
            Ok(is_result) => Some(Self { path, is_result }),
            Err(_) => path.is_file().then_some(Self { path, is_result: false }),
        }
    }
}

fn matches_of(pattern: &str, base: &Path, files: &InputFiles) -> Result<Vec<Match>, StageError> {
    let whole = base.join(pattern);
    if whole.is_file() {
        return Ok(Match::of(whole, files).into_iter().collect());
    }
    if whole.is_dir() {
        let native = files_of(&whole, "*.h5", pattern, files)?;
        if !native.is_empty() {
            return Ok(native);
        }
        let all = files_of(&whole, "*", pattern, files)?;
        return Ok(all.into_iter().filter(|file| recognised(&file.path)).collect());
    }
    files_of(base, pattern, pattern, files)
}

/// The files that a pattern below a folder matches, in natural order; `written` is what the user wrote.
fn files_of(folder: &Path, pattern: &str, written: &str, files: &InputFiles) -> Result<Vec<Match>, StageError> {
    let parts = Parts::new(folder, pattern)
        .map_err(|error| StageError::new(format!("`{written}` is no file pattern: {}", error.msg)).caused_by(error))?;
    let paths = matches(&parts, written, MOST_FOLDERS)?;
    let mut found: Vec<(String, PathBuf)> =
        paths.into_iter().map(|path| (path.to_string_lossy().into_owned(), path)).collect();
    // looked at afterwards: numbered files were mostly made in this order, and lie so in the file system
    found.par_sort_by(|(a, _), (b, _)| natural_order(a, b));
    Ok(found.into_par_iter().filter_map(|(_, path)| Match::of(path, files)).collect())
}

fn no_match(pattern: &str, base: &Path) -> StageError {
    // the deepest folder before the first special character
    let plain: PathBuf = Path::new(pattern)
        .components()
        .take_while(|part| !part.as_os_str().to_string_lossy().contains(['*', '?', '[']))
        .collect();
    let whole = base.join(&plain);
    let folder =
        if plain == Path::new(pattern) && !whole.is_dir() { whole.parent().unwrap_or(base).to_owned() } else { whole };
    let there = match std::fs::read_dir(&folder) {
        Err(error) => format!("it cannot be listed: {error}"),
        Ok(entries) => {
            let mut names: Vec<String> =
                entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
            names.sort_by(|a, b| natural_order(a, b));
            match &names[..] {
                [] => "it is empty".to_owned(),
                [one] => format!("it holds `{one}`"),
                [first, .., last] => format!("it holds {} entries, from `{first}` to `{last}`", names.len()),
            }
        }
    };
    StageError::new(format!("no file matches `{pattern}`: looked in {}; {there}", folder.display()))
        .help("paths in a config, and in --set, are relative to the config file's folder")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str, files: &[&str]) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("afmid-patterns-{}-{name}", std::process::id()));
        std::fs::create_dir_all(folder.join("sub")).unwrap();
        for file in files {
            std::fs::write(folder.join(file), b"").unwrap();
        }
        folder
    }

    fn names(patterns: &[&str], base: &Path) -> Vec<String> {
        let patterns: Vec<String> = patterns.iter().map(|&pattern| pattern.to_owned()).collect();
        let files = matching_files(&patterns, base, &InputFiles::new()).unwrap();
        files.iter().map(|file| file.path.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn files_come_once_and_in_natural_order() {
        let base = folder("[odd] name", &["r10.h5", "r9.h5", "other.txt", ".hidden.h5", "sub/s1.h5"]);
        assert_eq!(names(&["*.h5"], &base), ["r9.h5", "r10.h5"]);
        assert_eq!(names(&["r10.h5", "*.h5", "sub"], &base), ["r10.h5", "r9.h5", "s1.h5"]);
        assert_eq!(names(&["sub/../r9.h5"], &base), ["r9.h5"]);
        let absolute = base.join("sub").join("*.h5").to_string_lossy().replace("[odd]", "?odd?");
        assert_eq!(names(&[&absolute], Path::new("/")), ["s1.h5"]);
        std::fs::remove_dir_all(base).unwrap();
    }

    #[test]
    fn a_folder_means_native_records_or_else_whatever_is_recognised() {
        let base = folder("formats", &["a.h5", "notes.md"]);
        std::fs::write(base.join("b.csv"), "1.5,2\n2.5,3\n3.5,4\n").unwrap();
        std::fs::write(base.join("c.npy"), b"\x93NUMPY\x01\0").unwrap();
        assert_eq!(names(&["."], &base), ["a.h5"]);
        std::fs::remove_file(base.join("a.h5")).unwrap();
        assert_eq!(names(&["."], &base), ["b.csv", "c.npy"]);
        std::fs::remove_dir_all(base).unwrap();
    }

    #[test]
    fn no_match_says_where_it_looked_and_what_is_there() {
        let base = folder("none", &["a.txt", "b.txt"]);
        let said =
            |pattern: &str| matching_files(&[pattern.to_owned()], &base, &InputFiles::new()).unwrap_err().to_string();
        let text = said("*.h5");
        assert!(text.contains("`*.h5`") && text.contains(&base.display().to_string()), "{text}");
        assert!(text.contains("3 entries, from `a.txt` to `sub`"), "{text}");
        assert!(said("sub/*.h5").contains("it is empty"), "{}", said("sub/*.h5"));
        assert!(said("nowhere/x*.h5").contains("cannot be listed"), "{}", said("nowhere/x*.h5"));
        assert!(said("a.h5").contains("3 entries"), "{}", said("a.h5"));
        assert!(said("[").contains("no file pattern"), "{}", said("["));
        std::fs::remove_dir_all(base).unwrap();
    }
}
