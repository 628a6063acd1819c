//! What a stage may ask of the runner.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use crate::artifact::RowWriter;
use crate::recording::InputFiles;
use crate::rows::Scratch;

/// Warnings that the result of a stage keeps: a few of every record of a large archive.
pub const MOST_WARNINGS: usize = 10_000;

/// What a stage may ask of the runner: its seed, its folder, a place for warnings and progress.
pub struct Context<'a> {
    base: PathBuf,
    seed: u64,
    warnings: Mutex<Vec<String>>,
    log: Mutex<String>,
    progress: &'a dyn Progress,
    scratch: Scratch,
    files: InputFiles,
    cancel: Cancel,
}

/// Whether work that is under way shall end without a result. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// It shall.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it shall.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Where progress goes. Implementations are called from several threads.
pub trait Progress: Send + Sync {
    /// `total` items of work lie ahead in a stage.
    fn expect(&self, total: u64);
    /// One is done.
    fn tick(&self);
}

/// Progress that nobody looks at.
#[derive(Debug, Clone, Copy)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn expect(&self, _total: u64) {}
    fn tick(&self) {}
}

impl<'a> Context<'a> {
    /// A context for one run of one stage.
    pub fn new(base: &Path, seed: u64, progress: &'a dyn Progress) -> Self {
        Self {
            base: base.to_owned(),
            seed,
            warnings: Mutex::new(Vec::new()),
            log: Mutex::default(),
            progress,
            scratch: Scratch::default(),
            files: InputFiles::new(),
            cancel: Cancel::default(),
        }
    }

    /// A context for a stage that is run by itself, in the working directory.
    pub fn alone(seed: u64) -> Self {
        Self::new(Path::new("."), seed, &NoProgress)
    }

    /// The same with another place for rows that are too many for memory; the runner's is the cache's folder.
    #[must_use]
    pub fn with_scratch(self, scratch: Scratch) -> Self {
        Self { scratch, ..self }
    }

    /// The same with what is known of input files; the runner's is the run's.
    #[must_use]
    pub fn with_files(self, files: InputFiles) -> Self {
        Self { files, ..self }
    }

    /// The same ended by `cancel`: for a stage that is run by itself. The runner's stages end with its process.
    #[must_use]
    pub fn with_cancel(self, cancel: Cancel) -> Self {
        Self { cancel, ..self }
    }

    /// Whether the stage shall end; long ones look.
    pub fn cancel(&self) -> &Cancel {
        &self.cancel
    }

    /// What opens and hashes input files.
    pub fn files(&self) -> &InputFiles {
        &self.files
    }

    /// A writer of rows, say the windows of events: in memory up to some megabytes, in a file without a name beyond.
    pub fn row_writer(&self, row_length: usize) -> RowWriter {
        RowWriter::new(self.scratch.clone(), row_length)
    }

    /// The folder of the config file: relative paths in parameters start there.
    pub fn base(&self) -> &Path {
        &self.base
    }

    /// The seed of this stage, derived from the pipeline's seed and the stage's id.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Keeps a warning as data: it is stored with the result and shown. Say what was found, with numbers, and what to
    /// do.
    ///
    /// Call it in a fixed order (not from parallel work): warnings are part of the result. A NUL in one, at which it
    /// would end in HDF5, becomes U+FFFD.
    pub fn warn(&self, text: impl Into<String>) {
        let text: String = text.into();
        let text = if text.contains('\0') { text.replace('\0', "\u{fffd}") } else { text };
        self.warnings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(text);
    }

    /// Keeps what a process of another program said, beside the times of the run: a record for people, no part of the
    /// result.
    pub fn log(&self, text: &str) {
        self.log.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push_str(text);
    }

    /// What was kept so far.
    pub fn take_log(&self) -> String {
        std::mem::take(&mut self.log.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }

    /// Announces items of work; call [`Context::tick`] for each, from any thread.
    pub fn expect(&self, total: usize) {
        self.progress.expect(total as u64);
    }

    /// One item is done.
    pub fn tick(&self) {
        self.progress.tick();
    }

    /// The warnings so far; beyond 10,000 of them, how many there were.
    pub fn into_warnings(self) -> Vec<String> {
        let mut warnings = self.warnings.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        if warnings.len() > MOST_WARNINGS {
            let beyond = warnings.len() - MOST_WARNINGS;
            warnings.truncate(MOST_WARNINGS);
            warnings.push(format!("{beyond} more warnings: a result keeps {MOST_WARNINGS} of each stage"));
        }
        warnings
    }
}
