//! All that goes to stdout and stderr, none of it raw.

use std::io::{ErrorKind, Write};

use crate::failure::Failure;
use crate::printable::printable;

/// Prints on stdout and sees that it arrives. Errors: nobody reads any more ([`Failure::Closed`]); the device is full.
pub fn print(text: &str) -> Result<(), Failure> {
    print_styled(&printable(text))
}

/// The same of text in colour, with nothing of a file's in it that is not printable.
pub fn print_styled(text: &str) -> Result<(), Failure> {
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

/// How a command ends that does not succeed: said on stderr, with its exit code.
pub fn report(failure: Failure) -> u8 {
    let (text, code) = failure.text_and_code();
    say_styled(&text);
    code
}

/// Says something on stderr, in one call, so that lines of several threads don't mix. If stderr takes nothing, there is
/// nowhere left to say so: the exit code still tells.
pub fn say(text: &str) {
    say_styled(&printable(text));
}

fn say_styled(text: &str) {
    if !text.is_empty() {
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
    }
}
