//! How a command ends when it does not succeed.

use std::fmt::Display;

/// How a command ends when it does not succeed.
#[derive(Debug)]
pub enum Failure {
    /// The command line or a config is wrong: exit code 2.
    Usage(Message),
    /// Something failed: exit code 1.
    Failed(Message),
    /// Some data sets of a batch failed, the others did not: exit code 3.
    Partly(Message),
    /// Whoever read stdout has seen enough (`afmid schema | head`): the quiet end, exit code 0.
    Closed,
}

/// What goes to stderr.
#[derive(Debug)]
pub enum Message {
    /// A line, prefixed with `error:`, and what to do.
    Line(String, Option<String>),
    /// Rendered already.
    Rendered(String),
}

impl Failure {
    /// The command line or a config is wrong.
    pub fn usage(message: impl Display, help: Option<String>) -> Self {
        Self::Usage(Message::Line(message.to_string(), help))
    }

    /// Something failed.
    pub fn failed(message: impl Display, help: Option<String>) -> Self {
        Self::Failed(Message::Line(message.to_string(), help))
    }
}
