//! From recordings to an answer in one command: config, result and page side by side.

use std::path::{Path, PathBuf};

use afmid_pipeline::files::read_regular;
use afmid_pipeline::{Artifact, Registry, RunResult, StageRecord};
use serde_json::{Map, Value, json};

use super::draft::Draft;
use super::report::write_page;
use super::run::{Computation, default_output, inputs, open_cache, run_and_write};
use super::target::{Target, prepare};
use crate::batch::shell::quoted;
use crate::cli::{AtOnceArgs, Goal, SpringArgs};
use crate::failure::Failure;
use crate::output::say;
use crate::printable::{one_line, shown};
use crate::show::SUMMARY;

/// What was written, and what was found.
pub struct Answered {
    pub draft: Draft,
    pub files: Files,
    pub result: RunResult,
}

/// Writes the config for the goal, or for what the recordings look like, runs it and writes the page; `kind`: what the
/// files are called by. Errors: of the recordings, a file in the way, a stage.
pub fn answered(args: &AtOnceArgs, goal: Option<Goal>, kind: &str, registry: &Registry) -> Result<Answered, Failure> {
    let files = Files::of(args, kind)?;
    let draft = Draft::new(&args.recordings, goal, SpringArgs::default(), |_| Ok(files.config.clone()), registry)?;
    let is_there = is_the_same(&draft)?;
    let read = inputs(&draft.plan, &files.config);
    prepare(&files.result, Target::Result, &read)?;
    prepare(&files.page, Target::Page, &read)?;
    if !is_there {
        draft.write()?;
    }
    draft.notes.iter().for_each(|note| say(&format!("{}\n", one_line(note))));
    let cache = open_cache(args.cache.as_deref());
    let base = draft.plan.config.base();
    let how = Computation { base, cache: &cache, fresh: args.fresh, jobs: args.jobs, overrides: &[] };
    run_and_write(&draft.plan, &files.result, &how).inspect_err(|_| {
        let taken = if draft.why.is_empty() { String::new() } else { format!("taken for: {}\n", one_line(&draft.why)) };
        say(&format!("{taken}the config is {}\n", shown(&files.config)));
    })?;
    let result = write_page(&files.result, &files.page)?;
    Ok(Answered { draft, files, result })
}

impl Answered {
    /// The stage that all others lead to.
    pub fn last(&self) -> &str {
        self.draft.plan.nodes.last().map_or("", |node| &node.id)
    }

    /// A stage's record.
    pub fn stage(&self, id: &str) -> Option<&StageRecord> {
        self.result.stages.iter().find(|stage| stage.id == id)
    }

    /// The document that stands for a stage. Errors: it has none.
    pub fn summary(&self, id: &str) -> Result<&Value, Failure> {
        let found = self.stage(id).and_then(|stage| {
            stage.result.outputs.iter().find_map(|(port, artifact)| match artifact {
                Artifact::Document(document) if port == SUMMARY => Some(&document.0),
                _ => None,
            })
        });
        found.ok_or_else(|| {
            let problem = format!("{} has no summary of a stage `{id}`", self.files.result.display());
            Failure::failed(problem, Some("`afmid show` says what it holds".to_owned()))
        })
    }

    /// What was found, then where config, result and page are, a line each.
    pub fn text(&self, found: impl Iterator<Item = String>) -> String {
        let count = self.draft.recordings;
        let why = Some(&self.draft.why).filter(|why| !why.is_empty());
        let why = why.map(|why| if count > 1 { format!("{count} files; {why}") } else { why.clone() });
        let files = [&self.files.config, &self.files.result, &self.files.page].map(|path| path.display().to_string());
        why.into_iter().chain(found).chain(files).map(|line| one_line(&line) + "\n").collect()
    }

    /// A stored document with the paths.
    pub fn as_json(&self, found: &Value) -> Value {
        let path = |path: &Path| Value::String(path.display().to_string());
        let mut all = Map::new();
        all.insert("config".to_owned(), path(&self.files.config));
        all.insert("result".to_owned(), path(&self.files.result));
        all.insert("page".to_owned(), path(&self.files.page));
        all.insert("chosen".to_owned(), json!(self.draft.why));
        all.insert("notes".to_owned(), json!(self.draft.notes));
        all.extend(found.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone())));
        Value::Object(all)
    }
}

/// What is written.
pub struct Files {
    pub config: PathBuf,
    pub result: PathBuf,
    pub page: PathBuf,
}

impl Files {
    /// Beside the result that was named, else in the working directory by the first file's name. Errors, usage: a result
    /// with the ending of a config or a page.
    fn of(args: &AtOnceArgs, kind: &str) -> Result<Self, Failure> {
        let result = args.output.clone().unwrap_or_else(|| default_output(&format!("{}.{kind}", stem(args))));
        let (config, page) = (result.with_extension("toml"), result.with_extension("html"));
        if result == config || result == page {
            let help = "name the result with -o, such as -o d.h5: config and page are d.toml and d.html".to_owned();
            return Err(Failure::usage(format!("{} is no name of a result", result.display()), Some(help)));
        }
        Ok(Self { config, result, page })
    }
}

/// The name of the first recording without its ending, or of its folder.
fn stem(args: &AtOnceArgs) -> String {
    let first = args.recordings.paths.first().cloned().unwrap_or_default();
    let name = match first.canonicalize() {
        Ok(folder) if folder.is_dir() => folder.file_name().map(ToOwned::to_owned),
        _ => first.file_stem().map(ToOwned::to_owned),
    };
    name.unwrap_or_else(|| "recordings".into()).to_string_lossy().into_owned()
}

/// Largest config that is compared.
const MOST_BYTES: u64 = 8 << 20;

/// Whether the config is there as it would be written. Errors, usage: another file is: one that a result was made with, too,
/// may be somebody's work.
fn is_the_same(draft: &Draft) -> Result<bool, Failure> {
    let path = &draft.path;
    if path.symlink_metadata().is_err() {
        return Ok(false);
    }
    if read_regular(path, MOST_BYTES).is_ok_and(|bytes| bytes == draft.text.as_bytes()) {
        return Ok(true);
    }
    let problem = format!("{} is there already, and is not what would be written", path.display());
    let help = format!("choose another name with -o, or remove it; `afmid run {}` runs it as it is", quoted(path));
    Err(Failure::usage(problem, Some(help)))
}
