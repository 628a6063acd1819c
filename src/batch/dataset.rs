//! Data sets: what one run of a batch reads.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use afmid_pipeline::runner::failed_place;
use afmid_pipeline::{Plan, toml};

use crate::relative::literally;

/// What one run of a batch reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataSet {
    /// Its logical name: that of its result file.
    pub name: String,
    /// What replaces the files that the config names: absolute.
    pub files: Vec<String>,
    /// Further `--set` arguments.
    pub set: Vec<String>,
}

/// Names of the batch's own files.
const RESERVED: [&str; 2] = ["summary", "ledger"];
/// Longest name in bytes: file systems take 255, temporary names add to it.
const LONGEST: usize = 180;

impl DataSet {
    /// A folder of records, or a record alone, by the name of the folder or of the file without its ending. Errors: it is
    /// not there; its name cannot be a file's.
    pub fn of_path(path: &Path) -> Result<Self, String> {
        if !path.exists() {
            return Err(format!("{} is not there, wanted a folder of records or a file", path.display()));
        }
        if path.extension().is_some_and(|ending| ending == "toml") {
            return Err(format!("{} is a config, wanted a folder of records or a file", path.display()));
        }
        // `.` and `..` have no last part of their own
        let whole = path.canonicalize().map_err(|error| format!("{}: {error}", path.display()))?;
        let name = if path.is_dir() { whole.file_name() } else { path.file_stem() };
        let name = name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        check_name(&name).map_err(|problem| format!("{}: {problem}", path.display()))?;
        Ok(Self { name, files: vec![absolute(&path.to_string_lossy())?], set: Vec::new() })
    }

    /// The `--set` arguments of its run, after those of the whole batch. Errors: it is several files, and the config reads
    /// one.
    pub fn arguments(&self, replaced: Replaced) -> Result<Vec<String>, String> {
        let files =
            replaced.argument(&self.files).map_err(|problem| format!("the data set `{}`: {problem}", self.name))?;
        Ok(std::iter::once(files).chain(self.set.iter().cloned()).collect())
    }
}

/// What of a config other files take the place of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replaced {
    /// `files` of the stage `records`.
    Records,
    /// `files` of the stage `data`: hits or takes.
    Hits,
    /// `file` of the stage `data`: one measurement.
    File,
}

impl Replaced {
    /// None of a plan that reads no files of this kind.
    pub fn of(plan: &Plan) -> Option<Self> {
        if plan.node("records").is_some() {
            return Some(Self::Records);
        }
        let files = plan.node("data")?.params.get("files").and_then(serde_json::Value::as_array);
        Some(if files.is_some_and(|files| !files.is_empty()) { Self::Hits } else { Self::File })
    }

    /// The `--set` argument that puts files, folders or patterns there. Errors: several, where one file is read.
    pub fn argument(self, files: &[String]) -> Result<String, String> {
        let list = || toml::Value::Array(files.iter().map(|file| toml::Value::String(file.clone())).collect());
        match self {
            Self::Records => Ok(format!("records.files={}", list())),
            Self::Hits => Ok(format!("data.files={}", list())),
            Self::File => Ok(format!("data.file={}", toml::Value::String(one(files)?))),
        }
    }
}

/// The one file that is named, or that a folder holds. Errors: there are more, or none.
fn one(files: &[String]) -> Result<String, String> {
    let [path] = files else {
        return Err(format!(
            "{} files, and the config reads one: `afmid batch CONFIG FILE...` runs it on each",
            files.len()
        ));
    };
    if !Path::new(path).is_dir() {
        return Ok(path.clone());
    }
    let listed = std::fs::read_dir(path).map_err(|error| format!("{path}: {error}"))?;
    let mut found: Vec<PathBuf> = listed.flatten().map(|entry| entry.path()).filter(|file| file.is_file()).collect();
    match (found.pop(), found.len()) {
        (Some(file), 0) => Ok(file.to_string_lossy().into_owned()),
        (Some(_), more) => Err(format!("{path} holds {} files, and the config reads one: name the files", more + 1)),
        (None, _) => Err(format!("{path} holds no file")),
    }
}

/// Files, folders or patterns of the working directory, absolute. Errors: there is none.
pub fn all_absolute(files: &[String]) -> Result<Vec<String>, String> {
    files.iter().map(|file| absolute(file)).collect()
}

/// Errors: why a name cannot be that of a result file.
pub fn check_name(name: &str) -> Result<(), String> {
    let plain = |c: char| !c.is_control() && c != '/' && c != '\\';
    if name.is_empty() || name.len() > LONGEST {
        return Err(format!("the name of a data set has {} bytes, wanted 1 to {LONGEST}", name.len()));
    }
    if name.starts_with('.') || !name.chars().all(plain) {
        return Err(format!("`{name}` cannot be the name of a data set: wanted no `/`, no `.` in front"));
    }
    if RESERVED.iter().any(|reserved| name.eq_ignore_ascii_case(reserved)) {
        return Err(format!("`{name}` is the name of a file of the batch itself, wanted another for the data set"));
    }
    Ok(())
}

/// A path or pattern that begins in the working directory, absolute. Errors: there is no working directory.
pub fn absolute(pattern: &str) -> Result<String, String> {
    if Path::new(pattern).is_absolute() {
        return Ok(pattern.to_owned());
    }
    let here = std::env::current_dir().map_err(|error| format!("the working directory cannot be found: {error}"))?;
    let whole: PathBuf = here.join(pattern);
    if whole.exists() {
        return Ok(whole.to_string_lossy().into_owned());
    }
    // special characters above the pattern are none of the pattern's
    Ok(format!("{}/{pattern}", literally(&here.to_string_lossy())))
}

/// Sets in the order of their names. Errors: two whose results would take one another's place, with both names.
pub fn sorted(mut sets: Vec<DataSet>) -> Result<Vec<DataSet>, Vec<String>> {
    sets.sort_by(|a, b| a.name.cmp(&b.name));
    let (mut problems, mut taken) = (Vec::new(), HashMap::with_capacity(sets.len()));
    for set in &sets {
        if let Some(other) = taken.insert(place(&result_name(&set.name)), set) {
            problems.push(collision(other, set));
        }
    }
    for set in &sets {
        if let Some(other) = taken.get(&place(&failed_place(&result_name(&set.name)))) {
            let (name, files, theirs) = (&set.name, set.files.join(", "), other.files.join(", "));
            problems.push(format!(
                "the data set `{}` ({theirs}) has the name under which a failed run of `{name}` ({files}) is kept; \
                 wanted another: a manifest gives data sets names",
                other.name
            ));
        }
    }
    if problems.is_empty() { Ok(sets) } else { Err(problems) }
}

/// The file of a data set's result, in the folder of the batch.
pub fn result_name(name: &str) -> PathBuf {
    PathBuf::from(format!("{name}.h5"))
}

/// What two files of one folder may not have in common: file systems of some machines take `A` for `a`.
fn place(file: &Path) -> String {
    file.to_string_lossy().to_lowercase()
}

fn collision(one: &DataSet, other: &DataSet) -> String {
    let [files, theirs] = [one, other].map(|set| set.files.join(", "));
    match one.name == other.name {
        true => format!("two data sets have the name `{}`: {files} and {theirs}; wanted one", one.name),
        false => format!(
            "the names of the data sets `{}` ({files}) and `{}` ({theirs}) differ in capitals alone: where file systems \
             do not tell them apart one result would replace the other; wanted another name",
            one.name, other.name
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(name: &str) -> DataSet {
        DataSet { name: name.to_owned(), files: vec!["/a \"b\"/*.h5".to_owned()], set: vec!["fit.order=9".to_owned()] }
    }

    #[test]
    fn names_are_those_of_files() {
        for good in ["a", "lever 1, 2005-03-01", "µ"] {
            assert_eq!(check_name(good), Ok(()));
        }
        for bad in ["", ".", "..", ".a", "a/b", "a\\b", "a\nb", "summary", "Ledger", &"x".repeat(181)] {
            assert!(check_name(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn files_are_quoted_as_toml() {
        let of = |replaced| set("a").arguments(replaced);
        assert_eq!(of(Replaced::Records).unwrap(), ["records.files=['/a \"b\"/*.h5']", "fit.order=9"]);
        assert_eq!(of(Replaced::Hits).unwrap()[0], "data.files=['/a \"b\"/*.h5']");
        assert_eq!(of(Replaced::File).unwrap()[0], "data.file='/a \"b\"/*.h5'");
        let two = DataSet { files: vec!["/a".to_owned(), "/b".to_owned()], ..set("a") };
        assert!(two.arguments(Replaced::File).is_err_and(|problem| problem.contains("`a`: 2 files")));
    }

    #[test]
    fn sets_are_sorted_and_names_are_unique() {
        let names = |sets: Vec<DataSet>| sets.into_iter().map(|set| set.name).collect::<Vec<_>>();
        assert_eq!(names(sorted(vec![set("b"), set("a")]).unwrap()), ["a", "b"]);
        let problems = sorted(vec![set("b"), set("a"), set("b")]).unwrap_err();
        assert!(problems.len() == 1 && problems[0].contains("`b`"), "{problems:?}");
    }

    #[test]
    fn names_whose_files_are_one_are_refused_with_both() {
        for (one, other) in [("a", "a.failed"), ("a.failed", "a.failed.failed"), ("Lever", "lever"), ("B", "b.Failed")]
        {
            let problems = sorted(vec![set(other), set("c"), set(one)]).unwrap_err();
            let [problem] = &problems[..] else { panic!("{problems:?}") };
            assert!([one, other].iter().all(|name| problem.contains(&format!("`{name}`"))), "{problem}");
        }
        for (one, other) in [("a", "b.failed"), ("a", "afailed"), ("a.b", "a.failed"), ("a", "a.failed.b")] {
            assert_eq!(sorted(vec![set(one), set(other)]).unwrap().len(), 2, "{one} and {other}");
        }
    }
}
