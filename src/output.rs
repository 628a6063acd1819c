//! All that goes to stdout and stderr.

use std::io::{ErrorKind, Write};

use crate::failure::Failure;

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
