//! What the store says when a file cannot be written or read.

use std::path::{Path, PathBuf};

use super::StageError;

/// Why a file could not be written or read: the file, the place within it, what was found and what was wanted.
#[derive(Debug, thiserror::Error)]
#[error("{}{problem} ({})", if place.is_empty() { String::new() } else { format!("{place}: ") }, file.display())]
pub struct StoreError {
    /// The file.
    pub file: PathBuf,
    /// The object in it; empty if the file as a whole is meant.
    pub place: String,
    /// What was found, and what was wanted.
    pub problem: String,
    /// What to do.
    pub help: Option<String>,
}

pub(crate) type Result<T> = std::result::Result<T, StoreError>;

impl StoreError {
    pub(crate) fn new(problem: impl Into<String>) -> Self {
        Self { file: PathBuf::new(), place: String::new(), problem: problem.into(), help: None }
    }

    pub(crate) fn io(doing: &str, file: &Path, error: &std::io::Error) -> Self {
        Self::new(format!("{doing}: {error}")).file(file)
    }

    /// Names the file, unless one is named already.
    pub(crate) fn file(mut self, file: &Path) -> Self {
        if self.file.as_os_str().is_empty() {
            file.clone_into(&mut self.file);
        }
        self
    }

    /// Names the object, unless one is named already.
    pub(crate) fn at(mut self, place: impl Into<String>) -> Self {
        if self.place.is_empty() {
            self.place = place.into();
        }
        self
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl From<hdf5::Error> for StoreError {
    fn from(error: hdf5::Error) -> Self {
        Self::new(format!("HDF5: {error}"))
    }
}

impl From<StoreError> for StageError {
    fn from(error: StoreError) -> Self {
        let problem =
            if error.place.is_empty() { error.problem } else { format!("{}: {}", error.place, error.problem) };
        Self { help: error.help, ..Self::new(problem).at(error.file) }
    }
}

impl From<StageError> for StoreError {
    fn from(error: StageError) -> Self {
        let file = error.place.unwrap_or_default();
        Self { file, place: String::new(), problem: error.problem, help: error.help }
    }
}
