//! Errors in one line.

use crate::FormatError;

/// An error seen at a byte of the file.
pub(crate) fn at(byte: u64, problem: impl Into<String>, help: impl Into<String>) -> FormatError {
    FormatError { at_byte: Some(byte), ..plain(problem, help) }
}

/// An error that belongs to no byte.
pub(crate) fn plain(problem: impl Into<String>, help: impl Into<String>) -> FormatError {
    let help = help.into();
    FormatError { file: None, at_byte: None, problem: problem.into(), help: (!help.is_empty()).then_some(help) }
}

/// The end of the file comes before the end of what its header announces.
pub(crate) fn truncated(what: &str, from: u64, bytes: u64, file_bytes: u64) -> FormatError {
    let problem =
        format!("{what}: wanted {bytes} bytes from byte {from}, found the end of the file at byte {file_bytes}");
    at(from.min(file_bytes), problem, COPY_AGAIN)
}

/// The help where only a fresh copy of the file can help.
pub(crate) const COPY_AGAIN: &str = "the file is damaged or cut off: copy it again from where it was recorded";
