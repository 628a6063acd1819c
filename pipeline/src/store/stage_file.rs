//! Stage files: what one stage made. The unit of the cache.

use std::path::Path;

use hdf5::File;

use super::error::{Result, StoreError};
use super::format::{check_format, write_format};
use super::ports::{read_ports, write_ports};
use super::rows::Backing;
use super::seal::{check_seal, seal};
use super::{read, write};
use crate::runner::StageResult;

const KIND: &str = "stage";
const GROUP: &str = "result";
const WARNINGS: &str = "warnings";

/// Writes a stage's result to a new file, seals and syncs it. Errors: the file exists or cannot be written; an artifact is not valid.
pub fn write_stage(path: &Path, result: &StageResult) -> std::result::Result<(), StoreError> {
    write_unsealed_stage(path, result)?;
    seal(path)
}

/// The same file before it is sealed and synced: what is left needs nothing of the HDF5 library.
pub(crate) fn write_unsealed_stage(path: &Path, result: &StageResult) -> std::result::Result<(), StoreError> {
    let write = || -> Result<()> {
        let file = write::create_file(path)?;
        write_contents(&file, result)?;
        Ok(file.close()?)
    };
    write().map_err(|error| error.file(path))
}

fn write_contents(file: &File, result: &StageResult) -> Result<()> {
    write_format(file, KIND)?;
    write::texts(file, WARNINGS, &result.warnings)?;
    write_ports(&write::group(file, GROUP)?, &result.outputs)
}

/// Reads a stage's result. Large arrays over two axes stay in the file, which is held open for them. Errors: there is no file, it is damaged, or of another version.
pub fn read_stage(path: &Path) -> std::result::Result<StageResult, StoreError> {
    check_seal(path)?;
    read_hdf5(path).map_err(|error| error.file(path))
}

fn read_hdf5(path: &Path) -> Result<StageResult> {
    let backing = Backing::open(path)?;
    let file = read::open_file(path)?;
    check_format(&file, KIND)?;
    let warnings = read::texts(&file, WARNINGS)?;
    Ok(StageResult { outputs: read_ports(&read::group(&file, GROUP)?, Some(&backing))?, warnings })
}
