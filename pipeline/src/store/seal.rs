//! Seals: the last line of a stage or result file states the BLAKE3 hash of everything before it.
//!
//! A damaged or altered file is found before any HDF5 code looks at it: the library checks its own structures only in
//! part, and some damage keeps it busy for ever. HDF5 readers ignore what lies behind the end that the file's header
//! states.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::file_kind::{FileKind, file_kind};
use crate::error::{Result, StoreError};
use crate::files::{SEAL, open_regular, seal_line};
use crate::hdf5_files::{HeapGuard, Vetted};

/// Bytes that threads hash together.
const SHARED: u64 = 1 << 20;

/// Seals a closed file and syncs it. Errors: it cannot be read or written.
pub(crate) fn seal(path: &Path) -> Result<()> {
    let seal = || -> std::io::Result<()> {
        let mut file = OpenOptions::new().read(true).append(true).open(path)?;
        let size = file.metadata()?.len();
        let hash = hash_start(&mut file, size, |_| {})?;
        file.write_all(format!("{SEAL}{hash}\n").as_bytes())?;
        file.sync_all()
    };
    seal().map_err(|error| StoreError::io("cannot be sealed", path, &error))
}

/// What was found on the way for the HDF5 library. Errors: no file, no seal, or one that does not fit; damage that the
/// library does not survive.
pub(super) fn check_seal(path: &Path) -> Result<Vetted> {
    let io = |error: std::io::Error| StoreError::io("cannot be read", path, &error);
    let mut file = open_regular(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    let broken = |problem: &str| {
        Err(StoreError::new(problem).file(path).help("make it again: run the pipeline that it comes from"))
    };
    let Some((body, last)) = seal_line(&mut file).map_err(io)? else {
        return match file_kind(path).map_err(io)? {
            FileKind::Own => broken("cut short, or changed by another program: its last line is no seal"),
            other => Err(StoreError::new(format!("not a file of afmid's: it is {other}")).file(path)),
        };
    };
    let mut guard = HeapGuard::new(size);
    let hash = hash_start(&mut file, body, |bytes| guard.update(bytes)).map_err(io)?;
    if last != format!("{SEAL}{hash}\n") {
        return broken("damaged or altered: its bytes do not have the hash that its last line states");
    }
    guard.finish().or_else(|refusal| broken(refusal.text()))
}

/// What a file says of itself in its last line.
pub(super) enum Seal {
    /// Its bytes have the hash that the last line states.
    Fits,
    /// They have another.
    DoesNotFit,
    /// The last line is no seal.
    None,
}

/// Errors: the file cannot be read.
pub(super) fn look_at_seal(path: &Path) -> std::io::Result<Seal> {
    let mut file = open_regular(path)?;
    let Some((body, last)) = seal_line(&mut file)? else { return Ok(Seal::None) };
    let hash = hash_start(&mut file, body, |_| {})?;
    Ok(if last == format!("{SEAL}{hash}\n") { Seal::Fits } else { Seal::DoesNotFit })
}

/// BLAKE3 of the first `size` bytes; `each` sees them as they pass.
fn hash_start(file: &mut File, size: u64, mut each: impl FnMut(&[u8])) -> std::io::Result<blake3::Hash> {
    file.seek(SeekFrom::Start(0))?;
    let mut hasher = blake3::Hasher::new();
    // several threads hash large files where there is a pool of them
    let together = size >= 2 * SHARED && rayon::current_thread_index().is_some();
    let mut buffer = vec![0; if together { SHARED as usize } else { 1 << 16 }];
    let mut rest = file.take(size);
    loop {
        let count = rest.read(&mut buffer)?;
        each(&buffer[..count]);
        match count {
            0 => return Ok(hasher.finalize()),
            count if together => hasher.update_rayon(&buffer[..count]),
            count => hasher.update(&buffer[..count]),
        };
    }
}
