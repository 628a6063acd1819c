//! What a stage says when it cannot go on.

use std::path::PathBuf;

/// Why a stage failed. A stage never names itself: the runner adds the config's place, the stage's id and the port.
///
/// Write a lowercase fragment that reads after "failed to run stage `x`:" and states what was found and what was
/// wanted;
/// put what to do into [`StageError::help`].
#[derive(Debug, thiserror::Error)]
#[error("{problem}{}", place.as_ref().map(|place| format!(" ({})", place.display())).unwrap_or_default())]
pub struct StageError {
    /// What was found, and what was wanted.
    pub problem: String,
    /// The file that it is about.
    pub place: Option<PathBuf>,
    /// What to do.
    pub help: Option<String>,
    /// The port that it is about.
    pub port: Option<&'static str>,
    /// What caused it.
    #[source]
    pub source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

impl StageError {
    /// An error from what was found and what was wanted.
    pub fn new(problem: impl Into<String>) -> Self {
        Self { problem: problem.into(), place: None, help: None, port: None, source: None }
    }

    /// An error of a kernel or library, kept as the source.
    pub fn from_error(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self { source: None, ..Self::new(error.to_string()) }.caused_by(error)
    }

    /// Names the file that it is about.
    #[must_use]
    pub fn at(mut self, place: impl Into<PathBuf>) -> Self {
        self.place = Some(place.into());
        self
    }

    /// Says what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Keeps the cause.
    #[must_use]
    pub fn caused_by(mut self, error: impl std::error::Error + Send + Sync + 'static) -> Self {
        self.source = Some(Box::new(error));
        self
    }

    pub(crate) fn on(mut self, port: &'static str) -> Self {
        self.port.get_or_insert(port);
        self
    }
}
