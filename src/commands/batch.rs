//! `afmid batch`: one run per data set, a ledger of them, one table.

use std::io::{Error, ErrorKind};
use std::path::Path;
use std::time::Instant;

use afmid_pipeline::files::read_regular;
use afmid_pipeline::graph::Stages;
use afmid_pipeline::{Artifact, Plan};
use serde_json::json;

use super::load::load;
use super::run::{PROGRAM, default_folder, is_of_another, open_cache, warn, written_folders};
use super::sweep::refuse;
use super::target::make_folder;
use crate::batch::dataset::{DataSet, Replaced, sorted};
use crate::batch::ledger::{Entry, Ledger};
use crate::batch::manifest;
use crate::batch::summary::{self, BATCH, Tables, Title};
use crate::batch::work::{Done, Work, all};
use crate::cli::{BatchArgs, ConfigArgs, SetsArgs};
use crate::failure::{Failure, Message};
use crate::interrupt;
use crate::output::{print, say};
use crate::printable::{message, one_line, shown};
use crate::progress::Sets;
use crate::show::{artifact_text, pretty};

/// Runs a config on every data set. One that fails stops no other; then the exit code is 3.
pub fn run(args: &BatchArgs, stages: &dyn Stages) -> Result<(), Failure> {
    let clock = Instant::now();
    let sets = data_sets(&args.sets)?;
    let whole = whole(&args.config, stages)?;
    let folder = args.output.clone().unwrap_or_else(|| default_folder(&args.config.config));
    let ledger = ledger(&folder)?;
    // a shard writes none: the run with `--collect` does
    let tables = args.shard.is_none().then(|| Tables::open(&folder, BATCH)).transpose()?;
    let own = |set: &&DataSet| args.shard.is_none_or(|shard| shard.holds(&set.name));
    let plans = planned(&args.config, sets.iter().filter(own), stages)?;
    let notes = there(&folder, &ledger, &sets, &plans);
    let done = computed(args, &plans, &ledger)?;
    notes.iter().for_each(|note| say(&format!("{note}\n")));
    let entries: Vec<Entry> = done.iter().map(|done| done.entry.clone()).collect();
    let title = Title { name: whole.name(), seed: whole.seed(), config: whole.config_text(), program: PROGRAM };
    let table = tables.map(|tables| tables.write_batch(&title, &entries)).transpose()?;
    print(&outcome(args.json, &folder, &done, table.as_deref(), clock)?)?;
    match entries.iter().filter(|entry| !entry.is_done()).count() {
        0 => Ok(()),
        failed => Err(Failure::Partly(Message::Line(
            format!("{failed} of {} data sets failed", entries.len()),
            Some(
                "what is wrong with each stands above and in `ledger`; those that changed are run by the next batch, \
                the others with --retry-failed"
                    .to_owned(),
            ),
        ))),
    }
}

/// Results that are looked at for what they were made of: more take longer than they are worth.
const LOOKED_AT: usize = 1000;

/// What is to be said of the results that lie in the folder already: those of another config or of other files, which this
/// batch replaces, and those that it has not.
fn there(folder: &Path, ledger: &Ledger, sets: &[DataSet], plans: &[(&DataSet, Plan)]) -> Vec<String> {
    let replaced =
        plans.iter().take(LOOKED_AT).filter(|(set, plan)| is_of_another(&ledger.result(&set.name), plan)).count();
    let beside = ledger.beside(&sets.iter().map(|set| &set.name[..]).collect());
    let results = |count: usize| if count == 1 { "1 result".to_owned() } else { format!("{count} results") };
    let folder = shown(folder);
    let of_replaced = || {
        let (was, are) = if replaced == 1 { ("was", "is") } else { ("were", "are") };
        format!(
            "{} in {folder} {was} of another config or of other files: {are} replaced (-o keeps both)",
            results(replaced)
        )
    };
    let of_beside = || {
        format!(
            "{} in {folder} of data sets that this batch has not: left there, and not in its summary",
            results(beside)
        )
    };
    let all = [(replaced > 0).then(of_replaced), (beside > 0).then(of_beside)];
    all.into_iter().flatten().collect()
}

/// The plan of the config alone. Errors, usage: what is wrong with it; it has no stage whose files a batch can replace.
pub fn whole(config: &ConfigArgs, stages: &dyn Stages) -> Result<Plan, Failure> {
    let whole = load(&config.config, &config.set, stages)?;
    replaced(&whole)?;
    Ok(whole)
}

/// What the data sets replace. Errors, usage: the plan has no stage for it.
fn replaced(whole: &Plan) -> Result<Replaced, Failure> {
    Replaced::of(whole).ok_or_else(|| {
        let help =
            "a batch replaces the files of `records` or `data`: give the stage that reads the recordings that id";
        Failure::usage("the config has no stage `records` or `data`", Some(help.to_owned()))
    })
}

/// The largest manifest: millions of data sets.
const MOST_MANIFEST_BYTES: u64 = 1 << 30;

/// All that were named. Errors, usage: everything that is wrong with them.
pub fn data_sets(args: &SetsArgs) -> Result<Vec<DataSet>, Failure> {
    let (mut sets, mut problems) = (Vec::new(), Vec::new());
    for path in &args.paths {
        DataSet::of_path(path).map_or_else(|problem| problems.push(problem), |set| sets.push(set));
    }
    for file in &args.manifest {
        let shown = file.display().to_string();
        let text = read_regular(file, MOST_MANIFEST_BYTES)
            .and_then(|bytes| String::from_utf8(bytes).map_err(|error| Error::new(ErrorKind::InvalidData, error)));
        match text {
            Err(error) => problems.push(format!("the manifest {shown} cannot be read: {error}")),
            Ok(text) => match manifest::read(&shown, &text) {
                Ok(more) => sets.extend(more),
                Err(more) => problems.extend(more),
            },
        }
    }
    if problems.is_empty() && sets.is_empty() {
        problems.push("no data sets are named, wanted folders, files or a manifest".to_owned());
    }
    match sorted(sets) {
        Ok(sets) if problems.is_empty() => return Ok(sets),
        Ok(_) => {}
        Err(more) => problems.extend(more),
    }
    let lines: String = problems.iter().map(|problem| format!("error: {}\n", message(problem))).collect();
    Err(Failure::Usage(Message::Rendered(lines)))
}

/// The plan of each. Errors, usage: what is wrong with the arguments of the first that has something wrong.
pub fn planned<'a>(
    config: &ConfigArgs,
    sets: impl Iterator<Item = &'a DataSet>,
    stages: &dyn Stages,
) -> Result<Vec<(&'a DataSet, Plan)>, Failure> {
    let replaced = replaced(&load(&config.config, &config.set, stages)?)?;
    sets.map(|set| {
        let own = set.arguments(replaced).map_err(|problem| Failure::usage(problem, None))?;
        let arguments: Vec<String> = config.set.iter().cloned().chain(own).collect();
        let plan = load(&config.config, &arguments, stages)?;
        refuse(&plan, "a batch runs one set of parameters on each data set")?;
        Ok((set, plan))
    })
    .collect()
}

/// The ledger of a folder of results, which is made if only that is missing. Errors, usage: it cannot be made.
pub fn ledger(folder: &Path) -> Result<Ledger, Failure> {
    make_folder(folder)?;
    interrupt::writes_in(&folder.join("ledger"));
    Ledger::open(folder).map_err(|error| {
        let help = "give another folder with -o".to_owned();
        Failure::usage(format!("the folder {} cannot be made: {error}", folder.display()), Some(help))
    })
}

fn computed(args: &BatchArgs, sets: &[(&DataSet, Plan)], ledger: &Ledger) -> Result<Vec<Done>, Failure> {
    let cache = open_cache(args.cache.as_deref());
    let files = cache.input_files(args.fresh);
    // 0: as many as there are processors
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.map_or(0, |jobs| usize::from(jobs.get()))).build();
    let pool = pool.map_err(|error| Failure::failed(format!("no threads can be started: {error}"), None))?;
    let work = Work {
        cache: &cache,
        files: &files,
        ledger,
        program: PROGRAM,
        fresh: args.fresh,
        retry_failed: args.retry_failed,
        as_run: false,
    };
    sets.iter().for_each(|(_, plan)| written_folders(plan));
    let (progress, run) = (Sets::new("data sets", sets.len()), interrupt::Run::begin());
    let one = |(set, plan): &(&DataSet, Plan)| match args.collect {
        true => work.found(&set.name, plan),
        false => pool.install(|| work.one(&set.name, plan)),
    };
    let done = all(sets, pool.current_num_threads(), one, |done| progress.ended(done));
    drop((progress, run));
    warn(&cache);
    interrupt::check()?;
    Ok(done)
}

fn outcome(json: bool, folder: &Path, done: &[Done], table: Option<&Path>, clock: Instant) -> Result<String, Failure> {
    let failed: Vec<&Entry> = done.iter().map(|done| &done.entry).filter(|entry| !entry.is_done()).collect();
    let ran = done.iter().filter(|done| done.took.is_some()).count();
    if json {
        let failures = failed.iter().map(|entry| json!({ "name": entry.name, "error": entry.error }));
        return pretty(&json!({
            "folder": folder.display().to_string(),
            "data_sets": done.len(),
            "ran": ran,
            "failed": failed.len(),
            "failures": failures.collect::<Vec<_>>(),
            "summary": table.map(|table| table.display().to_string()),
        }));
    }
    let found = table_of(done);
    let mut text: String = failed
        .iter()
        .map(|entry| {
            format!("{} failed: {}\n", one_line(&entry.name), message(entry.error.as_deref().unwrap_or_default()))
        })
        .collect();
    let (count, seconds) = (done.len(), clock.elapsed().as_secs_f64());
    let sets = if count == 1 { "data set" } else { "data sets" };
    text.push_str(&format!(
        "{}: {count} {sets} in {seconds:.2} s, {ran} run, {} as they were, {} failed\n",
        shown(folder),
        count - ran,
        failed.len()
    ));
    text.insert_str(0, &found);
    if let Some(table) = table {
        text.push_str(&format!("summary: {} (.csv, .parquet), trends.csv\n", shown(table)));
    }
    Ok(text)
}

/// Most rows of the table that is printed: as many as most windows have.
const ROWS: usize = 50;

/// What was found, where it fits into a window.
fn table_of(done: &[Done]) -> String {
    let entries: Vec<Entry> = done.iter().map(|done| done.entry.clone()).collect();
    let table = summary::shown(&entries);
    if !(1..=ROWS).contains(&table.rows()) || table.columns.len() < 2 {
        return String::new();
    }
    artifact_text(&Artifact::Table(table.into()))
}
