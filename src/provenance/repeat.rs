//! What a run needs to be repeated: its inputs, where they are now, and its config with their places.

use std::path::{Path, PathBuf};

use afmid_pipeline::InputFiles;
use afmid_pipeline::store::ResultFile;
use afmid_pipeline::{Artifact, Node, Plan, Ports, RunInfo, RunResult, SourceFile, StageRecord};
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
        if found.iter().any(|(known, _)| known == source) {
            continue;
        }
        match finder.find(source) {
            Now::Same(_) => {}
            now => found.push((source.clone(), now)),
        }
    }
    found
}

/// `--set` arguments that make a plan read the files that the run read, where they are now; none for a stage that finds
/// them from `base` by itself.
pub fn places(plan: &Plan, file: &ResultFile, base: &Path, finder: &Finder) -> Vec<String> {
    let set = |node: &Node| {
        let record = &file.stage(&node.id)?.record;
        let needed = !record.sources.is_empty() && !reads_the_same(node, record, base);
        if needed { reader(node, record, finder) } else { None }
    };
    plan.nodes.iter().filter_map(set).flatten().collect()
}

/// A stage that writes files, and where it does so in a repetition: not over what others may use by now.
#[derive(Debug)]
pub struct Writer {
    id: String,
    parameter: &'static str,
    /// The parameter's value in the run.
    place: String,
    /// The folder that it means.
    folder: PathBuf,
    /// The folder of the repetition.
    scratch: PathBuf,
}

/// The stages that write: those that read no file and have a place.
pub fn writers(plan: &Plan, base: &Path, scratch: &Path) -> Vec<Writer> {
    let writer = |node: &Node| {
        let (parameter, place) = location(node)?;
        let reads = node.stage.sources(base, &InputFiles::new()).map_or(true, |sources| !sources.is_empty());
        let place = place.as_str().filter(|_| !reads)?.to_owned();
        let (folder, scratch) = (base.join(&place), scratch.join(&node.id));
        Some(Writer { id: node.id.clone(), parameter, place, folder, scratch })
    };
    plan.nodes.iter().filter_map(writer).collect()
}

impl Writer {
    /// The `--set` argument that makes it write there.
    pub fn set(&self) -> String {
        format!("{}.{}={}", self.id, self.parameter, quoted(&self.scratch))
    }

    /// Puts the run's own places back into what a repetition says: the folder of the repetition is gone afterwards.
    pub fn put_back(&self, run: &mut RunResult) {
        for stage in run.stages.iter_mut().filter(|stage| stage.id == self.id) {
            self.in_json(&mut stage.params);
            let outputs: Vec<(String, Artifact)> = stage
                .result
                .outputs
                .iter()
                .map(|(name, artifact)| (name.to_owned(), self.in_artifact(artifact)))
                .collect();
            stage.result.outputs = Ports::new();
            outputs.into_iter().for_each(|(name, artifact)| stage.result.outputs.insert(&name, artifact));
            stage.result.warnings.iter_mut().for_each(|warning| {
                *warning = warning.replace(&*self.scratch.to_string_lossy(), &self.place);
            });
        }
    }

    fn in_artifact(&self, artifact: &Artifact) -> Artifact {
        match artifact {
            Artifact::Document(document) => {
                let mut document = document.as_ref().clone();
                self.in_json(&mut document.0);
                Artifact::Document(document.into())
            }
            Artifact::Recording(recording) => {
                let mut recording = recording.as_ref().clone();
                for record in &mut recording.records {
                    if let Ok(inside) = record.path.strip_prefix(&self.scratch) {
                        record.path = self.folder.join(inside);
                    }
                }
                Artifact::Recording(recording.into())
            }
            other => other.clone(),
        }
    }

    fn in_json(&self, json: &mut Value) {
        match json {
            Value::String(text) => *text = text.replace(&*self.scratch.to_string_lossy(), &self.place),
            Value::Array(values) => values.iter_mut().for_each(|value| self.in_json(value)),
            Value::Object(entries) => entries.values_mut().for_each(|value| self.in_json(value)),
            _ => {}
        }
    }
}

fn reads_the_same(node: &Node, record: &StageRecord, base: &Path) -> bool {
    let Ok(now) = node.stage.sources(base, &InputFiles::new()) else { return false };
    let same = |(path, source): (&PathBuf, &SourceFile)| {
        file_name(&path.to_string_lossy()) == file_name(&source.path)
            && InputFiles::new().hash(path).is_ok_and(|hash| hash == source.blake3)
    };
    now.len() == record.sources.len() && now.iter().zip(&record.sources).all(same)
}

/// The parameter that says where a stage's data lie, if there is one.
fn location(node: &Node) -> Option<(&'static str, &Value)> {
    let [name] = node.stage.location_params() else { return None };
    Some((name, node.params.get(name)?))
}

/// `--set` arguments for all places of a stage: those of one file each, and at most one list with the rest.
fn reader(node: &Node, record: &StageRecord, finder: &Finder) -> Option<Vec<String>> {
    let found = record.sources.iter().map(|source| match finder.find(source) {
        Now::Same(path) => Some(quoted(&std::path::absolute(path).ok()?)),
        _ => None,
    });
    let mut found: Vec<String> = found.collect::<Option<_>>()?;
    let places = node.stage.location_params().iter().filter_map(|name| Some((name, node.params.get(*name)?)));
    let (mut singles, mut lists) = (Vec::new(), Vec::new());
    for (name, value) in places {
        match value {
            Value::String(place) if !place.is_empty() => singles.push(name),
            Value::Array(places) if !places.is_empty() => lists.push(name),
            _ => {}
        }
    }
    if singles.len() > found.len() || lists.len() > 1 || (lists.is_empty() && singles.len() < found.len()) {
        return None;
    }
    let rest = found.split_off(singles.len());
    let mut set: Vec<String> =
        singles.iter().zip(&found).map(|(name, file)| format!("{}.{name}={file}", node.id)).collect();
    set.extend(lists.first().map(|name| format!("{}.{name}=[{}]", node.id, rest.join(", "))));
    Some(set)
}

/// A TOML string: JSON's escapes are TOML's.
fn quoted(path: &Path) -> String {
    Value::String(path.to_string_lossy().into_owned()).to_string()
}
