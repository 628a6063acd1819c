//! `afmid diagnose`: from recordings to a verdict; config, result and page side by side.

use std::path::{Path, PathBuf};

use afmid_pipeline::files::read_regular;
use afmid_pipeline::{Artifact, Registry, RunResult};
use afmid_stages::diagnosis::Diagnosis;
use serde_json::{Map, Value, json};

use super::draft::Draft;
use super::report::write_page;
use super::run::{Computation, default_output, inputs, open_cache, run_and_write};
use super::target::{Target, prepare};
use crate::batch::shell::quoted;
use crate::cli::{DiagnoseArgs, Goal};
use crate::failure::Failure;
use crate::output::{print, say};
use crate::printable::{one_line, shown};
use crate::show::{SUMMARY, pretty, verdict_lines};

/// The stage that diagnoses, in every config of the goal.
const STAGE: &str = "diagnosis";

/// Writes the config, runs it, writes the page, and says the verdict.
pub fn run(args: &DiagnoseArgs, registry: &Registry) -> Result<(), Failure> {
    let files = Files::of(args)?;
    let draft = Draft::new(&args.recordings, Some(Goal::Diagnosis), |_| Ok(files.config.clone()), registry)?;
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
    run_and_write(&draft.plan, &files.result, &how)
        .inspect_err(|_| say(&format!("the config is {}\n", shown(&files.config))))?;
    let result = write_page(&files.result, &files.page)?;
    let answer = summary(&result).ok_or_else(|| {
        let problem = format!("{} holds no diagnosis", files.result.display());
        Failure::failed(problem, Some("`afmid show` says what it holds".to_owned()))
    })?;
    let text = if args.json { pretty(&as_json(&draft, &files, answer))? } else { text(&draft, &files, answer)? };
    print(&text)
}

/// What is written.
struct Files {
    config: PathBuf,
    result: PathBuf,
    page: PathBuf,
}

impl Files {
    /// Beside the result that was named, else in the working directory by the first file's name. Errors, usage: a result
    /// with the ending of a config or a page.
    fn of(args: &DiagnoseArgs) -> Result<Self, Failure> {
        let result = args.output.clone().unwrap_or_else(|| default_output(&format!("{}.{STAGE}", stem(args))));
        let (config, page) = (result.with_extension("toml"), result.with_extension("html"));
        if result == config || result == page {
            let help = "name the result with -o, such as -o d.h5: config and page are d.toml and d.html".to_owned();
            return Err(Failure::usage(format!("{} is no name of a result", result.display()), Some(help)));
        }
        Ok(Self { config, result, page })
    }
}

/// The name of the first recording without its ending, or of its folder.
fn stem(args: &DiagnoseArgs) -> String {
    let first = args.recordings.paths.first().cloned().unwrap_or_default();
    let name = match first.canonicalize() {
        Ok(folder) if folder.is_dir() => folder.file_name().map(ToOwned::to_owned),
        _ => first.file_stem().map(ToOwned::to_owned),
    };
    name.unwrap_or_else(|| "recordings".into()).to_string_lossy().into_owned()
}

/// Largest config that is compared.
const MOST_BYTES: u64 = 8 << 20;

/// Whether the config is there as it would be written. Errors, usage: another file is.
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

/// Why, the verdict, its causes, what is left, what to measure next, and where everything is. Errors: no diagnosis.
fn text(draft: &Draft, files: &Files, answer: &Value) -> Result<String, Failure> {
    let unknown = |error: serde_json::Error| {
        Failure::failed(format!("{}: the diagnosis does not read as one: {error}", files.result.display()), None)
    };
    let answer: Diagnosis = serde_json::from_value(answer.clone()).map_err(unknown)?;
    let why = Some(draft.why.clone()).filter(|why| !why.is_empty());
    let paths = [&files.config, &files.result, &files.page].map(|path| path.display().to_string());
    let lines = why.into_iter().chain(verdict_lines(&answer)).chain(paths);
    Ok(lines.map(|line| one_line(&line) + "\n").collect())
}

/// The stored diagnosis with the paths.
fn as_json(draft: &Draft, files: &Files, answer: &Value) -> Value {
    let path = |path: &Path| Value::String(path.display().to_string());
    let mut all = Map::new();
    all.insert("config".to_owned(), path(&files.config));
    all.insert("result".to_owned(), path(&files.result));
    all.insert("page".to_owned(), path(&files.page));
    all.insert("chosen".to_owned(), json!(draft.why));
    all.insert("notes".to_owned(), json!(draft.notes));
    all.extend(answer.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone())));
    Value::Object(all)
}

/// The document of the stage.
fn summary(result: &RunResult) -> Option<&Value> {
    let stage = result.stages.iter().find(|stage| stage.id == STAGE)?;
    stage.result.outputs.iter().find_map(|(port, artifact)| match artifact {
        Artifact::Document(document) if port == SUMMARY => Some(&document.0),
        _ => None,
    })
}
