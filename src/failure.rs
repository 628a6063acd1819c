//! How a command ends when it does not succeed.

use std::fmt::Display;

use crate::printable::{help_line, message, one_line, printable};

/// How a command ends when it does not succeed.
#[derive(Debug)]
pub enum Failure {
    /// The command line or a config is wrong: exit code 2.
    Usage(Message),
    /// Something failed: exit code 1.
    Failed(Message),
    /// Some data sets of a batch failed, the others did not: exit code 3.
    Partly(Message),
    /// A signal was caught: exit code 128 and its number.
    Interrupted(i32),
    /// The reader of stdout has closed it (`afmid schema | head`): the quiet end, exit code 0.
    Closed,
}

/// What goes to stderr.
#[derive(Debug)]
pub enum Message {
    /// A line, prefixed with `error:`, and what to do.
    Line(String, Option<String>),
    /// The same with lines between the two.
    Listed(String, Vec<String>, Option<String>),
    /// Rendered already.
    Rendered(String),
    /// Rendered already, in colour perhaps; what comes from files in it is printable.
    Styled(String),
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

    /// What goes to stderr, printable, and the exit code.
    pub fn text_and_code(self) -> (String, u8) {
        let (what, code) = match self {
            Self::Usage(message) => (message, 2),
            Self::Failed(message) => (message, 1),
            Self::Partly(message) => (message, 3),
            Self::Interrupted(signal) => {
                let code = u8::try_from(128 + signal).unwrap_or(1);
                return (format!("interrupted by {}: what was finished is kept\n", name(signal)), code);
            }
            Self::Closed => return (String::new(), 0),
        };
        let with = |help: Option<String>| help.as_deref().map(help_line).unwrap_or_default();
        let text = match what {
            Message::Line(line, help) => format!("error: {}\n{}", message(&line), with(help)),
            Message::Listed(line, list, help) => {
                let list: String = list.iter().map(|entry| one_line(entry) + "\n").collect();
                format!("error: {}\n{list}{}", message(&line), with(help))
            }
            Message::Rendered(text) => text,
            Message::Styled(text) => return (text, code),
        };
        (printable(&text).into_owned(), code)
    }
}

/// As the system calls it.
fn name(signal: i32) -> &'static str {
    signal_hook::low_level::signal_name(signal).unwrap_or("a signal")
}
