//! SIGINT, SIGTERM, and SIGHUP and SIGQUIT of a terminal: a command tidies up and ends with 128 and the signal's number
//! (130, 143, 129, 131); a second signal ends it at once.
//!
//! A run looks at [`caught`] before each of its stages and ends by itself, what has succeeded kept in the cache. What
//! takes longer than [`GRACE`], or does not look, is ended from here: processes are killed, what the command has under
//! way under temporary names is removed, in whatever folder, and in those that it named ([`writes_in`]).

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use afmid_pipeline::files::{sweep_all_own, sweep_own};
use afmid_pipeline::plugin::kill_children;
use afmid_pipeline::runner::Observer;
use afmid_pipeline::stage::{NoProgress, Progress};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use signal_hook::{flag, low_level};

use crate::failure::Failure;
use crate::output::report;

/// How long a run may take to end by itself.
const GRACE: Duration = Duration::from_secs(2);

/// How often is looked for what threads begin in the meantime.
const PASSES: usize = 20;

/// A process has one set of signals, so there is one of these.
static STATE: State = State { signal: AtomicI32::new(0), runs: AtomicUsize::new(0), folders: Mutex::new(Vec::new()) };

struct State {
    /// The signal that was caught; 0: none.
    signal: AtomicI32,
    /// Runs under way that look at it.
    runs: AtomicUsize,
    /// Where this process may have files under way.
    folders: Mutex<Vec<PathBuf>>,
}

/// Begins to listen. Signals that were ignored when the command started (`nohup`, a script's `&`) stay ignored. A file
/// that grows beyond the limit of its size (`ulimit -f`) becomes an error of the write instead of a signal that ends
/// the program.
///
/// Errors: the system refuses.
pub fn listen() -> std::io::Result<()> {
    flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
    let ignored = ignored();
    let all = [SIGINT, SIGTERM, SIGHUP, SIGQUIT];
    let wanted: Vec<i32> = all.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0).collect();
    let again = Arc::new(AtomicBool::new(false));
    for &signal in &wanted {
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&again))?;
    }
    let mut signals = Signals::new(&wanted)?;
    let listen = move || {
        let Some(signal) = signals.forever().next() else { return };
        STATE.signal.store(signal, Ordering::SeqCst);
        again.store(true, Ordering::SeqCst);
        kill_children();
        if STATE.runs.load(Ordering::SeqCst) > 0 {
            std::thread::sleep(GRACE);
        }
        end(signal);
    };
    std::thread::Builder::new().name("signals".to_owned()).spawn(listen).map(drop)
}

/// Bits of the signals that are ignored, the first in the lowest.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let bits = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    bits.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok()).unwrap_or(0)
}

/// Tidies up and ends, whatever other threads do.
fn end(signal: i32) -> ! {
    report(Failure::Interrupted(signal));
    let folders = STATE.folders.lock().unwrap_or_else(PoisonError::into_inner).clone();
    // threads that have not noticed may have begun something in between
    for _ in 0..PASSES {
        kill_children();
        let found = folders.iter().map(|folder| sweep_own(folder)).fold(sweep_all_own(), |found, one| found | one);
        if !found {
            break;
        }
    }
    // no destructors of the HDF5 library, which other threads may be in
    low_level::exit(128 + signal)
}

/// The signal that was caught.
pub fn caught() -> Option<i32> {
    Some(STATE.signal.load(Ordering::SeqCst)).filter(|&signal| signal != 0)
}

/// Errors: a signal was caught.
pub fn check() -> Result<(), Failure> {
    caught().map_or(Ok(()), |signal| Err(Failure::Interrupted(signal)))
}

/// This command puts files into a folder, under temporary names first.
pub fn writes_in(folder: &Path) {
    // the working directory does not change, but absolute paths are the same folder once
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let mut folders = STATE.folders.lock().unwrap_or_else(PoisonError::into_inner);
    if !folders.contains(&folder) {
        folders.push(folder);
    }
}

/// A run is under way that looks at [`caught`]; until it is dropped.
pub struct Run(());

impl Run {
    /// It begins.
    pub fn begin() -> Self {
        STATE.runs.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        STATE.runs.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Nobody watches a run, and no further stage of it begins once the command is interrupted.
pub struct Silent;

impl Observer for Silent {
    fn begin(&self, _id: &str) -> Box<dyn Progress + '_> {
        Box::new(NoProgress)
    }

    fn end(&self, _id: &str, _cached: bool, _took: Duration, _warnings: &[String]) {}

    fn is_stopped(&self) -> bool {
        caught().is_some()
    }
}
