//! Where the files that a run read are now, and whether they have the same bytes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use afmid_pipeline::InputFiles;
use afmid_pipeline::files::open_regular;
use afmid_pipeline::{RunInfo, SourceFile};

use super::diff::file_name;

/// What became of a file that a run read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Now {
    /// It is there, with the same bytes.
    Same(PathBuf),
    /// A file of this name is there, with other bytes.
    Other(PathBuf),
    /// It is not there.
    Missing,
    /// It is there and cannot be read.
    Unreadable(String),
}

impl Now {
    /// In words.
    pub fn text(&self) -> String {
        match self {
            Self::Same(_) => "there, same bytes".to_owned(),
            Self::Other(path) => format!("other bytes ({})", path.display()),
            Self::Missing => "not there".to_owned(),
            Self::Unreadable(why) => format!("cannot be read: {why}"),
        }
    }

    /// For scripts.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Same(_) => "same",
            Self::Other(_) => "other bytes",
            Self::Missing => "missing",
            Self::Unreadable(_) => "unreadable",
        }
    }
}

/// Finds the files of a run: where they lay, or by name and hash in other folders.
#[derive(Debug)]
pub struct Finder {
    /// The working directory of the run, and the present one.
    bases: Vec<PathBuf>,
    /// The files of other folders by name.
    others: BTreeMap<String, Vec<PathBuf>>,
}

impl Finder {
    /// For a run, with these folders to look in as well, the folders in them included.
    pub fn new(run: &RunInfo, folders: &[PathBuf]) -> Self {
        let mut bases = Vec::new();
        if !run.folder.is_empty() {
            bases.push(PathBuf::from(&run.folder));
        }
        bases.push(PathBuf::from("."));
        let mut others = BTreeMap::new();
        folders.iter().for_each(|folder| list(folder, &mut others));
        Self { bases, others }
    }

    /// What became of a file. One with the same bytes counts before one with others.
    pub fn find(&self, file: &SourceFile) -> Now {
        let lay = self.bases.iter().map(|base| base.join(&file.path));
        let elsewhere = self.others.get(file_name(&file.path)).into_iter().flatten().cloned();
        let mut best = Now::Missing;
        for path in lay.chain(elsewhere) {
            match look(&path, file) {
                same @ Now::Same(_) => return same,
                Now::Missing => {}
                other if best == Now::Missing => best = other,
                _ => {}
            }
        }
        best
    }
}

fn look(path: &Path, file: &SourceFile) -> Now {
    let Ok(metadata) = fs::metadata(path) else { return Now::Missing };
    if metadata.is_dir() {
        return Now::Missing;
    }
    if !metadata.is_file() {
        return open_regular(path).map_or_else(|error| Now::Unreadable(error.to_string()), |_| Now::Missing);
    }
    if metadata.len() != file.size {
        return Now::Other(path.to_owned());
    }
    match InputFiles::new().hash(path) {
        Ok(hash) if hash == file.blake3 => Now::Same(path.to_owned()),
        Ok(_) => Now::Other(path.to_owned()),
        Err(error) => Now::Unreadable(error.to_string()),
    }
}

/// All files below a folder by name, in order of their paths; links to folders are not followed: they may lead in
/// circles.
fn list(folder: &Path, found: &mut BTreeMap<String, Vec<PathBuf>>) {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort_unstable();
    for path in paths {
        if path.is_dir() && !path.is_symlink() {
            list(&path, found);
        } else if let Some(name) = path.file_name().map(|name| name.to_string_lossy().into_owned()) {
            found.entry(name).or_default().push(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_found_where_it_lay_or_by_name_and_hash_elsewhere() {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        fs::create_dir_all(here.join("moved/deep")).unwrap();
        fs::write(here.join("a"), "one").unwrap();
        fs::write(here.join("moved/deep/b"), "two").unwrap();
        fs::write(here.join("b"), "no2").unwrap();
        let run = RunInfo { folder: here.display().to_string(), ..RunInfo::default() };
        let file = |name: &str, text: &str| {
            let hashed = here.join("hashed");
            fs::write(&hashed, text).unwrap();
            SourceFile {
                path: name.to_owned(),
                size: text.len() as u64,
                blake3: InputFiles::new().hash(&hashed).unwrap(),
            }
        };
        let plain = Finder::new(&run, &[]);
        assert_eq!(plain.find(&file("a", "one")), Now::Same(here.join("a")));
        assert_eq!(plain.find(&file("b", "two")), Now::Other(here.join("b")));
        assert_eq!(plain.find(&file("c", "two")), Now::Missing);
        let wider = Finder::new(&run, &[here.join("moved")]);
        assert_eq!(wider.find(&file("b", "two")), Now::Same(here.join("moved/deep/b")));
    }
}
