//! What a run needs to be repeated: its inputs, where they are now, and its config with their places.

use std::path::{Component, Path, PathBuf};

use afmid_pipeline::recording::hash_file;
use afmid_pipeline::store::ResultFile;
use afmid_pipeline::{Node, Plan, RunInfo, SourceFile, StageRecord};
use serde_json::Value;

use super::diff::file_name;
use super::files::{Finder, Now};

/// The folder of the config as it was then: relative paths in it begin there. `.` if the file does not say.
pub fn base(run: &RunInfo) -> PathBuf {
    let config = config_path(run);
    match config.parent() {
        Some(folder) if !run.config_file.is_empty() && !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// The config's path as it was then.
pub fn config_path(run: &RunInfo) -> PathBuf {
    Path::new(&run.folder).join(&run.config_file)
}

/// The files of a run that are not there with the same bytes, each once.
pub fn unfit(file: &ResultFile, finder: &Finder) -> Vec<(SourceFile, Now)> {
    let mut found: Vec<(SourceFile, Now)> = Vec::new();
    for source in file.stages().iter().flat_map(|stage| &stage.record.sources) {
        if found.iter().any(|(told, _)| told == source) {
            continue;
        }
        match finder.find(source) {
            Now::Same(_) => {}
            now => found.push((source.clone(), now)),
        }
    }
    found
}

/// `--set` arguments that make a plan read the files that the run read, where they are now; none for a stage that finds them from `base`
/// by itself.
pub fn places(plan: &Plan, file: &ResultFile, base: &Path, finder: &Finder) -> Vec<String> {
    let set = |node: &Node| {
        let record = &file.stage(&node.id)?.record;
        let needed = !record.sources.is_empty() && !reads_the_same(node, record, base);
        if needed { reader(node, record, finder) } else { None }
    };
    plan.nodes.iter().filter_map(set).collect()
}

/// The folder where a repetition begins if stages of it write files: a stage that reads no file and has a place writes there, and by now others
/// may use what lies there. As deep in `scratch` as the stages' paths climb, so that what they write stays in it. None if no stage writes.
pub fn writing_base(plan: &Plan, scratch: &Path) -> Option<PathBuf> {
    let climbs = |node: &Node| {
        let (_, place) = location(node)?;
        let reads = node.stage.sources(Path::new(".")).map_or(true, |sources| !sources.is_empty());
        let place = place.as_str().filter(|_| !reads)?;
        Some(Path::new(place).components().filter(|part| *part == Component::ParentDir).count())
    };
    let depth = plan.nodes.iter().filter_map(climbs).max()?;
    Some((0..=depth).fold(scratch.to_owned(), |folder, _| folder.join("config")))
}

fn reads_the_same(node: &Node, record: &StageRecord, base: &Path) -> bool {
    let Ok(now) = node.stage.sources(base) else { return false };
    let same = |(path, source): (&PathBuf, &SourceFile)| {
        file_name(&path.to_string_lossy()) == file_name(&source.path)
            && hash_file(path).is_ok_and(|hash| hash == source.blake3)
    };
    now.len() == record.sources.len() && now.iter().zip(&record.sources).all(same)
}

/// The parameter that says where a stage's data lie, if there is one.
fn location(node: &Node) -> Option<(&'static str, &Value)> {
    let [name] = node.stage.location_params() else { return None };
    Some((name, node.params.get(name)?))
}

fn reader(node: &Node, record: &StageRecord, finder: &Finder) -> Option<String> {
    let (name, value) = location(node)?;
    let found = record.sources.iter().map(|source| match finder.find(source) {
        Now::Same(path) => Some(quoted(&std::path::absolute(path).ok()?)),
        _ => None,
    });
    let found: Vec<String> = found.collect::<Option<_>>()?;
    let value = match (value, &found[..]) {
        (Value::Array(_), _) => format!("[{}]", found.join(", ")),
        (_, [one]) => one.clone(),
        _ => return None,
    };
    Some(format!("{}.{name}={value}", node.id))
}

/// A TOML string: JSON's escapes are TOML's.
fn quoted(path: &Path) -> String {
    Value::String(path.to_string_lossy().into_owned()).to_string()
}
