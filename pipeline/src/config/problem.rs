//! What is wrong with a config, and where.

use std::ops::Range;

/// The text that a place refers to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// The config.
    Config,
    /// A `--set` argument, as it was typed.
    Argument(String),
}

/// Something wrong with a config: what, where, and what to do. Problems are data; the command line renders them.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Problem {
    /// A lowercase fragment: what was found, and what was wanted.
    pub message: String,
    /// The text that `span` refers to.
    pub origin: Origin,
    /// Bytes of that text.
    pub span: Range<usize>,
    /// What to write under the caret.
    pub label: String,
    /// What to do.
    pub help: Option<String>,
}

impl Problem {
    /// A problem at a place of the config.
    pub fn new(message: impl Into<String>, span: Range<usize>, label: impl Into<String>) -> Self {
        Self { message: message.into(), origin: Origin::Config, span, label: label.into(), help: None }
    }

    /// Moves it to a place of another text.
    #[must_use]
    pub fn at(mut self, (origin, span): (Origin, Range<usize>)) -> Self {
        (self.origin, self.span) = (origin, span);
        self
    }

    /// Says what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Says what to do, if there is anything to say.
    #[must_use]
    pub fn maybe_help(mut self, help: Option<String>) -> Self {
        self.help = help.or(self.help);
        self
    }

    /// Brings problems into reading order: the config from top to bottom, then the arguments. Equal ones are kept once.
    pub(crate) fn sort(problems: &mut Vec<Problem>, arguments: &[String]) {
        problems.sort_by_cached_key(|problem| {
            let rank = match &problem.origin {
                Origin::Config => 0,
                Origin::Argument(text) => 1 + arguments.iter().take_while(|argument| *argument != text).count(),
            };
            (rank, problem.span.start)
        });
        problems.dedup();
    }
}
