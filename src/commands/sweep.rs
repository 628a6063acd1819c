//! `afmid run` of a config with `[sweep]`: a run per point, one table of them all.

use std::path::{Path, PathBuf};
use std::time::Instant;

use afmid_pipeline::{Artifact, Plan};
use serde_json::{Value, json};

use super::batch::ledger;
use super::run::{PROGRAM, default_folder, open_cache, warn, written_folders};
use crate::batch::ledger::{Entry, Ledger};
use crate::batch::summary::{SWEEP, Tables, Title};
use crate::batch::work::{Done, Work, all};
use crate::cli::RunArgs;
use crate::failure::{Failure, Message};
use crate::interrupt;
use crate::output::print;
use crate::printable::{self, message, one_line};
use crate::progress::Sets;
use crate::show::{artifact_text, pretty};
use crate::sweep::point::{self, Point};
use crate::sweep::table::{shown, table};

/// Runs all points, one after the other: each finds in the cache what those before it have computed. One that fails
/// stops no other; then the exit code is 3.
pub fn run(plan: &Plan, count: usize, args: &RunArgs) -> Result<(), Failure> {
    let clock = Instant::now();
    let folder = folder(args)?;
    let ledger = ledger(&folder)?;
    let tables = Tables::open(&folder, SWEEP)?;
    let points = computed(plan, count, args, &ledger)?;
    let title = Title { name: plan.name(), seed: plan.seed(), config: plan.config_text(), program: PROGRAM };
    let summary = tables.write_sweep(&title, table(&points))?;
    let outcome = Outcome { folder: &folder, points: &points, summary: &summary, ledger: &ledger };
    print(&if args.json { pretty(&outcome.json())? } else { outcome.text(clock) })?;
    match points.iter().filter(|point| !point.done.entry.is_done()).count() {
        0 => Ok(()),
        failed => Err(Failure::Partly(Message::Line(
            format!("{failed} of {count} points failed"),
            Some("what is wrong with each stands above and in `ledger`; the next run tries them again".to_owned()),
        ))),
    }
}

/// Errors, usage: the plan has a sweep, and the command is for one set of parameters, as `why` says.
pub fn refuse(plan: &Plan, why: &str) -> Result<(), Failure> {
    if plan.points().is_none() {
        return Ok(());
    }
    let swept: Vec<&str> = plan.config.sweep.iter().map(|swept| swept.name.as_str()).collect();
    let help = format!("set {} with --set, or remove [sweep]; `afmid run` runs every point", swept.join(" and "));
    Err(Failure::usage(format!("the config {} has a [sweep]: {why}", plan.config.file), Some(help)))
}

/// The folder of the results. Errors, usage: `-o` names a result file.
fn folder(args: &RunArgs) -> Result<PathBuf, Failure> {
    let Some(output) = &args.output else { return Ok(default_folder(&args.config.config)) };
    if output.extension().is_some_and(|extension| extension == "h5") {
        let message = format!("{} is one file, and the config has a [sweep]: wanted a folder", output.display());
        let help = format!("every point has a result file in it: `-o {}`", output.with_extension("").display());
        return Err(Failure::usage(message, Some(help)));
    }
    Ok(output.clone())
}

fn computed(plan: &Plan, count: usize, args: &RunArgs, ledger: &Ledger) -> Result<Vec<Point>, Failure> {
    let cache = open_cache(args.cache.as_deref());
    // 0: as many as there are processors
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.map_or(0, |jobs| usize::from(jobs.get()))).build();
    let pool = pool.map_err(|error| Failure::failed(format!("no threads can be started: {error}"), None))?;
    let files = cache.input_files(args.fresh);
    let work = Work {
        cache: &cache,
        files: &files,
        ledger,
        program: PROGRAM,
        fresh: args.fresh,
        retry_failed: true,
        as_run: true,
    };
    written_folders(plan);
    let (progress, run) = (Sets::new("points", count), interrupt::Run::begin());
    let one = |&index: &usize| match plan.point(index) {
        Ok(point) => pool.install(|| work.one(&point::name(index), &point)),
        Err(problems) => {
            let error = problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
            Done { entry: Entry::failed(&point::name(index), None, error), took: None, stages: (0, 0) }
        }
    };
    let indices: Vec<usize> = (0..count).collect();
    // one at a time: two at once would both compute what they share
    let done = all(&indices, 1, one, |done| progress.ended(done));
    drop((progress, run));
    warn(&cache);
    interrupt::check()?;
    Ok((0..).zip(done).map(|(index, done)| Point { values: plan.values(index), done }).collect())
}

struct Outcome<'a> {
    folder: &'a Path,
    points: &'a [Point],
    summary: &'a Path,
    ledger: &'a Ledger,
}

impl Outcome<'_> {
    fn failed(&self) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(|point| !point.done.entry.is_done())
    }

    fn ran(&self) -> usize {
        self.points.iter().filter(|point| point.done.took.is_some()).count()
    }

    /// Stages of all runs, and how many of them were reused.
    fn stages(&self) -> (usize, usize) {
        let sum = |of: fn(&Point) -> usize| self.points.iter().map(of).sum();
        (sum(|point| point.done.stages.0), sum(|point| point.done.stages.1))
    }

    fn text(&self, clock: Instant) -> String {
        let mut text = artifact_text(&Artifact::Table(shown(self.points).into()));
        for point in self.failed() {
            let (entry, values) = (&point.done.entry, point.values_text());
            let error = message(entry.error.as_deref().unwrap_or_default());
            text.push_str(&format!("{} ({}) failed: {error}\n", entry.name, one_line(&values)));
        }
        let (count, ran, (stages, reused)) = (self.points.len(), self.ran(), self.stages());
        text.push_str(&format!(
            "{}: {count} point{} in {:.2} s, {ran} run ({stages} stages, {reused} reused), {} as they were, {} \
             failed\n",
            printable::shown(self.folder),
            if count == 1 { "" } else { "s" },
            clock.elapsed().as_secs_f64(),
            count - ran,
            self.failed().count(),
        ));
        text.push_str(&format!("summary: {} (.csv, .parquet)\n", printable::shown(self.summary)));
        text
    }

    fn json(&self) -> Value {
        let (stages, reused) = self.stages();
        json!({
            "folder": self.folder.display().to_string(),
            "points": self.points.iter().map(|point| self.point(point)).collect::<Vec<_>>(),
            "ran": self.ran(),
            "failed": self.failed().count(),
            "stages": stages,
            "reused": reused,
            "summary": self.summary.display().to_string(),
        })
    }

    fn point(&self, point: &Point) -> Value {
        let entry = &point.done.entry;
        let values: serde_json::Map<String, Value> = point.values.iter().cloned().collect();
        let mut value = json!({
            "point": entry.name,
            "values": values,
            "file": entry.is_done().then(|| self.ledger.result(&entry.name).display().to_string()),
            "ran": point.done.took.is_some(),
            "stages": point.done.stages.0,
            "reused": point.done.stages.1,
            "error": entry.error,
            "found": entry.found,
        });
        // the ledger leaves it out where there are none
        value["found"]["numbers"] = json!(entry.found.numbers);
        value
    }
}
