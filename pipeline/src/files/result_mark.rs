//! What marks a stage or result file as this program's, whole or damaged.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

/// The attribute of the root group that names the format of a stage or result file.
pub(crate) const FORMAT_ATTRIBUTE: &str = "afmid_format";

/// Begins the last line of a sealed file, after its line feed.
pub(crate) const SEAL: &str = "\nafmid seal, BLAKE3 of all bytes before this line: ";

/// Bytes of that line: [`SEAL`], a hash in hexadecimal, a line feed.
const SEAL_BYTES: u64 = SEAL.len() as u64 + 64 + 1;

/// What an HDF5 file begins with.
pub(crate) const HDF5_SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// How far into a file the name of its format is looked for. The store writes it first, into the root group's header,
/// some hundred bytes behind the signature.
pub(crate) const HEAD_BYTES: u64 = 1 << 13;

/// Whether an open file, `head` of whose bytes are known, is a stage or result file of this program's. Errors: it
/// cannot be read.
pub(crate) fn is_result(file: &mut File, head: &[u8]) -> std::io::Result<bool> {
    if !head.starts_with(HDF5_SIGNATURE) {
        return Ok(false);
    }
    Ok(memchr::memmem::find(head, FORMAT_ATTRIBUTE.as_bytes()).is_some() || seal_line(file)?.is_some())
}

/// The first [`HEAD_BYTES`] of a file, or all of a shorter one. Errors: it cannot be read.
pub(crate) fn head(file: &mut File) -> std::io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(0))?;
    let mut head = Vec::with_capacity(HEAD_BYTES as usize);
    file.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(head)
}

/// Where the seal of a file begins, and the seal; none if the file ends in anything else. Errors: it cannot be read.
pub(crate) fn seal_line(file: &mut File) -> std::io::Result<Option<(u64, String)>> {
    let Some(body) = file.metadata()?.len().checked_sub(SEAL_BYTES) else { return Ok(None) };
    let mut last = Vec::new();
    file.seek(SeekFrom::Start(body))?;
    Read::by_ref(file).take(SEAL_BYTES).read_to_end(&mut last)?;
    Ok(String::from_utf8(last).ok().filter(|last| last.starts_with(SEAL)).map(|last| (body, last)))
}
