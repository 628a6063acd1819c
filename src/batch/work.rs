//! The runs of a batch.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use afmid_pipeline::InputFiles;
use afmid_pipeline::cache::Cache;
use afmid_pipeline::error::StoreError;
use afmid_pipeline::runner::{Failed, Options, RunError, RunKey, Surroundings, run_key, run_to_file};
use afmid_pipeline::store::{FileKind, Written, written};
use afmid_pipeline::{Plan, SourceFile};

use super::harvest::{harvest, numbers};
use super::ledger::{Entry, Ledger};
use crate::interrupt::{self, Silent};
use crate::provenance::repeat::writers;

/// What all runs of a batch have in common.
pub struct Work<'a> {
    /// Where stage results are kept.
    pub cache: &'a Cache,
    /// Hashes of input files.
    pub files: &'a InputFiles,
    /// Where results and ledger lie.
    pub ledger: &'a Ledger,
    /// The program and its version.
    pub program: &'a str,
    /// Reuse nothing.
    pub fresh: bool,
    /// Run what failed once more.
    pub retry_failed: bool,
    /// As `afmid run` would: a result states the config and the arguments as they are now, and stages that write files
    /// have written them.
    pub as_run: bool,
}

/// What became of a data set in this batch.
#[derive(Debug)]
pub struct Done {
    /// As the ledger has it.
    pub entry: Entry,
    /// How long its run took; none if nothing was to be done.
    pub took: Option<Duration>,
    /// Stages of its run, and how many of them were reused.
    pub stages: (usize, usize),
}

impl Work<'_> {
    /// One data set: what the ledger has, if that is still valid, else its run. Whatever goes wrong is in the entry.
    pub fn one(&self, name: &str, plan: &Plan) -> Done {
        let clock = Instant::now();
        let base = plan.config.base();
        let RunKey { key, sources } = match self.key(plan) {
            Ok(known) if self.as_run => RunKey { key: stated(&known.key, plan), ..known },
            Ok(known) => known,
            Err(error) => return self.kept(Entry::failed(name, None, errors_text(&[error])), clock, (0, 0)),
        };
        let again = self.fresh || self.as_run && !writers(plan, base, Path::new("")).is_empty();
        if let Some(entry) = self.ledger.read(name).filter(|entry| entry.key.as_deref() == Some(&key) && !again)
            && (self.ledger.holds(&entry) || !entry.is_done() && !self.retry_failed)
        {
            return Done { entry, took: None, stages: (0, 0) };
        }
        match self.ran(name, plan, base, (&key, &sources)) {
            Ok((entry, stages)) => self.kept(entry, clock, stages),
            // nothing is known of it: the ledger stays as it was
            Err(error) if interrupt::caught().is_some() => {
                Done { entry: Entry::failed(name, Some(key), error), took: Some(clock.elapsed()), stages: (0, 0) }
            }
            Err(error) => match self.elsewhere(name, &key) {
                Some(entry) => Done { entry, took: Some(clock.elapsed()), stages: (0, 0) },
                None => self.kept(Entry::failed(name, Some(key), error), clock, (0, 0)),
            },
        }
    }

    fn key(&self, plan: &Plan) -> Result<RunKey, RunError> {
        let (base, program, files) = (plan.config.base(), self.program, self.files);
        run_key(plan, &Surroundings { base, program, arithmetic: "", files })
    }

    /// What the ledger has of a data set, without running anything: what is no longer what would be run counts as
    /// failed, as does what was never run.
    pub fn found(&self, name: &str, plan: &Plan) -> Done {
        let failed = |why: &str| Entry::failed(name, None, why.to_owned());
        let entry = match (self.key(plan), self.ledger.read(name)) {
            (_, None) => failed("no run of it has ended"),
            (Err(error), Some(_)) => Entry::failed(name, None, errors_text(&[error])),
            (Ok(known), Some(entry)) if entry.key.as_ref().is_some_and(|own| *own != known.key) => {
                failed("its records, the config or the program have changed since its last run: run the batch again")
            }
            (Ok(_), Some(entry)) if entry.is_done() && !self.ledger.holds(&entry) => {
                failed("its result file is gone or cut short: run the batch again")
            }
            (Ok(_), Some(entry)) => entry,
        };
        Done { entry, took: None, stages: (0, 0) }
    }

    /// The same run, if it went through meanwhile in another process: one that failed here, for want of memory or disk,
    /// takes nothing back.
    fn elsewhere(&self, name: &str, key: &str) -> Option<Entry> {
        self.ledger
            .read(name)
            .filter(|entry| entry.key.as_deref() == Some(key) && self.ledger.holds(entry) && !self.fresh)
    }

    fn ran(
        &self,
        name: &str,
        plan: &Plan,
        base: &Path,
        (key, sources): (&str, &[SourceFile]),
    ) -> Result<(Entry, (usize, usize)), String> {
        let path = self.ledger.result(name);
        if let Some(found) = in_the_way(&path) {
            return Err(format!("{} exists and {found}: it is not replaced\n", path.display()));
        }
        let options = Options {
            base: base.to_owned(),
            cache: self.cache,
            files: self.files.clone(),
            fresh: self.fresh,
            program: self.program.to_owned(),
            overrides: plan.config.overrides.clone(),
            observer: &Silent,
        };
        let result = run_to_file(plan, &options, &path).map_err(|failed| match failed {
            Failed::Stages { errors, kept } => errors_text(&errors) + &kept_text(kept),
            Failed::File(error) => error.to_string(),
        })?;
        // the key was made before the run: it is the run's only if both read the same files
        let read = result.stages.iter().flat_map(|stage| &stage.sources);
        if !read.clone().eq(sources) {
            let changed = read.zip(sources).find(|(now, then)| now != then).map(|(now, _)| now.path.as_str());
            return Err(format!("{}: changed while the run began\n", changed.unwrap_or("the list of its files")));
        }
        let mut found = harvest(&result);
        if self.as_run {
            found.numbers = numbers(&result);
        }
        let reused = result.info.stages.iter().filter(|(_, _, cached)| *cached).count();
        Ok((Entry::done(name, key.to_owned(), found), (result.stages.len(), reused)))
    }

    /// A run whose end cannot be written down counts as failed: the next batch would not know of it.
    fn kept(&self, entry: Entry, clock: Instant, stages: (usize, usize)) -> Done {
        let name = entry.name.clone();
        let kept = if entry.is_done() { self.ledger.finish(entry) } else { self.ledger.write(&entry).map(|()| entry) };
        let entry =
            kept.unwrap_or_else(|error| Entry::failed(&name, None, format!("the ledger cannot be written: {error}")));
        Done { entry, took: Some(clock.elapsed()), stages }
    }
}

/// Does all of them, or those before an interruption, at most `threads` at once whatever their number, each on the
/// present rayon pool; `watch` is called at every end. The order of what comes back is that of `sets`.
pub fn all<T: Sync>(
    sets: &[T],
    threads: usize,
    one: impl Fn(&T) -> Done + Sync,
    watch: impl Fn(&Done) + Sync,
) -> Vec<Done> {
    let next = AtomicUsize::new(0);
    let finished: Mutex<Vec<(usize, Done)>> = Mutex::new(Vec::with_capacity(sets.len()));
    std::thread::scope(|scope| {
        for _ in 0..threads.min(sets.len()).max(1) {
            scope.spawn(|| {
                while let Some((index, set)) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|i| Some((i, sets.get(i)?)))
                    && interrupt::caught().is_none()
                {
                    let done = one(set);
                    // what was interrupted has not failed
                    if done.entry.is_done() || interrupt::caught().is_none() {
                        watch(&done);
                    }
                    finished.lock().unwrap_or_else(PoisonError::into_inner).push((index, done));
                }
            });
        }
    });
    let mut finished = finished.into_inner().unwrap_or_else(PoisonError::into_inner);
    finished.sort_by_key(|(index, _)| *index);
    finished.into_iter().map(|(_, done)| done).collect()
}

/// What lies where a result is going to be written and must stay; none if nothing does.
pub fn in_the_way(path: &Path) -> Option<String> {
    // what is not there, or cannot be read, is for the writer to complain about; an empty file holds nothing that could
    // be lost
    match written(path).ok()? {
        Written::AsWritten | Written::CutShort | Written::Other(FileKind::Empty) => None,
        Written::Changed => Some("was changed since afmid wrote it".to_owned()),
        Written::Other(kind) => Some(format!("is {kind}, no result of afmid's")),
    }
}

/// A run's key with all that its result states beside its stages.
fn stated(key: &str, plan: &Plan) -> String {
    let mut hasher = blake3::Hasher::new();
    let overrides = plan.config.overrides.iter().map(String::as_str);
    for part in [key, plan.config_text()].into_iter().chain(overrides) {
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// Where the stages that went through are: beside the results of the others, whatever their folder is called.
fn kept_text(kept: Option<Result<PathBuf, StoreError>>) -> String {
    match kept {
        Some(Ok(file)) => {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            format!("; the stages that went through are in {name}, beside the results")
        }
        Some(Err(error)) => format!("; the stages that went through are not kept: {error}"),
        None => String::new(),
    }
}

fn errors_text(errors: &[RunError]) -> String {
    let one = |error: &RunError| match &error.error.help {
        Some(help) => format!("{error} (help: {help})"),
        None => error.to_string(),
    };
    errors.iter().map(one).collect::<Vec<_>>().join("; ")
}
