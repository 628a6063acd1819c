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

/// Stands for a stage's id in its errors and warnings, as in `--set <this stage>.order=4`: the runner puts the id there.
pub const THIS_STAGE: &str = "<this stage>";

/// A text of a stage's with its id in it.
pub(crate) fn with_id(text: &str, id: &str) -> String {
    text.replace(THIS_STAGE, id)
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

    /// The id of the stage in the place of [`THIS_STAGE`].
    pub(crate) fn of_stage(mut self, id: &str) -> Self {
        self.problem = with_id(&self.problem, id);
        self.help = self.help.map(|help| with_id(&help, id));
        self
    }

    pub(crate) fn on(mut self, port: &'static str) -> Self {
        self.port.get_or_insert(port);
        self
    }
}
