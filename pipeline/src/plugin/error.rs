//! What went wrong with a plugin, and what its author or user can do.

use crate::error::StageError;

/// What went wrong with a plugin. The message reads after the plugin's name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what}")]
pub struct PluginError {
    /// What it did, and what was wanted.
    pub what: String,
    /// What to do.
    pub help: String,
    /// What it wrote to stderr, the end of it.
    pub log: String,
    /// Whether the process answered in order and can be used again: the error is about this request alone.
    pub alive: bool,
}

/// Lines of stderr that an error shows.
const SHOWN_LINES: usize = 30;

impl PluginError {
    pub(super) fn new(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self { what: what.into(), help: help.into(), log: String::new(), alive: false }
    }

    /// The process can go on.
    pub(super) fn alive(mut self) -> Self {
        self.alive = true;
        self
    }

    /// The error of a stage that runs the plugin `name`.
    pub(super) fn of(self, name: &str) -> StageError {
        StageError::new(self.message_for(name)).help(self.help)
    }

    /// In one text, the end of stderr included.
    pub fn message_for(&self, name: &str) -> String {
        let lines: Vec<&str> = self.log.lines().collect();
        let first = lines.len().saturating_sub(SHOWN_LINES);
        let mut text = format!("the plugin `{name}` {}", self.what);
        if !lines.is_empty() {
            text.push_str("; its stderr ends with:");
        }
        for line in &lines[first..] {
            text.push_str("\n  ");
            text.push_str(line);
        }
        text
    }
}
