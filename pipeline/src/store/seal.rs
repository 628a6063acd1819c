//! Seals: the last line of a stage or result file states the BLAKE3 hash of everything before it.
//!
//! A damaged or altered file is found before any HDF5 code looks at it: the library checks its own structures only in part, and some
//! damage keeps it busy for ever. HDF5 readers ignore what lies behind the end that the file's header states.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::error::{Result, StoreError};

const MAGIC: &str = "\nafmid seal, BLAKE3 of all bytes before this line: ";
const HASH_LENGTH: u64 = 64;
const LENGTH: u64 = MAGIC.len() as u64 + HASH_LENGTH + 1;

/// Seals a closed file and syncs it. Errors: it cannot be read or written.
pub(super) fn seal(path: &Path) -> Result<()> {
    let seal = || -> std::io::Result<()> {
        let mut file = OpenOptions::new().read(true).append(true).open(path)?;
        let size = file.metadata()?.len();
        let hash = hash_start(&mut file, size)?;
        file.write_all(format!("{MAGIC}{hash}\n").as_bytes())?;
        file.sync_all()
    };
    seal().map_err(|error| StoreError::io("cannot be sealed", path, &error))
}

/// Errors: no file, no seal, or one that does not fit.
pub(super) fn check_seal(path: &Path) -> Result<()> {
    let io = |error: std::io::Error| StoreError::io("cannot be read", path, &error);
    let mut file = File::open(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    let broken = |problem: &str| {
        Err(StoreError::new(problem).file(path).help("make it again: run the pipeline that it comes from"))
    };
    let Some(body) = size.checked_sub(LENGTH) else {
        return broken("not a file of afmid's: too short");
    };
    let mut last = String::new();
    file.seek(SeekFrom::Start(body)).map_err(io)?;
    if Read::by_ref(&mut file).take(LENGTH).read_to_string(&mut last).is_err() || !last.starts_with(MAGIC) {
        return broken("not a file of afmid's, cut short, or changed by another program: its last line is no seal");
    }
    let hash = hash_start(&mut file, body).map_err(io)?;
    if last != format!("{MAGIC}{hash}\n") {
        return broken("damaged or altered: its bytes do not have the hash that its last line states");
    }
    Ok(())
}

/// BLAKE3 of the first `size` bytes.
fn hash_start(file: &mut File, size: u64) -> std::io::Result<blake3::Hash> {
    file.seek(SeekFrom::Start(0))?;
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; 1 << 18];
    let mut rest = file.take(size);
    loop {
        match rest.read(&mut buffer)? {
            0 => return Ok(hasher.finalize()),
            count => hasher.update(&buffer[..count]),
        };
    }
}
