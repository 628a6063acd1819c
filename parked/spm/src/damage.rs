//! How the readers of this crate say that a file cannot be read.

use common::FormatError;

/// Damaged or refused at a known byte.
pub(crate) fn at(byte: u64, problem: impl Into<String>, help: impl Into<String>) -> FormatError {
    FormatError { at_byte: Some(byte), problem: problem.into(), help: Some(help.into()) }
}

/// Damaged or refused as a whole.
pub(crate) fn whole(problem: impl Into<String>, help: impl Into<String>) -> FormatError {
    FormatError { at_byte: None, problem: problem.into(), help: Some(help.into()) }
}

/// The end of the file comes before the end of what its header announces.
pub(crate) fn truncated(what: &str, from: u64, bytes: u64, file_bytes: u64) -> FormatError {
    at(
        from.min(file_bytes),
        format!("{what}: wanted {bytes} bytes from byte {from}, found the end of the file at byte {file_bytes}"),
        "the file is cut off: copy it again from where it was recorded",
    )
}
