//! One run of a plan.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::error::{Failed, RunError};
use super::keys::{StagePlan, Surroundings, plan_node};
use super::schedule::{Board, Outcome, run_graph};
use super::writing::{Made, Pending, keep};
use crate::artifact::Artifact;
use crate::cache::{Cache, Origin, arithmetic};
use crate::error::{StageError, StoreError};
use crate::graph::{Node, Plan};
use crate::outcome::{Ports, RunInfo, RunResult, StageRecord, StageResult, Unfinished};
use crate::recording::{HashedFile, InputFiles};
use crate::rows::Scratch;
use crate::stage::{Caching, Context, Progress};
use crate::store::{PendingResult, ResultFile, RunHead, StageIdentity, Written, check_storable, write_result, written};

/// Who watches a run. Called from several threads.
pub trait Observer: Send + Sync {
    /// A stage begins; its progress goes to what is returned.
    fn begin(&self, id: &str) -> Box<dyn Progress + '_>;
    /// A stage has ended, or its result came from the cache.
    fn end(&self, id: &str, cached: bool, took: Duration, warnings: &[String]);
    /// Whether no further stage shall begin: the run fails, what has succeeded is kept.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Nobody watches.
#[derive(Debug, Clone, Copy)]
pub struct Quiet;

impl Observer for Quiet {
    fn begin(&self, _id: &str) -> Box<dyn Progress + '_> {
        Box::new(crate::stage::NoProgress)
    }

    fn end(&self, _id: &str, _cached: bool, _took: Duration, _warnings: &[String]) {}
}

/// How a plan is run.
pub struct Options<'a> {
    /// The folder of the config: relative paths start there.
    pub base: PathBuf,
    /// Where stage results are kept.
    pub cache: &'a Cache,
    /// What opens and hashes input files: [`Cache::input_files`].
    pub files: InputFiles,
    /// Ignore what the cache holds (results are still put there).
    pub fresh: bool,
    /// The program and its version, for the record.
    pub program: String,
    /// `--set` arguments, for the record.
    pub overrides: Vec<String>,
    /// Who watches.
    pub observer: &'a dyn Observer,
}

struct Finished {
    record: StageRecord,
    origin: Origin,
    seconds: f64,
    cached: bool,
    log: String,
}

/// Runs a plan: each stage as soon as its inputs are there, in parallel on the current rayon pool.
///
/// A stage that needs a result begins at once, while a thread of its own puts the result into the cache, one after the
/// other: a kill loses what was computed in the last moments, and the run ends when all is kept and synced.
/// A result that cannot be kept is a note of the cache's ([`Cache::take_notes`]). Errors: all stages that failed, in
/// the plan's order; independent stages are finished first.
pub fn run(plan: &Plan, options: &Options<'_>) -> Result<RunResult, Vec<RunError>> {
    let Performed { result, errors, .. } = perform(plan, options, None::<fn() -> _>);
    if errors.is_empty() { Ok(result) } else { Err(errors) }
}

/// As [`run`], and writes the result file, each stage as soon as those before it are written: whole or not at all, as
/// [`crate::store::write_result`]. Where stages fail, the results of the others go to [`failed_place`], which says what
/// is missing; `path` is not touched. A run that goes through removes that file. The result of a run that went through,
/// written there by its user, stays as it is.
///
/// Errors: those of [`run`]; the file cannot be written.
pub fn run_to_file(plan: &Plan, options: &Options<'_>, path: &Path) -> Result<RunResult, Failed> {
    let ids: Vec<&str> = plan.nodes.iter().map(|node| node.id.as_str()).collect();
    let needs = needs(plan);
    let begin = || {
        let (name, config) = (plan.name(), plan.config_text());
        let Options { overrides, program, .. } = options;
        PendingResult::new(
            path,
            &RunHead { name, seed: plan.seed(), config, overrides, program, ids: &ids, needs: &needs },
        )
    };
    let Performed { result, errors, file } = perform(plan, options, Some(begin));
    let failed = failed_place(path);
    if !errors.is_empty() {
        let write = || require_no_whole_run(&failed).and_then(|()| write_result(&failed, &result)).map(|()| failed);
        let kept = (!result.stages.is_empty()).then(write);
        return Err(Failed::Stages { errors, kept });
    }
    if let Some(file) = file {
        file.and_then(|file| file.finish(&result.info)).map_err(Failed::File)?;
    }
    if matches!(written(&failed), Ok(Written::AsWritten)) && require_no_whole_run(&failed).is_ok() {
        // one that stays says itself when it was made
        let _ = std::fs::remove_file(&failed);
    }
    Ok(result)
}

/// Where the results of a failed run go that was to be written to `path`: `a.failed.h5` for `a.h5`.
pub fn failed_place(path: &Path) -> PathBuf {
    path.with_extension("failed.h5")
}

/// Errors: the result of a run that went through lies there, which no failed run left.
fn require_no_whole_run(place: &Path) -> Result<(), StoreError> {
    // what cannot be read is for the writer to complain about
    let is_whole = ResultFile::open(place).is_ok_and(|file| file.run().info.unfinished.is_empty());
    if !is_whole {
        return Ok(());
    }
    let problem =
        "exists and is the result of a run that went through: what is left of a failed one does not replace it";
    Err(StoreError::new(problem).file(place).help("give the output another name with -o"))
}

/// A run that has ended.
struct Performed {
    /// What went through.
    result: RunResult,
    /// Stages that failed, in the plan's order.
    errors: Vec<RunError>,
    /// Its result file but for its end, if one was begun.
    file: Pending,
}

/// Runs a plan, and writes its result file but for its end, if `begin` makes one.
fn perform(
    plan: &Plan,
    options: &Options<'_>,
    begin: Option<impl FnOnce() -> Result<PendingResult, StoreError> + Send>,
) -> Performed {
    let (started, clock) = (jiff::Timestamp::now(), Instant::now());
    let needs = needs(plan);
    let failed = |index: usize, error: StageError| {
        let node = &plan.nodes[index];
        RunError { id: node.id.clone(), uses: node.uses.clone(), error: Box::new(error.of_stage(&node.id)) }
    };
    let arithmetic = arithmetic();
    let around =
        Surroundings { base: &options.base, program: &options.program, arithmetic: &arithmetic, files: &options.files };
    let (outcomes, file) = std::thread::scope(|scope| {
        let (made, all) = mpsc::channel::<Made>();
        let keeper = scope.spawn(move || keep(all, options.cache, begin));
        let outcomes = run_graph(&needs, |index, board| {
            step(plan, index, (options, &around), board, &made).map_err(|error| failed(index, error))
        });
        drop(made);
        (outcomes, keeper.join())
    });
    // a panic there is a bug like any other: it goes on here
    let file = file.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let (mut stages, mut times, mut logs) = (Vec::new(), Vec::new(), Vec::new());
    let (mut errors, mut unfinished) = (Vec::new(), Vec::new());
    for (node, outcome) in plan.nodes.iter().zip(outcomes) {
        let without = |reason| Unfinished { id: node.id.clone(), uses: node.uses.clone(), reason };
        match outcome {
            Outcome::Done(finished) => {
                times.push((finished.record.id.clone(), finished.seconds, finished.cached));
                if !finished.log.is_empty() {
                    logs.push((finished.record.id.clone(), finished.log));
                }
                let mut record = finished.record;
                // the cache keeps the others: its files belong to no stage
                record.result.warnings = record.result.warnings_of(&record.id);
                stages.push(record);
            }
            Outcome::Failed(error) => {
                unfinished.push(without(Some(error.error.to_string())));
                errors.push(error);
            }
            Outcome::Skipped => unfinished.push(without(None)),
        }
    }
    let info = RunInfo {
        started_at: started.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
        seconds: clock.elapsed().as_secs_f64(),
        host: host_name(),
        threads: rayon::current_num_threads(),
        folder: std::env::current_dir().map(|folder| folder.display().to_string()).unwrap_or_default(),
        config_file: plan.config.file.clone(),
        stages: times,
        logs,
        unfinished,
    };
    let result = RunResult {
        name: plan.name().to_owned(),
        seed: plan.seed(),
        config: plan.config_text().to_owned(),
        overrides: options.overrides.clone(),
        program: options.program.clone(),
        stages,
        info,
    };
    Performed { result, errors, file }
}

/// The stages that each stage needs, by their places in the plan.
fn needs(plan: &Plan) -> Vec<Vec<usize>> {
    let sources = |node: &Node| {
        let mut sources: Vec<usize> = node.inputs.iter().map(|wire| wire.node).collect();
        sources.sort_unstable();
        sources.dedup();
        sources
    };
    plan.nodes.iter().map(sources).collect()
}

fn step(
    plan: &Plan,
    index: usize,
    (options, around): (&Options<'_>, &Surroundings<'_>),
    board: &Board<Finished, RunError>,
    made: &mpsc::Sender<Made>,
) -> Result<Finished, StageError> {
    let (clock, node) = (Instant::now(), &plan.nodes[index]);
    if options.observer.is_stopped() {
        return Err(StageError::new("was not run: the run was stopped"));
    }
    let upstream = |index: usize| board.done(index).map(|finished| &finished.origin);
    let planned = plan_node(plan, node, around, &upstream)?;
    let spec = node.stage.spec();
    let stored = spec.caching == Caching::Stored;
    let identity = StageIdentity { key: &planned.key, stage: spec.name, version: spec.version, outputs: spec.outputs };
    let hit = if stored && !options.fresh { options.cache.get(&identity, &options.files) } else { None };
    let cached = hit.is_some();
    let mut log = String::new();
    let result = match hit {
        Some(result) => result,
        None => {
            let scratch = Scratch::beside(&options.cache.path(&planned.key));
            let result;
            (result, log) = execute(node, options, board, &planned, scratch)?;
            result
        }
    };
    let took = clock.elapsed();
    options.observer.end(&node.id, cached, took, &result.warnings_of(&node.id));
    let wires = node
        .inputs
        .iter()
        .map(|wire| (wire.port.to_owned(), plan.nodes[wire.node].id.clone(), wire.output.to_owned()))
        .collect();
    let record = StageRecord {
        id: node.id.clone(),
        uses: node.uses.clone(),
        version: spec.version,
        params: node.params.clone(),
        wires,
        seed: planned.seed,
        key: planned.key,
        sources: planned.sources,
        result,
    };
    let origin = (stored && !cached).then(|| planned.origin.clone());
    // the other end lives as long as the run
    let _ = made.send(Made { index, origin, outputs: spec.outputs, record: record.clone() });
    Ok(Finished { record, origin: planned.origin, seconds: took.as_secs_f64(), cached, log })
}

/// Runs the stage itself and checks what it made: the ports it declares, with the shapes that it declares, from files
/// that are still those that were hashed. Beside it: what its process wrote to stderr.
fn execute(
    node: &Node,
    options: &Options<'_>,
    board: &Board<Finished, RunError>,
    planned: &StagePlan,
    scratch: Scratch,
) -> Result<(StageResult, String), StageError> {
    let mut inputs = Ports::new();
    for wire in &node.inputs {
        let artifact = board.done(wire.node).and_then(|finished| finished.record.result.outputs.artifact(wire.output));
        let missing = || StageError::new(format!("the source of port `{}` made no `{}`", wire.port, wire.output));
        inputs.insert(wire.port, artifact.ok_or_else(missing)?.clone());
    }
    let recorded = recorded(&inputs, &options.files)?;
    let progress = options.observer.begin(&node.id);
    let seed = planned.seed.unwrap_or_default();
    let context = Context::new(&options.base, seed, progress.as_ref());
    let context = context.with_scratch(scratch).with_files(options.files.clone());
    let outputs = node.stage.run(&inputs, &context)?;
    check_outputs(node, &outputs)?;
    // the hashes of what was read are in the key: they hold only if nothing has changed since
    planned.hashed.iter().chain(&recorded).try_for_each(HashedFile::check_unchanged)?;
    let log = context.take_log();
    Ok((StageResult { outputs, warnings: context.into_warnings() }, log))
}

/// The files of all recordings among the inputs. Errors: one has other bytes than were recorded.
fn recorded(inputs: &Ports, files: &InputFiles) -> Result<Vec<HashedFile>, StageError> {
    let mut recorded: Vec<(&Path, &str)> = Vec::new();
    for (_, artifact) in inputs.iter() {
        if let Artifact::Recording(recording) = artifact {
            recorded.extend(recording.records.iter().map(|record| (record.path.as_path(), record.blake3.as_str())));
        }
    }
    recorded.sort_unstable();
    recorded.dedup();
    let hashed = |&(path, blake3): &(&Path, &str)| {
        let file = files.hashed(path)?;
        match file.blake3 == blake3 {
            true => Ok(file),
            false => Err(StageError::new("the file is not the one that was recorded: its bytes have changed")
                .at(path)
                .help("run again when nothing writes to it")),
        }
    };
    recorded.par_iter().map(hashed).collect()
}

fn check_outputs(node: &Node, outputs: &Ports) -> Result<(), StageError> {
    let spec = node.stage.spec();
    for port in spec.outputs {
        match outputs.artifact(port.name) {
            Some(artifact) if artifact.shape() == port.shape => {
                artifact.validate().and_then(|()| check_storable(artifact)).map_err(|error| error.on(port.name))?
            }
            Some(artifact) => {
                let (found, wanted) = (artifact.shape().name(), port.shape.name());
                return Err(StageError::new(format!("the stage made a {found}, it declares a {wanted}")).on(port.name));
            }
            None if port.optional => {}
            None => return Err(StageError::new("the stage declares this output and did not make it").on(port.name)),
        }
    }
    match outputs.iter().find(|(name, _)| !spec.outputs.iter().any(|port| port.name == *name)) {
        Some((name, _)) => Err(StageError::new(format!("the stage made `{name}`, which it does not declare"))),
        None => Ok(()),
    }
}

fn host_name() -> String {
    std::env::var("HOSTNAME")
        .ok()
        .or_else(|| std::fs::read_to_string("/etc/hostname").ok())
        .map(|name| name.trim().to_owned())
        .filter(|name| !name.is_empty())
        .unwrap_or_else(|| "unknown".to_owned())
}
