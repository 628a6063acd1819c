//! Errors in one line.

use common::FormatError;

/// An error seen at a byte of the file.
pub(crate) fn at(byte: u64, problem: impl Into<String>, help: &str) -> FormatError {
    FormatError { at_byte: Some(byte), problem: problem.into(), help: helpful(help) }
}

/// An error that belongs to no byte.
pub(crate) fn plain(problem: impl Into<String>, help: &str) -> FormatError {
    FormatError { at_byte: None, problem: problem.into(), help: helpful(help) }
}

fn helpful(help: &str) -> Option<String> {
    (!help.is_empty()).then(|| help.to_owned())
}

/// The help where only a fresh copy of the file can help.
pub(crate) const COPY_AGAIN: &str = "the file is damaged or cut off: copy it again from where it was recorded";
