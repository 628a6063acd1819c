//! How a command ends when it does not succeed.

use std::fmt::Display;
use std::process::ExitCode;

/// How a command ends when it does not succeed.
#[derive(Debug)]
pub enum Failure {
    /// The command line or a config is wrong: exit code 2.
    Usage(Message),
    /// Something failed: exit code 1.
    Failed(Message),
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

    /// Says it on stderr, and gives the exit code.
    pub fn report(self) -> ExitCode {
        let (message, code) = match self {
            Self::Usage(message) => (message, 2),
            Self::Failed(message) => (message, 1),
        };
        match message {
            Message::Line(line, help) => {
                eprintln!("error: {line}");
                if let Some(help) = help {
                    eprintln!("  help: {help}");
                }
            }
            Message::Rendered(text) => eprint!("{text}"),
        }
        ExitCode::from(code)
    }
}
