//! Stage files: what one stage made, with a checksum. The unit of the cache.
//!
//! The file is HDF5 behind a user block of 512 bytes that holds the BLAKE3 hash of everything after it: a damaged file is found
//! before any HDF5 code looks at it.

use std::fs;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::error::{Result, StoreError};
use super::format::{check_format, write_format};
use super::ports::{read_ports, write_ports};
use super::{read, write};
use crate::runner::StageResult;

const KIND: &str = "stage";
const GROUP: &str = "result";
const WARNINGS: &str = "warnings";
const MAGIC: &str = "afmid stage file, BLAKE3 of what follows byte 512: ";

/// Writes a stage's result to a new file and syncs it. Errors: the file exists or cannot be written; an artifact is not valid.
pub fn write_stage(path: &Path, result: &StageResult) -> std::result::Result<(), StoreError> {
    write_hdf5(path, result).map_err(|error| error.file(path))?;
    seal(path).map_err(|error| StoreError::io("cannot be written", path, &error))
}

fn write_hdf5(path: &Path, result: &StageResult) -> Result<()> {
    let file = write::create_file(path, write::USER_BLOCK)?;
    write_format(&file, KIND)?;
    write::texts(&file, WARNINGS, &result.warnings)?;
    write_ports(&write::group(&file, GROUP)?, &result.outputs)?;
    Ok(file.close()?)
}

/// Hashes the file's HDF5 part, writes the hash in front of it, and syncs.
fn seal(path: &Path) -> std::io::Result<()> {
    let mut file = fs::OpenOptions::new().read(true).write(true).open(path)?;
    let hash = hash_body(&mut file)?;
    let mut block = format!("{MAGIC}{hash}\n").into_bytes();
    block.resize(write::USER_BLOCK as usize, 0);
    file.seek(SeekFrom::Start(0))?;
    file.write_all(&block)?;
    file.sync_all()
}

fn hash_body(file: &mut fs::File) -> std::io::Result<blake3::Hash> {
    file.seek(SeekFrom::Start(write::USER_BLOCK))?;
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hasher.finalize()),
            count => hasher.update(&buffer[..count]),
        };
    }
}

/// Reads a stage's result. Errors: there is no file, it is damaged, or of another version.
pub fn read_stage(path: &Path) -> std::result::Result<StageResult, StoreError> {
    check_seal(path)?;
    read_hdf5(path).map_err(|error| error.file(path))
}

fn check_seal(path: &Path) -> Result<()> {
    let io = |error: std::io::Error| StoreError::io("cannot be read", path, &error);
    let mut file = fs::File::open(path).map_err(io)?;
    let mut block = Vec::new();
    Read::by_ref(&mut file).take(write::USER_BLOCK).read_to_end(&mut block).map_err(io)?;
    let hash = hash_body(&mut file).map_err(io)?;
    if !block.starts_with(format!("{MAGIC}{hash}\n").as_bytes()) {
        return Err(StoreError::new("not a stage file, or damaged: its bytes do not have the hash that it states")
            .file(path)
            .help("remove it: the next run writes it again"));
    }
    Ok(())
}

fn read_hdf5(path: &Path) -> Result<StageResult> {
    let file = read::open_file(path)?;
    check_format(&file, KIND)?;
    let warnings = read::texts(&file, WARNINGS)?;
    Ok(StageResult { outputs: read_ports(&read::group(&file, GROUP)?)?, warnings })
}
