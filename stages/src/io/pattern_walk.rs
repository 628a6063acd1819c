//! The files below a folder that a pattern names.
//!
//! The folders that `**` stands for are real ones: a link to a folder below it is not followed, since links may lead in
//! circles. Names and `*` follow links, once for each part of the pattern. Each folder is listed once for each part
//! that is to be matched in it, and their number has a limit, so that any pattern ends.

use std::collections::HashSet;
use std::ffi::{OsStr, OsString};
use std::fs::DirEntry;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use afmid_pipeline::StageError;
use glob::{MatchOptions, Pattern, PatternError};

/// Folders that are listed for one pattern. Twenty years of daily folders with five levels each are 36,500, and so many
/// take a second or two.
pub(super) const MOST_FOLDERS: usize = 50_000;

/// Names that begin with a dot are hidden.
const OPTIONS: MatchOptions =
    MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: true };

/// A part of a pattern between slashes.
#[derive(Debug)]
enum Part {
    /// This name.
    Name(OsString),
    /// Any name that matches.
    Matching(Pattern),
    /// This folder and all real folders below it: `**`, several of them in a row as well.
    Below,
}

/// What a pattern names, seen from a folder.
#[derive(Debug)]
pub(super) struct Parts {
    start: PathBuf,
    parts: Vec<Part>,
    /// It ends in a slash: it names folders alone.
    folders_alone: bool,
}

impl Parts {
    /// A pattern below a folder, whose own name is none. Errors: it is no pattern.
    pub(super) fn new(folder: &Path, pattern: &str) -> Result<Self, PatternError> {
        let whole = Path::new(pattern).is_absolute();
        let above = if whole { &[][..] } else { folder.as_os_str().as_bytes() };
        let absolute = whole || folder.is_absolute();
        let names = |bytes: &[u8]| -> Vec<Part> {
            let names = bytes.split(|&byte| byte == b'/').filter(|name| !name.is_empty());
            names.map(|name| Part::Name(OsStr::from_bytes(name).to_owned())).collect()
        };
        let mut parts = names(above);
        for text in pattern.split('/').filter(|text| !text.is_empty()) {
            match text {
                "**" if matches!(parts.last(), Some(Part::Below)) => {}
                "**" => parts.push(Part::Below),
                text if text.contains(['*', '?', '[']) => parts.push(Part::Matching(Pattern::new(text)?)),
                text => parts.push(Part::Name(text.into())),
            }
        }
        let start = PathBuf::from(if absolute { "/" } else { "." });
        Ok(Self { start, parts, folders_alone: pattern.ends_with('/') })
    }
}

/// The paths that a pattern names and that are no folders, in no order, each once; the folder of one need not exist.
///
/// Errors: a folder that cannot be listed; more than `most` folders to list. `pattern` is what the user wrote.
pub(super) fn matches(parts: &Parts, pattern: &str, most: usize) -> Result<Vec<PathBuf>, StageError> {
    if parts.folders_alone {
        return Ok(Vec::new());
    }
    let mut walk = Walk {
        parts: &parts.parts,
        pattern,
        most,
        listed: 0,
        seen: HashSet::new(),
        open: Vec::new(),
        found: Vec::new(),
    };
    walk.reach(parts.start.clone(), 0);
    while let Some((folder, part)) = walk.open.pop() {
        walk.step(&folder, part)?;
    }
    walk.found.sort_unstable();
    walk.found.dedup();
    Ok(walk.found)
}

struct Walk<'a> {
    parts: &'a [Part],
    pattern: &'a str,
    most: usize,
    listed: usize,
    /// Folders, each with the part that is to be matched in it.
    seen: HashSet<(PathBuf, usize)>,
    open: Vec<(PathBuf, usize)>,
    found: Vec<PathBuf>,
}

impl Walk<'_> {
    /// A path that matches all before `part`.
    fn reach(&mut self, path: PathBuf, part: usize) {
        if part == self.parts.len() {
            self.found.push(path);
        } else if self.seen.insert((path.clone(), part)) {
            self.open.push((path, part));
        }
    }

    /// Matches a part in a folder.
    fn step(&mut self, folder: &Path, part: usize) -> Result<(), StageError> {
        match self.parts.get(part) {
            Some(Part::Name(name)) => self.enter(folder, name, part),
            Some(Part::Matching(pattern)) => self.list(folder, None, Some((pattern, part)))?,
            Some(Part::Below) => match self.parts.get(part + 1) {
                Some(Part::Name(name)) => {
                    self.enter(folder, name, part + 1);
                    self.list(folder, Some(part), None)?;
                }
                Some(Part::Matching(pattern)) => self.list(folder, Some(part), Some((pattern, part + 1)))?,
                // a pattern that ends in `**` names folders alone
                Some(Part::Below) | None => {}
            },
            None => {}
        }
        Ok(())
    }

    fn enter(&mut self, folder: &Path, name: &OsStr, part: usize) {
        let next = joined(folder, name);
        if next.symlink_metadata().is_ok() {
            self.reach(next, part + 1);
        }
    }

    /// Goes through a folder: `below` is the part that goes on in the folders of it, `here` what its entries match.
    fn list(&mut self, folder: &Path, below: Option<usize>, here: Option<(&Pattern, usize)>) -> Result<(), StageError> {
        if !folder.is_dir() {
            return Ok(());
        }
        self.listed += 1;
        if self.listed > self.most {
            return Err(self.too_many(folder));
        }
        let unreadable = |error: std::io::Error| {
            StageError::new(format!("a folder of the pattern `{}` cannot be read: {error}", self.pattern)).at(folder)
        };
        let entries: Result<Vec<DirEntry>, _> = std::fs::read_dir(folder).and_then(Iterator::collect);
        for entry in entries.map_err(unreadable)? {
            let (name, path) = (entry.file_name(), joined(folder, &entry.file_name()));
            if name.as_bytes().starts_with(b".") {
                continue;
            }
            if let Some(part) = below.filter(|_| entry.file_type().is_ok_and(|kind| kind.is_dir())) {
                self.reach(path.clone(), part);
            }
            if let Some((pattern, part)) = here
                && pattern.matches_with(&name.to_string_lossy(), OPTIONS)
            {
                self.reach(path, part + 1);
            }
        }
        Ok(())
    }

    fn too_many(&self, folder: &Path) -> StageError {
        StageError::new(format!(
            "the pattern `{}` leads into more than {} folders, the most that are searched for one pattern",
            self.pattern, self.most
        ))
        .at(folder)
        .help("begin the pattern further down, name folders instead of `**` or `*`, or give several patterns")
    }
}

/// What lies in the working directory is named without a `./`.
fn joined(folder: &Path, name: &OsStr) -> PathBuf {
    if folder == Path::new(".") { PathBuf::from(name) } else { folder.join(name) }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    fn folder(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        folder
    }

    fn found(folder: &Path, pattern: &str, most: usize) -> Result<Vec<String>, StageError> {
        let paths = matches(&Parts::new(folder, pattern).unwrap(), pattern, most)?;
        let name = |path: PathBuf| path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
        Ok(paths.into_iter().map(name).collect())
    }

    /// What the library that these patterns come from finds, which follows links to folders.
    fn reference(folder: &Path, pattern: &str) -> Vec<PathBuf> {
        let text = format!("{}/{pattern}", Pattern::escape(&folder.to_string_lossy()));
        let mut paths: Vec<PathBuf> = glob::glob_with(&text, OPTIONS).unwrap().map(Result::unwrap).collect();
        paths.retain(|path| path.is_file());
        paths.sort_unstable();
        paths.dedup();
        paths
    }

    #[test]
    fn without_links_a_pattern_finds_what_the_library_finds() {
        let files =
            ["a.h5", "b/a.h5", "b/c/a.h5", "b/c/b/x.h5", "b/.h/a.h5", ".h/a.h5", "b/.a.h5", "[d]/a.h5", "b/c.txt"];
        let folder = folder(&files);
        for pattern in [
            "*.h5",
            "**/*.h5",
            "**/**/*.h5",
            "b/**/*.h5",
            "**/b/**/*.h5",
            "**/c/*.h5",
            "*/*.h5",
            "**",
            "**/a.h5",
            "b/*/",
            "./*.h5",
            "b/../*.h5",
            "[[]d[]]/*",
            "b/[a-c]/?.h5",
            ".h/*.h5",
            "b//a.h5",
            "*/**/*",
        ] {
            let here = folder.path();
            let mut own = matches(&Parts::new(here, pattern).unwrap(), pattern, MOST_FOLDERS).unwrap();
            own.retain(|path| path.is_file());
            let text = |paths: Vec<PathBuf>| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
            assert_eq!(text(own), text(reference(here, pattern)), "{pattern}");
        }
        for wrong in ["[", "a**", "***", "x/[/y"] {
            assert!(Parts::new(folder.path(), wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn links_to_folders_are_followed_by_names_and_not_by_two_stars() {
        let folder = folder(&["real/a.h5", "real/deep/b.h5"]);
        let here = folder.path();
        symlink(".", here.join("loop")).unwrap();
        symlink(".", here.join("real/again")).unwrap();
        symlink("real", here.join("link")).unwrap();
        symlink("real/a.h5", here.join("file.h5")).unwrap();
        let of = |pattern: &str| found(here, pattern, 40).unwrap();
        let all = ["file.h5", "real/a.h5", "real/deep/b.h5"];
        assert_eq!(of("**/*.h5"), all);
        assert_eq!(of("**/**/**/*.h5"), all);
        assert_eq!(of("link/**/*.h5"), ["link/a.h5", "link/deep/b.h5"]);
        assert_eq!(of("lin*/*.h5"), ["link/a.h5"]);
    }

    #[test]
    fn a_path_comes_once_and_the_number_of_folders_has_a_limit() {
        let deep = "x/x/x/x/x/x/x/x/x/x/a.h5";
        let folder = folder(&[deep]);
        let here = folder.path();
        // ten folders for each of the six parts that begin with `**`
        assert_eq!(found(here, "**/x/**/x/**/x/**/x/**/x/**/*.h5", 70).unwrap(), [deep]);
        assert_eq!(found(here, "**/*.h5", 11).unwrap(), [deep]);
        let error = found(here, "**/*.h5", 10).unwrap_err();
        assert!(error.problem.contains("`**/*.h5` leads into more than 10 folders"), "{error}");
        assert!(error.help.is_some() && error.place.is_some());
    }
}
