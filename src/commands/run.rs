//! `afmid run`: from a config to a result file.

use std::num::NonZeroU16;
use std::path::{Path, PathBuf};

use afmid_pipeline::cache::Cache;
use afmid_pipeline::error::StoreError;
use afmid_pipeline::files::sweep_folders;
use afmid_pipeline::graph::Stages;
use afmid_pipeline::runner::{Failed, Observer, Options, RunError, run as run_plan, run_to_file};
use afmid_pipeline::store::ResultFile;
use afmid_pipeline::{InputFiles, Plan, RunResult};
use serde_json::{Value, json};

use super::load::load;
use super::sweep;
use super::target::{Input, Target, prepare};
use crate::batch::dataset::{Replaced, all_absolute};
use crate::cli::RunArgs;
use crate::failure::{Failure, Message};
use crate::interrupt;
use crate::output::{print, say};
use crate::printable::{help_line, message, one_line, shown};
use crate::progress::observer;
use crate::relative::folder_of;
use crate::show::pretty;

/// The program and its version, as results state it.
pub const PROGRAM: &str = concat!("afmid ", env!("CARGO_PKG_VERSION"));

/// Runs a config and writes its result file.
pub fn run(args: &RunArgs, stages: &dyn Stages) -> Result<(), Failure> {
    let mut set = args.config.set.clone();
    if !args.files.is_empty() {
        // a config that names none, or such as are not there, still says which stage reads them
        let replaced = load(&args.config.config, &set, stages).ok().and_then(|plan| Replaced::of(&plan));
        let argument =
            all_absolute(&args.files).and_then(|files| replaced.unwrap_or(Replaced::Records).argument(&files));
        set.push(argument.map_err(|problem| Failure::usage(problem, None))?);
    }
    let plan = load(&args.config.config, &set, stages)?;
    if let Some(count) = plan.points() {
        return sweep::run(&plan, count, args);
    }
    let output = args.output.clone().unwrap_or_else(|| default_result(&args.config.config));
    prepare(&output, Target::Result, &inputs(&plan, &args.config.config))?;
    let cache = open_cache(args.cache.as_deref());
    let computation = Computation {
        base: plan.config.base(),
        cache: &cache,
        fresh: args.fresh,
        jobs: args.jobs,
        overrides: &plan.config.overrides,
    };
    let replaced = replaced(&output, &plan);
    let result = run_and_write(&plan, &output, &computation)?;
    replaced.iter().for_each(|note| say(&format!("{note}\n")));
    if args.json {
        return print(&pretty(&as_json(&output, &result))?);
    }
    print(&format!("{}: {}\n", shown(&output), summary(&result)))
}

/// That a result of another config, or of other files, lies where the new one goes; none where nothing is lost by it.
fn replaced(output: &Path, plan: &Plan) -> Option<String> {
    let name = shown(output);
    is_of_another(output, plan)
        .then(|| format!("{name} was the result of another config or of other files: it is replaced (-o keeps both)"))
}

/// Whether a result of another config, or of other files, lies there.
pub fn is_of_another(output: &Path, plan: &Plan) -> bool {
    ResultFile::open(output).is_ok_and(|file| {
        let old = file.run();
        old.config != plan.config_text() || old.overrides != plan.config.overrides
    })
}

/// Runs a plan and writes its result file, with progress on stderr. Errors: those of its stages, a file that cannot be
/// written, an interruption.
pub fn run_and_write(plan: &Plan, output: &Path, how: &Computation<'_>) -> Result<RunResult, Failure> {
    written_folders(plan);
    let result = how.run(|options| run_to_file(plan, options, output));
    warn(how.cache);
    interrupt::check()?;
    result?.map_err(not_written)
}

/// How a run ends that wrote no whole result.
fn not_written(failed: Failed) -> Failure {
    match failed {
        Failed::Stages { errors, kept } => stages_failed(&errors, kept),
        Failed::File(error) => Failure::failed(&error, error.help.clone()),
    }
}

/// Runs a config in this process with these stages and writes its result file; nothing is printed.
pub fn run_here(
    config: &Path,
    set: &[String],
    output: &Path,
    cache: Option<&Path>,
    stages: &dyn Stages,
    observer: &dyn Observer,
) -> Result<(), Failure> {
    let plan = load(config, set, stages)?;
    if plan.points().is_some() {
        let help = Some("take [sweep] out, or run it without stages of one's own".to_owned());
        return Err(Failure::usage("a config with [sweep] is not run in a process", help));
    }
    prepare(output, Target::Result, &inputs(&plan, config))?;
    let cache = open_cache(cache);
    let (base, overrides) = (plan.config.base(), &plan.config.overrides[..]);
    let computation = Computation { base, cache: &cache, fresh: false, jobs: None, overrides };
    written_folders(&plan);
    let result = computation.watched(observer, |options| run_to_file(&plan, options, output))?;
    result.map(drop).map_err(not_written)
}

/// The cache that was asked for, or the user's. What killed processes left in it and in the system's folder for
/// temporary files is removed.
pub fn open_cache(folder: Option<&Path>) -> Cache {
    let folder = cache_folder(folder);
    interrupt::writes_in(&folder);
    interrupt::writes_in(&folder.join("stamps"));
    sweep_folders();
    Cache::open(&folder)
}

/// The stages that write files (`simulate.afm`) do it in the folder that a parameter names, or beside the file that it
/// names.
pub fn written_folders(plan: &Plan) {
    for node in &plan.nodes {
        for place in node.stage.location_params().iter().filter_map(|name| node.params.get(name)?.as_str()) {
            let place = plan.config.base().join(place);
            interrupt::writes_in(folder_of(&place));
            interrupt::writes_in(&place);
        }
    }
}

/// Says what is wrong with a cache: a run goes on to its result all the same.
pub fn warn(cache: &Cache) {
    cache.take_notes().iter().for_each(|note| say(&format!("warning: {}\n", one_line(note))));
}

/// The folder of the cache that was asked for, or the user's.
pub fn cache_folder(folder: Option<&Path>) -> PathBuf {
    folder.map_or_else(default_cache, Path::to_owned)
}

/// How a plan is computed.
pub struct Computation<'a> {
    /// The folder where relative paths begin.
    pub base: &'a Path,
    /// Where stage results are kept.
    pub cache: &'a Cache,
    /// Reuse nothing.
    pub fresh: bool,
    /// Threads; none: one per processor.
    pub jobs: Option<NonZeroU16>,
    /// The `--set` arguments that the result states.
    pub overrides: &'a [String],
}

impl Computation<'_> {
    /// Runs `work` on its threads, with progress on stderr. Errors: there are no threads.
    fn run<T: Send>(&self, work: impl FnOnce(&Options<'_>) -> T + Send) -> Result<T, Failure> {
        let (observer, _run) = (observer(), interrupt::Run::begin());
        self.watched(observer.as_ref(), work)
    }

    /// The same under another observer.
    fn watched<T: Send>(
        &self,
        observer: &dyn Observer,
        work: impl FnOnce(&Options<'_>) -> T + Send,
    ) -> Result<T, Failure> {
        let options = Options {
            base: self.base.to_owned(),
            cache: self.cache,
            files: self.cache.input_files(self.fresh),
            fresh: self.fresh,
            program: PROGRAM.to_owned(),
            overrides: self.overrides.to_vec(),
            observer,
        };
        // 0: as many as there are processors
        let threads = self.jobs.map_or(0, |jobs| usize::from(jobs.get()));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| Failure::failed(format!("no threads can be started: {error}"), None))?;
        Ok(pool.install(|| work(&options)))
    }
}

/// Computes a plan with progress on stderr. Errors: those of its stages.
pub fn compute(plan: &Plan, how: &Computation) -> Result<RunResult, Failure> {
    written_folders(plan);
    let result = how.run(|options| run_plan(plan, options))?;
    interrupt::check()?;
    result.map_err(|errors| stages_failed(&errors, None))
}

/// What failed, and where the rest is.
fn stages_failed(errors: &[RunError], kept: Option<Result<PathBuf, StoreError>>) -> Failure {
    let help = |error: &RunError| error.error.help.as_deref().map(help_line).unwrap_or_default();
    let one = |error: &RunError| format!("error: {}\n{}", message(&error.to_string()), help(error));
    let mut text: String = errors.iter().map(one).collect();
    match kept {
        Some(Ok(file)) => {
            text.push_str(&format!("the stages that went through are in {0}: afmid show {0}\n", shown(&file)));
        }
        Some(Err(error)) => {
            text.push_str(&format!("the stages that went through are not kept: {}\n", message(&error.to_string())))
        }
        None => {}
    }
    Failure::Failed(Message::Rendered(text))
}

/// How many stages were reused.
fn reused(result: &RunResult) -> usize {
    result.info.stages.iter().filter(|(_, _, cached)| *cached).count()
}

fn warnings(result: &RunResult) -> usize {
    result.stages.iter().map(|stage| stage.result.warnings.len()).sum()
}

fn as_json(output: &Path, result: &RunResult) -> Value {
    json!({
        "file": output.display().to_string(),
        "stages": result.stages.len(),
        "reused": reused(result),
        "warnings": warnings(result),
        "seconds": result.info.seconds,
    })
}

fn summary(result: &RunResult) -> String {
    let (count, seconds) = (result.stages.len(), result.info.seconds);
    let (reused, warnings) = (reused(result), warnings(result));
    let mut text = format!("{count} stages in {seconds:.2} s");
    if reused > 0 {
        text.push_str(&format!(", {reused} reused"));
    }
    match warnings {
        0 => {}
        1 => text.push_str(", 1 warning"),
        many => text.push_str(&format!(", {many} warnings")),
    }
    text
}

/// `NAME.h5` in the working directory.
pub fn default_output(name: &str) -> PathBuf {
    let keep = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' };
    let name: String = name.chars().map(keep).collect();
    // a name that begins with a dash would be an option where it is typed again
    let name = name.trim_start_matches(['.', '-']);
    PathBuf::from(format!("{}.h5", if name.is_empty() { "result" } else { name }))
}

/// The folder of several results of a config, in the working directory.
pub fn default_folder(config: &Path) -> PathBuf {
    in_place(stem_of(config))
}

/// The result of a config, in the working directory.
fn default_result(config: &Path) -> PathBuf {
    in_place(stem_of(config) + ".h5")
}

/// A name in the working directory; one that begins with a dash would be an option where it is typed again.
fn in_place(name: String) -> PathBuf {
    if name.starts_with('-') { Path::new(".").join(name) } else { PathBuf::from(name) }
}

/// A config's file name without its ending, as it is.
fn stem_of(config: &Path) -> String {
    config.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// What a run reads: its config and the files of its stages.
pub fn inputs(plan: &Plan, config: &Path) -> Vec<Input> {
    let mut inputs = vec![("the config", config.to_owned())];
    for node in &plan.nodes {
        // files that cannot be listed are for the run to complain about
        let sources = node.stage.sources(plan.config.base(), &InputFiles::new()).unwrap_or_default();
        inputs.extend(sources.into_iter().map(|source| ("a record", source)));
    }
    inputs
}

/// `$AFMID_CACHE`, or `afmid` in the user's cache folder.
fn default_cache() -> PathBuf {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    folder("AFMID_CACHE")
        .or_else(|| folder("XDG_CACHE_HOME").map(|cache| cache.join("afmid")))
        .or_else(|| folder("HOME").map(|home| home.join(".cache").join("afmid")))
        .unwrap_or_else(|| PathBuf::from(".afmid-cache"))
}
