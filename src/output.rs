//! All that goes to stdout and stderr.

use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use crate::failure::{Failure, Message};

/// Prints on stdout and sees that it arrives. Errors: nobody reads any more ([`Failure::Closed`]); the device is full.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::Closed,
        _ => Failure::failed(
            format!("stdout cannot be written: {error}"),
            Some("what was printed so far is not all; send it to another place".to_owned()),
        ),
    })
}

/// Says something on stderr, in one call, so that lines of several threads don't mix. If stderr takes nothing, there is nowhere left to say so:
/// the exit code still tells.
pub fn say(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Says on stderr how a command failed, and gives the exit code.
pub fn report(failure: Failure) -> ExitCode {
    let (message, code) = match failure {
        Failure::Usage(message) => (message, 2),
        Failure::Failed(message) => (message, 1),
        Failure::Partly(message) => (message, 3),
        Failure::Closed => return ExitCode::SUCCESS,
    };
    match message {
        Message::Line(line, help) => {
            let help = help.map(|help| format!("  help: {help}\n")).unwrap_or_default();
            say(&format!("error: {line}\n{help}"));
        }
        Message::Rendered(text) => say(&text),
    }
    ExitCode::from(code)
}
