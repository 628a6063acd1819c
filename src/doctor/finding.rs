//! One thing that was looked at.

/// How it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// As it should be.
    Good,
    /// A run works, but not as it could.
    Warning,
    /// A run fails.
    Bad,
}

impl State {
    /// Its name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Warning => "warning",
            Self::Bad => "bad",
        }
    }
}

/// What was looked at, what was found, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    pub what: &'static str,
    pub state: State,
    pub found: String,
    pub help: Option<String>,
}

impl Finding {
    /// All is well.
    pub fn good(what: &'static str, found: impl Into<String>) -> Self {
        Self { what, state: State::Good, found: found.into(), help: None }
    }

    /// A run works, but not as it could.
    pub fn warning(what: &'static str, found: impl Into<String>, help: impl Into<String>) -> Self {
        Self { what, state: State::Warning, found: found.into(), help: Some(help.into()) }
    }

    /// A run fails.
    pub fn bad(what: &'static str, found: impl Into<String>, help: impl Into<String>) -> Self {
        Self { what, state: State::Bad, found: found.into(), help: Some(help.into()) }
    }
}
