//! One run of a plan.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use super::error::{Failed, RunError};
use super::keeper::{Made, Pending, keep};
use super::keys::plan_node;
use super::result::{RunInfo, RunResult, StageRecord, StageResult};
use super::schedule::{Board, Outcome, run_graph};
use crate::cache::{Cache, Origin, PendingResult};
use crate::error::StageError;
use crate::graph::{Node, Plan};
use crate::rows::Scratch;
use crate::stage::{Caching, Context, Ports, Progress};
use crate::store::{RunHead, StoreError};

/// Who watches a run. Called from several threads.
pub trait Observer: Send + Sync {
    /// A stage begins; its progress goes to what is returned.
    fn begin(&self, id: &str) -> Box<dyn Progress + '_>;
    /// A stage has ended, or its result came from the cache.
    fn end(&self, id: &str, cached: bool, took: Duration, warnings: &[String]);
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
/// A stage that needs a result begins at once, while a thread of its own puts the result into the cache, one after the other: a kill loses what
/// was computed in the last moments, and the run ends when all is kept and synced.
/// Errors: all stages that failed or whose results cannot be kept, in the plan's order; independent stages are finished first.
pub fn run(plan: &Plan, options: &Options<'_>) -> Result<RunResult, Vec<RunError>> {
    perform(plan, options, None::<fn() -> _>).map(|(result, _)| result)
}

/// As [`run`], and writes the result file, each stage as soon as those before it are written: whole or not at all, as [`crate::cache::write_result`].
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
    let (result, file) = perform(plan, options, Some(begin)).map_err(Failed::Stages)?;
    if let Some(file) = file {
        file.and_then(|file| file.finish(&result.info)).map_err(Failed::File)?;
    }
    Ok(result)
}

/// A run, and its result file but for its end, if `begin` makes one.
fn perform(
    plan: &Plan,
    options: &Options<'_>,
    begin: Option<impl FnOnce() -> Result<PendingResult, StoreError> + Send>,
) -> Result<(RunResult, Pending), Vec<RunError>> {
    let (started, clock) = (jiff::Timestamp::now(), Instant::now());
    let needs = needs(plan);
    let failed = |index: usize, error: StageError| {
        let node = &plan.nodes[index];
        RunError { id: node.id.clone(), uses: node.uses.clone(), error: Box::new(error) }
    };
    let (outcomes, kept) = std::thread::scope(|scope| {
        let (made, all) = mpsc::channel::<Made>();
        let keeper = scope.spawn(move || keep(all, options.cache, begin));
        let outcomes = run_graph(&needs, |index, board| {
            step(plan, index, options, board, &made).map_err(|error| failed(index, error))
        });
        drop(made);
        (outcomes, keeper.join())
    });
    // a panic there is a bug like any other: it goes on here
    let mut kept = kept.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let (mut stages, mut times, mut errors, mut logs) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (index, outcome) in outcomes.into_iter().enumerate() {
        if let Some(error) = kept.unkept.remove(&index) {
            errors.push(failed(index, error.into()));
        }
        match outcome {
            Outcome::Done(finished) => {
                times.push((finished.record.id.clone(), finished.seconds, finished.cached));
                if !finished.log.is_empty() {
                    logs.push((finished.record.id.clone(), finished.log));
                }
                stages.push(finished.record);
            }
            Outcome::Failed(error) => errors.push(error),
            Outcome::Skipped => {}
        }
    }
    if !errors.is_empty() {
        return Err(errors);
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
    Ok((result, kept.file))
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
    options: &Options<'_>,
    board: &Board<Finished, RunError>,
    made: &mpsc::Sender<Made>,
) -> Result<Finished, StageError> {
    let (clock, node) = (Instant::now(), &plan.nodes[index]);
    let upstream = |index: usize| board.done(index).map(|finished| &finished.origin);
    let planned = plan_node(plan, node, &options.base, &options.program, &upstream)?;
    let stored = node.stage.spec().caching == Caching::Stored;
    let hit = if stored && !options.fresh { options.cache.get(&planned.key) } else { None };
    let cached = hit.is_some();
    let mut log = String::new();
    let result = match hit {
        Some(result) => result,
        None => {
            let scratch = Scratch::beside(&options.cache.path(&planned.key));
            let result;
            (result, log) = execute(node, options, board, planned.seed.unwrap_or_default(), scratch)?;
            result
        }
    };
    let took = clock.elapsed();
    options.observer.end(&node.id, cached, took, &result.warnings);
    let wires = node
        .inputs
        .iter()
        .map(|wire| (wire.port.to_owned(), plan.nodes[wire.node].id.clone(), wire.output.to_owned()))
        .collect();
    let record = StageRecord {
        id: node.id.clone(),
        uses: node.uses.clone(),
        version: node.stage.spec().version,
        params: node.params.clone(),
        wires,
        seed: planned.seed,
        key: planned.key,
        sources: planned.sources,
        result,
    };
    let origin = (stored && !cached).then(|| planned.origin.clone());
    // the other end lives as long as the run
    let _ = made.send(Made { index, origin, record: record.clone() });
    Ok(Finished { record, origin: planned.origin, seconds: took.as_secs_f64(), cached, log })
}

/// Runs the stage itself and checks what it made: the ports it declares, with the shapes that it declares. Beside it: what its process said.
fn execute(
    node: &Node,
    options: &Options<'_>,
    board: &Board<Finished, RunError>,
    seed: u64,
    scratch: Scratch,
) -> Result<(StageResult, String), StageError> {
    let mut inputs = Ports::new();
    for wire in &node.inputs {
        let artifact = board.done(wire.node).and_then(|finished| finished.record.result.outputs.artifact(wire.output));
        let missing = || StageError::new(format!("the source of port `{}` made no `{}`", wire.port, wire.output));
        inputs.insert(wire.port, artifact.ok_or_else(missing)?.clone());
    }
    let progress = options.observer.begin(&node.id);
    let context = Context::new(&options.base, seed, progress.as_ref()).with_scratch(scratch);
    let outputs = node.stage.run(&inputs, &context)?;
    check_outputs(node, &outputs)?;
    let log = context.take_log();
    Ok((StageResult { outputs, warnings: context.into_warnings() }, log))
}

fn check_outputs(node: &Node, outputs: &Ports) -> Result<(), StageError> {
    let spec = node.stage.spec();
    for port in spec.outputs {
        match outputs.artifact(port.name) {
            Some(artifact) if artifact.shape() == port.shape => {
                artifact.validate().map_err(|error| error.on(port.name))?
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
